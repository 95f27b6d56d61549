//! One of several parts of the same work: which share is its own, and what its files are called.

use crate::error::Error;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Most parts of a work.
pub const MOST: u64 = 100_000;

/// End of the names of files of rows.
const ROWS: &str = ".jsonl";

/// Part `number` of `of`, counted from 1; written `17/1000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Part {
    number: u64,
    of: u64,
}

impl Part {
    /// All of them.
    pub fn all(of: u64) -> impl Iterator<Item = Self> {
        (1..=of).map(move |number| Self { number, of })
    }

    /// Its number, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// How many there are.
    pub fn of(self) -> u64 {
        self.of
    }

    /// Its share of so many; shares differ by one at most and follow each other.
    pub fn range(self, count: u64) -> Range<u64> {
        let end = |number: u64| {
            let end = u128::from(number) * u128::from(count) / u128::from(self.of);
            u64::try_from(end).unwrap_or(count)
        };
        end(self.number - 1)..end(self.number)
    }

    /// Refuses to share out fewer things than there are parts.
    ///
    /// # Errors
    /// How many parts there may be.
    pub fn check(self, count: u64, what: &str) -> Result<(), Error> {
        match self.of <= count {
            true => Ok(()),
            false => {
                let reason = format!(
                    "is {self}, and there are {count} {what}: ask for {count} parts at most"
                );
                Err(Error::argument("--part", reason))
            }
        }
    }

    /// Start of the names of its files, which sort as the parts do.
    pub fn stem(self) -> String {
        format!("part-{:05}-of-{:05}", self.number, self.of)
    }

    /// Its table in a directory.
    pub fn table(self, directory: &Path) -> PathBuf {
        directory.join(format!("{}.parquet", self.stem()))
    }

    /// Its rows in a directory.
    pub fn rows(self, directory: &Path) -> PathBuf {
        directory.join(self.stem() + ROWS)
    }
}

impl Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| {
            let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
            let both = digits(number) && digits(of);
            both.then(|| Some((number.parse().ok()?, of.parse().ok()?))).flatten()
        });
        let (number, of): (u64, u64) = numbers.ok_or("expected a part such as 17/1000")?;
        match (1..=of).contains(&number) && of <= MOST {
            true => Ok(Self { number, of }),
            false => Err(format!("parts are 1/N to N/N, with N up to {MOST}")),
        }
    }
}

