//! Estimates with their 95 % confidence intervals.
//!
//! - means, and means of differences: Student's t;
//! - rates: Wilson's score interval, which stays within 0 and 1 and is of use at 100 %;
//! - shares: Clopper and Pearson's bounds, which are exact, one-sided but for [`exact`];
//! - rank correlations: Spearman's, with Student's t;
//! - everything else (relative changes of means, medians, percentiles): the percentile bootstrap,
//!   [`RESAMPLES`] resamples with a fixed seed, so that the same rows give the same digits.
//!
//! Comparisons are paired: scenario by scenario, with what both starts solved.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, StudentsT};
use statrs::statistics::{Data, OrderStatistics, RankTieBreaker, Statistics};

/// Resamples of a bootstrap.
pub const RESAMPLES: usize = 5_000;

/// Two-sided 95 % quantile of the normal distribution.
pub const NORMAL: f64 = 1.959_963_984_540_054;

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
    /// Computes the mean of some numbers.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        // One number gives 0 / 0: its spread is unknown.
        let std = (squares / (n - 1.0)).sqrt();
        let half = student(values.len().saturating_sub(1)) * std / n.sqrt();
        let mean = Estimate { value: mean, low: mean - half, high: mean + half };
        Self { count: values.len(), mean, std }
    }
}

/// Successes in a number of tries, with their ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// How many did.
    pub count: usize,
    /// Number of tries.
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

/// Confidence of the bounds of shares, one-sided.
pub const CONFIDENCE: f64 = 0.95;

/// Successes in a number of tries, with one-sided bounds (Clopper and Pearson 1934).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// How many did.
    pub count: u64,
    /// Number of tries.
    pub of: u64,
    /// Their ratio.
    pub share: f64,
    /// Lower bound of the share, one-sided with [`CONFIDENCE`].
    pub at_least: f64,
    /// Upper bound of the share, one-sided with [`CONFIDENCE`].
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

/// The share of `count` among `of` with its exact two-sided interval (Clopper and Pearson 1934).
pub fn exact(count: u64, of: u64) -> Estimate {
    let alpha = 0.5 * (1.0 - CONFIDENCE);
    let low = lower_bound(count, of, alpha);
    let high = 1.0 - lower_bound(of - count, of, alpha);
    Estimate { value: count as f64 / of as f64, low, high }
}

/// The share whose chance of `count` or more successes in `of` tries is `alpha`: Clopper and Pearson's
/// lower bound.
pub fn lower_bound(count: u64, of: u64, alpha: f64) -> f64 {
    let share = Beta::new(count as f64, (of - count + 1) as f64);
    // The distribution does not exist for zero successes.
    share.map_or(0.0, |share| share.inverse_cdf(alpha))
}

/// Spearman's rank correlation; none of fewer than three pairs, or where one does not vary or is NaN.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    if x.len() < 3 || x.iter().chain(y).any(|value| value.is_nan()) {
        return None;
    }
    let ranks = |values: &[f64]| Data::new(values.to_vec()).ranks(RankTieBreaker::Average);
    let (x, y) = (ranks(x), ranks(y));
    let (xx, yy) = (x.iter().variance(), y.iter().variance());
    let xy = x.iter().covariance(y.iter());
    (xx > 0.0 && yy > 0.0).then(|| xy / (xx * yy).sqrt())
}

/// Chance that independent numbers give a rank correlation of `pairs` as far from zero, by Student's t.
pub fn correlation_chance(correlation: f64, pairs: usize) -> f64 {
    let freedom = pairs as f64 - 2.0;
    let t = correlation.abs() * (freedom / (1.0 - correlation * correlation)).sqrt();
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |student| 2.0 * student.sf(t))
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

/// Degrees of freedom up to which the inverse of Student's t is accurate. Beyond, it is within 3e-4 of
/// the normal distribution's.
const ACCURATE: usize = 10_000;

/// Two-sided 95 % quantile of Student's t; NaN without a degree of freedom.
fn student(freedom: usize) -> f64 {
    if freedom > ACCURATE {
        return NORMAL;
    }
    StudentsT::new(0.0, 1.0, freedom as f64).map_or(f64::NAN, |student| student.inverse_cdf(0.975))
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
            assert!(near(student(freedom), t, 6e-4), "{freedom}: {}", student(freedom));
        }
        assert!(near(student(ACCURATE), NORMAL, 3e-4) && near(student(1_000_000), NORMAL, 1e-5));
        assert!(student(0).is_nan());
    }

    /// Figures of other programs: `scipy.stats.beta.ppf(0.05, k, n - k + 1)`.
    #[test]
    fn bounds_are_clopper_and_pearsons() {
        assert!((lower_bound(1108, 1108, 0.05) - 0.05_f64.powf(1.0 / 1108.0)).abs() < 1e-12);
        // Fewest flights without a failure that show 99.73 %.
        assert!(lower_bound(1109, 1109, 0.05) >= 0.9973 && lower_bound(1108, 1108, 0.05) < 0.9973);
        // Tables give the bound for eight of ten; 0.05 = (1 - p)^20 gives it for none of twenty.
        assert!((lower_bound(8, 10, 0.05) - 0.493_099_5).abs() < 1e-6);
        assert!((Share::new(0, 20).at_most - (1.0 - 0.05_f64.powf(0.05))).abs() < 1e-12);
        assert_eq!(Share::new(0, 20).at_least, 0.0);
        assert_eq!(Share::new(20, 20).at_most, 1.0);
        // Both sides have 2.5 % each: tables give 0.444 and 0.975 for eight of ten.
        let both = exact(8, 10);
        assert!(both.value == 0.8 && (both.low - 0.443_904_5).abs() < 1e-6, "{both:?}");
        assert!((both.high - 0.974_789_3).abs() < 1e-6, "{both:?}");
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

    #[test]
    fn chances_of_correlations_are_those_of_student() {
        // Computed by numerical integration of Student's density with 38 degrees of freedom.
        let chance = correlation_chance(0.5, 40);
        assert!((chance - 1.019133e-03).abs() < 1e-8, "{chance}");
        assert_eq!(rank_correlation(&[1.0, 2.0, f64::NAN], &[1.0, 2.0, 3.0]), None);
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
