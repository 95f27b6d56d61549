//! Statistics over flights: endings, spreads, and the errors that go with the miss.

use crate::flight::Ending;
use crate::row::{ErrorColumn, FlightRow, Row};
use remora_host::statistics::{
    CONFIDENCE, NORMAL, Share, correlation_chance, percentile, rank_correlation,
};
use serde::Serialize;

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
    /// Measures the finite numbers among `values`; none where there is none.
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

/// Influence of an error on the miss.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Influence {
    /// Name of the error.
    pub name: String,
    /// Rank correlation of the miss with how far the error is from its middle.
    pub correlation: f64,
    /// Lower end of its 95 % interval (Bonett and Wright 2000).
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Influence {
    fn new(name: String, correlation: f64, runs: usize) -> Self {
        let width = (1.0 + 0.5 * correlation * correlation) / (runs as f64 - 3.0);
        let half = NORMAL * width.sqrt();
        let end = |side: f64| (correlation.atanh() + side * half).tanh();
        Self { name, correlation, low: end(-1.0), high: end(1.0) }
    }
}

/// Fewest flights for a statement. Below this Student's t overstates a rank correlation.
const FEWEST: usize = 10;

/// Errors that correlate with the miss more than by chance, the strongest first: the first to improve. With
/// [`CONFIDENCE`] none is there by chance, however many errors were tested (Holm 1979).
pub fn influences(rows: &[FlightRow], drawn: &[ErrorColumn]) -> Vec<Influence> {
    if rows.len() < FEWEST {
        return Vec::new();
    }
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
    let each = drawn.iter().enumerate();
    let mut all: Vec<(&str, f64)> =
        each.filter_map(|(i, drawn)| of(i).map(|found| (drawn.name.as_str(), found))).collect();
    all.sort_by(|(_, a), (_, b)| b.abs().total_cmp(&a.abs()));
    let errors = all.len();
    let stands_out = |(i, (_, correlation)): &(usize, (&str, f64))| {
        correlation_chance(*correlation, rows.len()) <= (1.0 - CONFIDENCE) / (errors - i) as f64
    };
    let found = all.into_iter().enumerate().take_while(stands_out);
    found.map(|(_, (name, found))| Influence::new(name.into(), found, rows.len())).collect()
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
    /// Errors to improve first: those that correlate with the miss more than by chance.
    pub influences: Vec<Influence>,
}

impl Summary {
    /// Over some rows.
    pub fn of(rows: &[Row], drawn: &[ErrorColumn]) -> Self {
        let flown: Vec<FlightRow> = rows.iter().filter_map(|row| row.flown.clone()).collect();
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
        let spread = |name, of: &dyn Fn(&FlightRow) -> f64| Spread::of(name, flown.iter().map(of));
        let spreads = [
            spread("miss_m", &|row| row.arrival.miss_m),
            spread("angle_deg", &|row| row.arrival.angle_rad.to_degrees()),
            spread("speed_m_s", &|row| row.arrival.speed_m_s),
            spread("joint_rate_over_limit", &|row| row.room.joint_rate),
            spread("tracking_position_m", &|row| row.tracking[0]),
            spread("tracking_attitude_deg", &|row| row.tracking[1].to_degrees()),
            spread("impulse_n_s", &|row| row.impulse_n_s),
        ];
        Self {
            format: "remora-flights-summary/1",
            runs: rows.len() as u64,
            without_plan: rows.len() as u64 - count,
            endings: if count > 0 { endings.map(ended).to_vec() } else { Vec::new() },
            violations: violations.into_iter().collect(),
            spreads: spreads.into_iter().flatten().collect(),
            replans: [0, 1].map(|i| flown.iter().map(|row| u64::from(row.replans[i])).sum()),
            influences: influences(&flown, drawn),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::{Arrival, Room};

    /// Flights whose miss and errors are independent, but for the first error's share in the miss.
    fn flights(
        runs: usize,
        errors: usize,
        share: f64,
        seed: u64,
    ) -> (Vec<FlightRow>, Vec<ErrorColumn>) {
        let mut state = seed;
        // SplitMix64.
        let mut uniform = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let rows = (0..runs).map(|_| {
            let drawn: Vec<f64> = (0..errors).map(|_| uniform() - 0.5).collect();
            let miss_m = uniform() + share * drawn[0].abs();
            let arrival =
                Arrival { miss_m, miss_target_m: [0.0; 3], angle_rad: 0.0, speed_m_s: 0.0 };
            FlightRow {
                ending: Ending::Captured,
                time_s: 1200.0,
                arrival,
                room: Room::ALL,
                violations: Vec::new(),
                replans: [0, 0],
                tracking: [0.0; 2],
                impulse_n_s: 0.0,
                drawn,
            }
        });
        let named = |i: usize| ErrorColumn { name: format!("error {i}"), unit: "m" };
        (rows.collect(), (0..errors).map(named).collect())
    }

    /// The list of errors to improve is not noise: of 400 campaigns of 40 runs with 60 errors that have no share
    /// in the miss, hardly one in twenty names any.
    #[test]
    fn noise_is_nothing_to_improve() {
        let named = (0..400).filter(|seed| {
            let (rows, drawn) = flights(40, 60, 0.0, *seed);
            !influences(&rows, &drawn).is_empty()
        });
        let named = named.count();
        assert!(named <= 32, "{named} of 400 where 20 are expected");
        for runs in [0, 3, 9] {
            let (rows, drawn) = flights(runs, 60, 100.0, 1);
            assert_eq!(influences(&rows, &drawn), []);
        }
    }

    #[test]
    fn an_error_that_makes_the_miss_is_named_with_its_interval() {
        for seed in 0..20 {
            let (rows, drawn) = flights(100, 60, 20.0, seed);
            let found = influences(&rows, &drawn);
            let first = found.first().map(|influence| influence.name.as_str());
            assert_eq!(first, Some("error 0"), "seed {seed}: {found:?}");
            let Influence { correlation, low, high, .. } = found[0];
            assert!(0.0 < low && low < correlation && correlation < high && high <= 1.0);
        }
        // tanh(atanh(0.5) -+ 1.96 sqrt(1.125 / 37))
        let Influence { low, high, .. } = Influence::new(String::new(), 0.5, 40);
        assert!((low - 0.204_609).abs() < 1e-5 && (high - 0.711_924).abs() < 1e-5, "{low} {high}");
    }
}
