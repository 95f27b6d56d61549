//! Estimates with their 95 % confidence intervals.
//!
//! - means, and means of differences: Student's t;
//! - rates: Wilson's score interval, which stays within 0 and 1 and is of use at 100 %;
//! - everything else (relative changes of means, medians, percentiles): the percentile bootstrap,
//!   [`RESAMPLES`] resamples with a fixed seed, so that the same rows give the same digits.
//!
//! Comparisons are paired: scenario by scenario, with what both starts solved.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Serialize;

/// Resamples of a bootstrap.
pub const RESAMPLES: usize = 5_000;

/// Two-sided 95 % quantile of the normal distribution.
const NORMAL: f64 = 1.959_963_984_540_054;

/// A percentile of sorted numbers, of which there is at least one: linear between neighbours.
pub fn percentile(sorted: &[f64], fraction: f64) -> f64 {
    let at = fraction * (sorted.len() - 1) as f64;
    let (below, above) = (at.floor() as usize, at.ceil() as usize);
    sorted[below] + (sorted[above] - sorted[below]) * (at - at.floor())
}

/// A number with its 95 % confidence interval; NaN where there is too little to say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Mean and spread of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// How many there are.
    pub count: usize,
    /// The mean.
    pub mean: Estimate,
    /// Standard deviation of the sample.
    pub std: f64,
}

impl Mean {
    /// Of some numbers.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        // Of one number 0 / 0: its spread is unknown.
        let std = (squares / (n - 1.0)).sqrt();
        let half = student(values.len().saturating_sub(1)) * std / n.sqrt();
        let mean = Estimate { value: mean, low: mean - half, high: mean + half };
        Self { count: values.len(), mean, std }
    }
}

/// So many of so many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// How many did.
    pub count: usize,
    /// Of how many.
    pub of: usize,
    /// Their ratio, with Wilson's interval.
    pub rate: Estimate,
}

impl Rate {
    /// `count` of `of`.
    pub fn new(count: usize, of: usize) -> Self {
        let (n, p) = (of as f64, count as f64 / of as f64);
        let z2 = NORMAL * NORMAL;
        let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = NORMAL / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
        let rate = Estimate { value: p, low: (centre - half).max(0.0), high: centre + half };
        Self { count, of, rate: Estimate { high: rate.high.min(1.0), ..rate } }
    }
}

/// A percentile, linear between neighbours.
pub fn quantile(values: &[f64], fraction: f64) -> Estimate {
    bootstrap(values.len(), |indices| {
        let mut drawn: Vec<f64> = indices.iter().map(|i| values[*i]).collect();
        drawn.sort_by(f64::total_cmp);
        percentile(&drawn, fraction)
    })
}

/// Change of the mean from the first to the second of each pair, relative to the first's.
pub fn relative_change(pairs: &[(f64, f64)]) -> Estimate {
    bootstrap(pairs.len(), |indices| {
        let sum = |of: fn(&(f64, f64)) -> f64| indices.iter().map(|i| of(&pairs[*i])).sum::<f64>();
        sum(|pair| pair.1) / sum(|pair| pair.0) - 1.0
    })
}

/// Mean of the second minus the first of each pair.
pub fn mean_difference(pairs: &[(f64, f64)]) -> Estimate {
    Mean::of(&differences(pairs)).mean
}

/// Median of the second minus the first of each pair.
pub fn median_difference(pairs: &[(f64, f64)]) -> Estimate {
    quantile(&differences(pairs), 0.5)
}

fn differences(pairs: &[(f64, f64)]) -> Vec<f64> {
    pairs.iter().map(|(a, b)| b - a).collect()
}

/// A statistic of `count` observations, which it gets by their indices, and the interval of it
/// over resamples.
fn bootstrap(count: usize, statistic: impl Fn(&[usize]) -> f64) -> Estimate {
    if count < 2 {
        let value = if count == 1 { statistic(&[0]) } else { f64::NAN };
        return Estimate { value, low: f64::NAN, high: f64::NAN };
    }
    let all: Vec<usize> = (0..count).collect();
    let mut stream = ChaCha8Rng::from_seed([0; 32]);
    let mut indices = all.clone();
    let resample = |_| {
        // The bias of a remainder of 64 bits is far below anything that could be seen.
        indices.fill_with(|| (stream.next_u64() % count as u64) as usize);
        statistic(&indices)
    };
    let mut drawn: Vec<f64> = (0..RESAMPLES).map(resample).collect();
    drawn.sort_by(f64::total_cmp);
    let [low, high] = [0.025, 0.975].map(|fraction| percentile(&drawn, fraction));
    Estimate { value: statistic(&all), low, high }
}

