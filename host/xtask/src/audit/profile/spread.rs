//! How a number is spread over many measurements.

use remora_host::statistics::percentile;
use serde::{Deserialize, Serialize};

/// Measurements from which on the 99.9th percentile is more than the largest one's neighbour.
pub const ENOUGH_FOR_P999: usize = 1000;

/// The spread of a number, in the number's unit. All zero where there is no measurement.
///
/// Percentiles are linear between neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Number of measurements.
    pub n: usize,
    /// Least.
    pub min: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile, where there are [`ENOUGH_FOR_P999`].
    pub p999: Option<f64>,
    /// Largest.
    pub max: f64,
    /// Jitter over all: `max - min`.
    pub jitter_range: f64,
    /// Jitter of the tail: `p99 - median`.
    pub jitter_p99: f64,
}

impl Spread {
    /// The spread of some numbers; those that are not finite are left out.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let (Some(min), Some(max)) = (values.first().copied(), values.last().copied()) else {
            return Self::default();
        };
        let (median, p99) = (percentile(&values, 0.5), percentile(&values, 0.99));
        Self {
            n: values.len(),
            min,
            median,
            p95: percentile(&values, 0.95),
            p99,
            p999: (values.len() >= ENOUGH_FOR_P999).then(|| percentile(&values, 0.999)),
            max,
            jitter_range: max - min,
            jitter_p99: p99 - median,
        }
    }
}

/// The median of the ratios `a / b` of measurements that belong together; zero where there is none.
pub(super) fn median_ratio(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    Spread::of(pairs.into_iter().map(|(a, b)| a / b)).median
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_by_hand() {
        let s = Spread::of((0..=100).rev().map(f64::from).chain([f64::NAN]));
        assert_eq!(
            (s.n, s.min, s.median, s.p95, s.p99, s.max),
            (101, 0.0, 50.0, 95.0, 99.0, 100.0)
        );
        assert_eq!((s.p999, s.jitter_range, s.jitter_p99), (None, 100.0, 49.0));
        let s = Spread::of((0..=1000).map(f64::from));
        assert_eq!((s.p99, s.p999), (990.0, Some(999.0)));
        assert_eq!(Spread::of([]), Spread::default());
        let one = Spread::of([2.5]);
        assert_eq!((one.n, one.median, one.max, one.jitter_range), (1, 2.5, 2.5, 0.0));
    }

    #[test]
    fn ratios_are_of_what_belongs_together() {
        assert_eq!(median_ratio([(2.0, 1.0), (9.0, 3.0), (4.0, 1.0)]), 3.0);
        assert_eq!(median_ratio([]), 0.0);
        assert_eq!(median_ratio([(1.0, 0.0), (2.0, 1.0)]), 2.0);
    }
}
