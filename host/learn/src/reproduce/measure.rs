//! Measures of a run's plans, for the tables.

use super::published::Spread;
use remora_host::formats::{Row, Status};
use remora_host::report::number;
use remora_host::statistics::{self, Estimate, Mean, Rate};
use serde::Serialize;

/// A run's rows in numbers: rates over all scenarios, everything else over those that were solved.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// How many were solved.
    pub success: Rate,
    /// Iterations of Stage 2.
    pub iterations: Mean,
    /// Time of Stage 2, inference included [s].
    pub time_s: Mean,
    /// Inference time [s].
    pub inference_s: Mean,
    /// Cost of Stage 2.
    pub cost: Mean,
    /// Its median.
    pub cost_median: Estimate,
    /// Its 99th percentile.
    pub cost_p99: Estimate,
}

/// A run against another, over the scenarios that both solved.
#[derive(Clone, Debug, Serialize)]
pub struct Against {
    /// How many these are.
    pub pairs: usize,
    /// Relative change of the mean number of iterations.
    pub iterations: Estimate,
    /// Relative change of the mean time of Stage 2, inference included.
    pub time: Estimate,
    /// Mean of the differences of cost.
    pub cost: Estimate,
    /// Median of the differences of cost.
    pub cost_median: Estimate,
}

fn solved(row: &&Row) -> bool {
    row.status == Status::Solved
}

/// The costs of the plans that were solved.
pub(super) fn costs(rows: &[Row]) -> Vec<f64> {
    rows.iter().filter(solved).map(|row| row.stage2.cost).collect()
}

impl Measured {
    /// Of a run's rows.
    pub fn of(rows: &[Row]) -> Self {
        let pick = |of: fn(&Row) -> f64| rows.iter().filter(solved).map(of).collect::<Vec<_>>();
        let costs = costs(rows);
        Self {
            success: Rate::new(costs.len(), rows.len()),
            iterations: Mean::of(&pick(|row| row.stage2.iterations as f64)),
            time_s: Mean::of(&pick(|row| row.stage2.time_s)),
            inference_s: Mean::of(&pick(|row| row.inference_s)),
            cost: Mean::of(&costs),
            cost_median: statistics::quantile(&costs, 0.5),
            cost_p99: statistics::quantile(&costs, 0.99),
        }
    }
}

impl Against {
    /// `rows` against those of `reference`, which are of the same scenarios.
    pub fn of(reference: &[Row], rows: &[Row]) -> Self {
        let both: Vec<(&Row, &Row)> =
            reference.iter().zip(rows).filter(|(a, b)| solved(a) && solved(b)).collect();
        let pick =
            |of: fn(&Row) -> f64| both.iter().map(|(a, b)| (of(a), of(b))).collect::<Vec<_>>();
        let cost = pick(|row| row.stage2.cost);
        Self {
            pairs: both.len(),
            iterations: statistics::relative_change(&pick(|row| row.stage2.iterations as f64)),
            time: statistics::relative_change(&pick(|row| row.stage2.time_s)),
            cost: statistics::mean_difference(&cost),
            cost_median: statistics::median_difference(&cost),
        }
    }
}

/// Text of a cell where nothing is known.
pub(super) const NONE: &str = "-";

/// Mean and standard deviation, in three digits of the larger.
pub(super) fn spread(mean: f64, std: f64) -> String {
    if !mean.is_finite() {
        return NONE.into();
    }
    let size = mean.abs().max(if std.is_finite() { std } else { 0.0 }).max(1e-9);
    let decimals = (2 - size.log10().floor() as i32).clamp(0, 4) as usize;
    match std.is_finite() {
        true => format!("{mean:.decimals$} ± {std:.decimals$}"),
        false => format!("{mean:.decimals$}"),
    }
}

/// Formats mean and standard deviation of a time, in the unit that suits it.
pub(super) fn time_spread(mean: f64, std: f64) -> String {
    let (unit, scale) = match mean {
        mean if !mean.is_finite() || mean == 0.0 => return NONE.into(),
        mean if mean >= 1.0 => ("s", 1.0),
        mean if mean >= 1e-3 => ("ms", 1e3),
        _ => ("us", 1e6),
    };
    format!("{} {unit}", spread(scale * mean, scale * std))
}

pub(super) fn of(mean: &Mean) -> String {
    spread(mean.mean.value, mean.std)
}