/// Two-sided 95 % quantile of Student's t: a table for few degrees of freedom, then the expansion
/// about the normal quantile (Abramowitz and Stegun 26.7.5), within 1e-3.
fn student(freedom: usize) -> f64 {
    const FEW: [f64; 4] = [12.706_2, 4.302_7, 3.182_4, 2.776_4];
    match freedom {
        0 => f64::NAN,
        1..=4 => FEW[freedom - 1],
        _ => {
            let (n, z) = (freedom as f64, NORMAL);
            let z2 = z * z;
            let terms = [
                (z2 + 1.0) / 4.0,
                ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
                (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
            ];
            z * (1.0 + terms[0] / n + terms[1] / n.powi(2) + terms[2] / n.powi(3))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, tolerance: f64) -> bool {
        (a - b).abs() <= tolerance
    }

    #[test]
    fn quantiles_of_student_are_those_of_the_tables() {
        for (freedom, t) in
            [(1, 12.706), (4, 2.776), (5, 2.571), (10, 2.228), (30, 2.042), (299, 1.968)]
        {
            assert!(near(student(freedom), t, 4e-3), "{freedom}: {}", student(freedom));
        }
        assert!(near(student(1_000_000), NORMAL, 1e-5));
    }

    #[test]
    fn means_by_hand() {
        let m = Mean::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!((m.count, m.mean.value), (5, 3.0));
        assert!(near(m.std, 2.5f64.sqrt(), 1e-15));
        // 3 +- 2.776 sqrt(2.5 / 5)
        assert!(near(m.mean.low, 1.0368, 1e-4) && near(m.mean.high, 4.9632, 1e-4));
        assert!(Mean::of(&[]).mean.value.is_nan());
        let one = Mean::of(&[7.0]);
        assert_eq!(one.mean.value, 7.0);
        assert!(one.mean.low.is_nan() && one.std.is_nan());
    }

    #[test]
    fn rates_by_hand() {
        // Wilson's interval of 300 of 300 reaches down to 1 / (1 + z^2 / 300).
        let all = Rate::new(300, 300).rate;
        assert!(all.value == 1.0 && near(all.high, 1.0, 1e-12));
        assert!(near(all.low, 1.0 / (1.0 + NORMAL * NORMAL / 300.0), 1e-12));
        // 8 of 10: 0.490 to 0.943, Newcombe 1998.
        let most = Rate::new(8, 10).rate;
        assert!(near(most.low, 0.4902, 1e-4) && near(most.high, 0.9433, 1e-4), "{most:?}");
        assert_eq!(Rate::new(0, 10).rate.low, 0.0);
        assert!(Rate::new(0, 0).rate.value.is_nan());
    }

    /// 400 numbers that are as good as random.
    fn noise(seed: u8) -> Vec<f64> {
        let mut stream = ChaCha8Rng::from_seed([seed; 32]);
        (0..400).map(|_| (stream.next_u64() >> 11) as f64 / (1u64 << 53) as f64).collect()
    }

    #[test]
    fn the_bootstrap_of_a_mean_is_the_interval_of_student() {
        let values = noise(1);
        let pairs: Vec<_> = values.iter().map(|x| (1.0, 1.0 + x)).collect();
        let (by_t, by_draws) = (Mean::of(&values).mean, relative_change(&pairs));
        assert!(near(by_t.value, by_draws.value, 1e-12));
        assert!(near(by_t.low, by_draws.low, 2e-3), "{by_t:?} {by_draws:?}");
        assert!(near(by_t.high, by_draws.high, 2e-3), "{by_t:?} {by_draws:?}");
        assert_eq!(by_draws, relative_change(&pairs));
    }

    #[test]
    fn pairing_sees_what_the_spread_hides() {
        let pairs: Vec<_> = noise(2).iter().map(|x| (100.0 * x, 100.0 * x - 1.0)).collect();
        for estimate in [mean_difference(&pairs), median_difference(&pairs)] {
            assert!(near(estimate.value, -1.0, 1e-9));
            assert!(near(estimate.low, -1.0, 1e-9) && near(estimate.high, -1.0, 1e-9));
        }
        let change = relative_change(&pairs);
        assert!(change.high < 0.0 && near(change.value, -0.02, 2e-3), "{change:?}");
    }

    #[test]
    fn quantiles_have_intervals_that_hold_them() {
        let p99 = quantile(&noise(3), 0.99);
        assert!(p99.low < p99.value && p99.value <= p99.high && p99.value > 0.97, "{p99:?}");
        assert!(quantile(&[], 0.5).value.is_nan());
        assert_eq!(quantile(&[3.0], 0.5).value, 3.0);
    }
}
