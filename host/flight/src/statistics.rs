//! Statistics over flights: percentiles, exact confidence bounds of shares, rank correlations.

use crate::flight::Ending;
use crate::row::{Drawn, FlownRow, Row};
use remora_host::statistics::percentile;
use serde::Serialize;

/// Confidence of the bounds of shares, one-sided.
pub const CONFIDENCE: f64 = 0.95;

/// How a quantity is spread over the flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Its name, with the unit at the end.
    pub name: &'static str,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99.73rd percentile.
    pub p99_73: f64,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    /// Of the finite numbers among `values`; none where there is none.
    pub fn of(name: &'static str, values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let worst = *sorted.last()?;
        Some(Self {
            name,
            mean: sorted.iter().sum::<f64>() / sorted.len() as f64,
            median: percentile(&sorted, 0.5),
            p95: percentile(&sorted, 0.95),
            p99_73: percentile(&sorted, 0.9973),
            worst,
        })
    }
}

/// So many of so many, with one-sided bounds (Clopper and Pearson 1934).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// How many did.
    pub count: u64,
    /// Of how many.
    pub of: u64,
    /// Their ratio.
    pub share: f64,
    /// What the share is at least, with [`CONFIDENCE`].
    pub at_least: f64,
    /// What it is at most, with [`CONFIDENCE`].
    pub at_most: f64,
}

impl Share {
    /// `count` of `of`.
    pub fn new(count: u64, of: u64) -> Self {
        let alpha = 1.0 - CONFIDENCE;
        Self {
            count,
            of,
            share: count as f64 / of as f64,
            at_least: lower_bound(count, of, alpha),
            at_most: 1.0 - lower_bound(of - count, of, alpha),
        }
    }
}

/// The share whose chance of `count` or more successes in `of` tries is `alpha`: Clopper and Pearson's
/// lower bound.
pub fn lower_bound(count: u64, of: u64, alpha: f64) -> f64 {
    if count == 0 {
        return 0.0;
    }
    // The chance grows with the share: halving finds it to rounding.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if chance_of_at_least(count, of, middle) < alpha { low = middle } else { high = middle }
    }
    low
}

/// Chance of `count` or more successes in `of` tries of chance `p` each.
fn chance_of_at_least(count: u64, of: u64, p: f64) -> f64 {
    if p <= 0.0 || p >= 1.0 {
        return p.clamp(0.0, 1.0);
    }
    // Terms in logarithms, from the number of ways upwards.
    let ln_ways = |k: u64| ln_factorial(of) - ln_factorial(k) - ln_factorial(of - k);
    let term = |k: u64| {
        libm::exp(ln_ways(k) + k as f64 * libm::log(p) + (of - k) as f64 * libm::log1p(-p))
    };
    // The shorter of the two sums.
    match count > of / 2 {
        true => (count..=of).map(term).sum(),
        false => 1.0 - (0..count).map(term).sum::<f64>(),
    }
}

fn ln_factorial(n: u64) -> f64 {
    libm::lgamma(n as f64 + 1.0)
}

/// Spearman's rank correlation; none of fewer than three pairs, or where one does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let (x, y) = (ranks(x), ranks(y));
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        x.iter().zip(&y).map(|(x, y)| of(x - mx, y - my)).sum::<f64>()
    };
    let (xx, yy, xy) = (sum(&|x, _| x * x), sum(&|_, y| y * y), sum(&|x, y| x * y));
    (x.len() >= 3 && xx > 0.0 && yy > 0.0).then(|| xy / (xx * yy).sqrt())
}

/// Ranks from one; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    for same in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let before = order.iter().position(|i| *i == same[0]).unwrap_or(0);
        let rank = before as f64 + 0.5 * (same.len() as f64 + 1.0);
        same.iter().for_each(|i| ranks[*i] = rank);
    }
    ranks
}

/// How much the miss goes with an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Influence {
    /// Name of the error.
    pub name: String,
    /// Rank correlation of the miss with how far the error is from its middle.
    pub correlation: f64,
}