impl TryFrom<String> for Part {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Part> for String {
    fn from(part: Part) -> Self {
        part.to_string()
    }
}

/// The files of rows of the parts in a directory, in order.
///
/// # Errors
/// A directory that cannot be read or holds none; parts of several numbers.
pub fn files(directory: &Path) -> Result<Vec<(Part, PathBuf)>, Error> {
    let entries = std::fs::read_dir(directory)
        .map_err(|cause| Error::input(directory, "", crate::error::io_reason(&cause)))?;
    let mut found: Vec<(Part, PathBuf)> = entries
        .flatten()
        .filter_map(|entry| Some((of_name(entry.file_name().to_str()?)?, entry.path())))
        .collect();
    found.sort();
    let Some((first, _)) = found.first().cloned() else {
        return Err(Error::input(directory, "", "holds no part: there is no part-*-of-*.jsonl"));
    };
    match found.iter().find(|(part, _)| part.of != first.of) {
        Some((other, file)) => {
            let reason = format!("is one of {} parts, others are of {}", other.of, first.of);
            Err(Error::input(file, "", reason))
        }
        None => Ok(found),
    }
}

/// Refuses a directory of parts that also holds a file of other work: gathering takes all for one
/// work's.
///
/// # Errors
/// The file; `what` it is of.
pub fn alone(directory: &Path, others: &[&str], what: &str) -> Result<(), Error> {
    let there = others.iter().map(|name| directory.join(name)).find(|file| file.exists());
    match there.filter(|_| files(directory).is_ok()) {
        Some(file) => {
            let reason = format!(
                "is of {what}, and there are parts of a campaign beside it: move either elsewhere"
            );
            Err(Error::input(&file, "", reason))
        }
        None => Ok(()),
    }
}

fn of_name(name: &str) -> Option<Part> {
    let (number, of) = name.strip_prefix("part-")?.strip_suffix(ROWS)?.split_once("-of-")?;
    let part = format!("{number}/{of}").parse::<Part>().ok()?;
    (part.stem() + ROWS == name).then_some(part)
}

/// Parts of `of` that are not among the files.
pub fn missing(files: &[(Part, PathBuf)], of: u64) -> Vec<Part> {
    Part::all(of)
        .filter(|part| files.binary_search_by_key(part, |(there, _)| *there).is_err())
        .collect()
}

/// Indices of a sample: one of each of as many equal shares, by a draw that is always the same.
pub fn picked(sample: u64, count: u64) -> Vec<u64> {
    let mut stream = ChaCha8Rng::from_seed([0; 32]);
    let sample = sample.min(count);
    let share = |i: u64| {
        let at = u128::from(i) * u128::from(count) / u128::from(sample.max(1));
        u64::try_from(at).unwrap_or(count)
    };
    (0..sample).map(|i| share(i) + stream.next_u64() % (share(i + 1) - share(i))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn parts_are_all_and_each_once(count in 0u64..1_000_000, of in 1u64..200) {
            let mut next = 0;
            for part in Part::all(of) {
                let range = part.range(count);
                prop_assert_eq!(range.start, next);
                let size = range.end - range.start;
                prop_assert!(size == count / of || size == count / of + 1);
                next = range.end;
                prop_assert_eq!(of_name(&(part.stem() + ROWS)), Some(part));
            }
            prop_assert_eq!(next, count);
        }
    }

    #[test]
    fn parts_are_numbered_from_one() {
        let part: Part = "17/1000".parse().unwrap();
        assert_eq!((part.number(), part.of(), part.to_string()), (17, 1000, "17/1000".into()));
        assert_eq!(part.stem(), "part-00017-of-01000");
        for text in ["0/3", "4/3", "1/0", "1/100001"] {
            assert!(text.parse::<Part>().unwrap_err().starts_with("parts are 1/N"), "{text}");
        }
        for text in ["", "3", "1/", "/3", "a/3", "1/3/5", "-1/3", "+1/3", "1 /3"] {
            assert!(text.parse::<Part>().unwrap_err().starts_with("expected a part"), "{text}");
        }
        assert!(part.check(999, "scenarios").is_err() && part.check(1000, "scenarios").is_ok());
    }

    #[test]
    fn what_is_missing_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let touch = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
        let reason = files(folder.path()).unwrap_err().to_string();
        assert!(reason.contains("holds no part"), "{reason}");
        touch("part-00002-of-00004.jsonl");
        touch("part-00004-of-00004.jsonl");
        touch("part-4-of-4.jsonl");
        touch("part-00003-of-00004.journal.jsonl");
        touch("part-00003-of-00004.parquet");
        let found = files(folder.path()).unwrap();
        let missing: Vec<String> = missing(&found, 4).iter().map(Part::to_string).collect();
        assert_eq!((found.len(), missing), (2, vec!["1/4".to_string(), "3/4".to_string()]));
        touch("part-00001-of-00003.jsonl");
        let reason = files(folder.path()).unwrap_err().to_string();
        assert!(reason.contains("is one of") && reason.contains("others are of"), "{reason}");
    }

    #[test]
    fn a_sample_is_spread_evenly_and_a_full_one_is_all() {
        assert_eq!(picked(5, 3), [0, 1, 2]);
        assert_eq!(picked(0, 3), [0u64; 0]);
        let some = picked(10, 1000);
        for (i, index) in (0u64..).zip(&some) {
            assert!((100 * i..100 * (i + 1)).contains(index), "{some:?}");
        }
        assert_eq!(some, picked(10, 1000));
    }
}
