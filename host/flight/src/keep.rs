//! Choice of the runs whose histories are kept: `failures,worst=20,sample=10`.

use crate::flight::Ending;
use crate::row::Row;
use std::collections::BTreeSet;
use std::str::FromStr;

/// Choice of the runs whose histories are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Keep {
    /// All of them.
    pub all: bool,
    /// Those that did not end in a capture, or passed a limit.
    pub failures: bool,
    /// So many with the largest miss.
    pub worst: usize,
    /// So many spread evenly over all.
    pub sample: usize,
}

impl FromStr for Keep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut keep = Self::default();
        for part in text.split(',') {
            let number = |n: &str| {
                n.parse::<usize>().map_err(|_| format!("{part:?}: {n:?} is no whole number"))
            };
            match part.split_once('=') {
                None if part == "all" => keep.all = true,
                None if part == "failures" => keep.failures = true,
                Some(("worst", n)) => keep.worst = number(n)?,
                Some(("sample", n)) => keep.sample = number(n)?,
                _ => {
                    return Err(format!(
                        "{part:?}: expected all, failures, worst=N or sample=N, with commas"
                    ));
                }
            }
        }
        Ok(keep)
    }
}

impl Keep {
    /// The runs to keep, in their order.
    pub fn chosen(&self, rows: &[Row]) -> BTreeSet<u64> {
        let mut chosen = BTreeSet::new();
        let mut by_miss: Vec<(f64, u64)> = Vec::new();
        for row in rows {
            let Some(flown) = &row.flown else { continue };
            let failed = flown.ending != Ending::Captured || !flown.violations.is_empty();
            if self.all || (self.failures && failed) {
                chosen.insert(row.run);
            }
            by_miss.push((flown.arrival.miss_m, row.run));
        }
        let flown: Vec<u64> = by_miss.iter().map(|(_, run)| *run).collect();
        by_miss.sort_by(|a, b| b.0.total_cmp(&a.0));
        chosen.extend(by_miss.iter().take(self.worst).map(|(_, run)| *run));
        let count = self.sample.min(flown.len());
        chosen.extend((0..count).map(|i| flown[i * flown.len() / count]));
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_to_keep_is_read_and_nonsense_is_named() {
        let keep: Keep = "failures,worst=20,sample=10".parse().unwrap();
        assert_eq!(keep, Keep { all: false, failures: true, worst: 20, sample: 10 });
        for wrong in ["", "best=3", "worst", "worst=x", "failures,,"] {
            assert!(wrong.parse::<Keep>().is_err(), "{wrong}");
        }
    }
}