pub(super) fn of_time(mean: &Mean) -> String {
    time_spread(mean.mean.value, mean.std)
}

pub(super) fn published(spread: Spread) -> String {
    self::spread(spread.mean, spread.std)
}

pub(super) fn published_time(spread: Spread) -> String {
    time_spread(spread.mean, spread.std)
}

/// The interval of a mean.
pub(super) fn interval(estimate: &Estimate) -> String {
    let Estimate { low, high, .. } = estimate;
    if low.is_finite() { format!("{}..{}", number(*low), number(*high)) } else { NONE.into() }
}

/// A rate in per cent, with its interval.
pub(super) fn rate(rate: &Rate) -> String {
    let Estimate { value, low, high } = rate.rate;
    format!("{} [{}, {}]", percent(value), percent(low), percent(high))
}

/// A rate in per cent.
pub(super) fn percent(rate: f64) -> String {
    let text = format!("{:.1}", 100.0 * rate);
    if text == "100.0" { "100".into() } else { text }
}

/// A relative change in per cent, with its interval.
pub(super) fn change(estimate: &Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    match low.is_finite() {
        true => format!("{:+.1} [{:+.1}, {:+.1}]", 100.0 * value, 100.0 * low, 100.0 * high),
        false => NONE.into(),
    }
}

/// A difference in thousandths, with its interval.
pub(super) fn difference(estimate: &Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    match low.is_finite() {
        true => format!("{:+.2} [{:+.2}, {:+.2}]", 1e3 * value, 1e3 * low, 1e3 * high),
        false => NONE.into(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use remora_host::formats::{Clearances, Closest, Flight, Nearest, StageRow, Verdict};

    /// A row that nobody planned.
    pub(crate) fn row(index: usize, iterations: u64, cost: f64, time_s: f64) -> Row {
        let stage = StageRow { iterations, corrections: 0, cost, time_s };
        Row {
            scenario: format!("s7-{index:03}"),
            status: Status::Solved,
            verdict: Verdict::Optimal,
            reason: String::new(),
            warm_start: "heuristic".into(),
            stage1: stage,
            stage2: stage,
            inference_s: 0.001,
            residuals: [0.0; 12],
            clearances: Clearances::NONE,
            nearest: Nearest::NONE,
            end_effector: Closest::NONE,
            flight: Flight::default(),
            time_s,
            cpu_time_s: time_s,
            plan_checksum: String::new(),
        }
    }

    #[test]
    fn comparisons_are_over_what_both_solved() {
        let reference: Vec<Row> = (0..4).map(|i| row(i, 10, 0.3, 0.04)).collect();
        let mut rows: Vec<Row> = (0..4).map(|i| row(i, 5, 0.3, 0.03)).collect();
        rows[3] = Row { status: Status::IterationLimit, ..row(3, 50, 9.0, 1.0) };
        let measured = Measured::of(&rows);
        assert_eq!((measured.success.count, measured.success.of), (3, 4));
        assert_eq!((measured.iterations.mean.value, measured.cost_p99.value), (5.0, 0.3));
        let against = Against::of(&reference, &rows);
        assert_eq!((against.pairs, against.iterations.value), (3, -0.5));
        assert!((against.time.value + 0.25).abs() < 1e-12);
        assert_eq!((against.cost.value, against.cost_median.high), (0.0, 0.0));
    }

    #[test]
    fn cells_are_short() {
        assert_eq!(spread(13.43, 6.02), "13.4 ± 6.0");
        assert_eq!(spread(0.327, 0.115), "0.327 ± 0.115");
        assert_eq!(spread(f64::NAN, f64::NAN), "-");
        assert_eq!(spread(5.0, f64::NAN), "5.00");
        assert_eq!(time_spread(4.69, 2.12), "4.69 ± 2.12 s");
        assert_eq!(time_spread(0.0361, 0.0151), "36.1 ± 15.1 ms");
        assert_eq!(time_spread(0.0, 0.0), "-");
        assert_eq!(rate(&Rate::new(299, 300)), "99.7 [98.1, 99.9]");
        assert_eq!(rate(&Rate::new(300, 300)), "100 [98.7, 100]");
        let estimate = Estimate { value: -0.281, low: -0.31, high: -0.25 };
        assert_eq!(change(&estimate), "-28.1 [-31.0, -25.0]");
        assert_eq!(difference(&estimate), "-281.00 [-310.00, -250.00]");
    }
}