/// Errors by how much the miss goes with them, the most first: what to improve first.
pub fn influences(rows: &[FlownRow], drawn: &[Drawn]) -> Vec<Influence> {
    let miss: Vec<f64> = rows.iter().map(|row| row.arrival.miss_m).collect();
    let of = |i: usize| {
        let mut values: Vec<f64> =
            rows.iter().map(|row| row.drawn.get(i).copied().unwrap_or(f64::NAN)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = percentile(&sorted, 0.5);
        values.iter_mut().for_each(|value| *value = (*value - middle).abs());
        rank_correlation(&values, &miss)
    };
    if rows.is_empty() {
        return Vec::new();
    }
    let each = drawn.iter().enumerate().filter_map(|(i, drawn)| {
        of(i).map(|correlation| Influence { name: drawn.name.clone(), correlation })
    });
    let mut all: Vec<Influence> = each.collect();
    all.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    all
}

/// Statistics over flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this file's form.
    pub format: &'static str,
    /// Runs in all.
    pub runs: u64,
    /// Runs that had no plan to fly.
    pub without_plan: u64,
    /// Share of flights that ended so: captured, missed, collided, aborted.
    pub endings: Vec<(&'static str, Share)>,
    /// Flights that passed a limit, by its name.
    pub violations: Vec<(String, u64)>,
    /// How quantities are spread.
    pub spreads: Vec<Spread>,
    /// Plans made in flight: all, and those that were verified.
    pub replans: [u64; 2],
    /// What to improve first: the ten errors that the miss goes with most.
    pub influences: Vec<Influence>,
}

impl Summary {
    /// Over some rows.
    pub fn of(rows: &[Row], drawn: &[Drawn]) -> Self {
        let flown: Vec<FlownRow> = rows.iter().filter_map(|row| row.flown.clone()).collect();
        let count = flown.len() as u64;
        let ended = |ending: Ending| {
            let so = flown.iter().filter(|row| row.ending == ending).count() as u64;
            (ending.name(), Share::new(so, count))
        };
        let endings = [Ending::Captured, Ending::Missed, Ending::Collided, Ending::Aborted];
        let mut violations = std::collections::BTreeMap::<String, u64>::new();
        for name in flown.iter().flat_map(|row| &row.violations) {
            *violations.entry(name.clone()).or_default() += 1;
        }
        let spread = |name, of: &dyn Fn(&FlownRow) -> f64| Spread::of(name, flown.iter().map(of));
        let spreads = [
            spread("miss_m", &|row| row.arrival.miss_m),
            spread("angle_deg", &|row| row.arrival.angle_rad.to_degrees()),
            spread("speed_m_s", &|row| row.arrival.speed_m_s),
            spread("joint_rate_over_limit", &|row| row.room.joint_rate),
            spread("tracking_position_m", &|row| row.tracking[0]),
            spread("tracking_attitude_deg", &|row| row.tracking[1].to_degrees()),
            spread("impulse_n_s", &|row| row.impulse_n_s),
        ];
        let mut influences = influences(&flown, drawn);
        influences.truncate(10);
        Self {
            format: "remora-flights-summary/1",
            runs: rows.len() as u64,
            without_plan: rows.len() as u64 - count,
            endings: if count > 0 { endings.map(ended).to_vec() } else { Vec::new() },
            violations: violations.into_iter().collect(),
            spreads: spreads.into_iter().flatten().collect(),
            replans: [0, 1].map(|i| flown.iter().map(|row| u64::from(row.replans[i])).sum()),
            influences,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures of other programs: `scipy.stats.beta.ppf(0.05, k, n - k + 1)`.
    #[test]
    fn bounds_are_clopper_and_pearsons() {
        assert!((lower_bound(1108, 1108, 0.05) - 0.05_f64.powf(1.0 / 1108.0)).abs() < 1e-12);
        // As many flights without a failure as show 99.73 %.
        assert!(lower_bound(1109, 1109, 0.05) >= 0.9973 && lower_bound(1108, 1108, 0.05) < 0.9973);
        // Of ten tries: 0.05 = (1 - p)^10 for none of the failures, and tables for eight.
        assert!((lower_bound(8, 10, 0.05) - 0.493_099_5).abs() < 1e-6);
        assert!((Share::new(0, 20).at_most - (1.0 - 0.05_f64.powf(0.05))).abs() < 1e-12);
        assert_eq!(Share::new(0, 20).at_least, 0.0);
        assert_eq!(Share::new(20, 20).at_most, 1.0);
    }

    #[test]
    fn ranks_correlate_whatever_the_shape() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        let cubes = x.map(|x| x * x * x);
        assert!((rank_correlation(&x, &cubes).unwrap() - 1.0).abs() < 1e-12);
        assert!((rank_correlation(&x, &x.map(|x| -x)).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&x, &[2.0; 5]), None);
        // By hand: ranks 1, 2.5, 2.5, 4 against 1, 3, 2, 4.
        let rho = rank_correlation(&[1.0, 2.0, 2.0, 3.0], &[0.0, 5.0, 4.0, 9.0]).unwrap();
        assert!((rho - 4.5 / (4.5_f64 * 5.0).sqrt()).abs() < 1e-12, "{rho}");
    }
}
