//! Statistics over the rows of a campaign.

use crate::formats::{Nearest, Row, Status, Verdict};
use crate::method::{Integrator, Mode, Qp, WarmStart};
use crate::statistics::percentile;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Mean and spread of a number over the rows. All zero where there is no row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the sample (divided by one less than its size).
    pub std: f64,
    /// Median.
    pub median: f64,
    /// 99th percentile, linear between neighbours.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

impl Statistics {
    /// Statistics of some numbers.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        if values.is_empty() {
            return Self::default();
        }
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let std = if values.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 };
        Self {
            mean,
            std,
            median: percentile(&values, 0.5),
            p99: percentile(&values, 0.99),
            max: values[values.len() - 1],
        }
    }
}

/// Statistics of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageSummary {
    /// Iterations, over all rows that were planned.
    pub iterations: Statistics,
    /// Second-order corrections, over them.
    pub corrections: Statistics,
    /// Time of the whole stage, over them [s].
    pub time_s: Statistics,
    /// Cost, over the solved rows.
    pub cost: Statistics,
}

/// Work of one run for a campaign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Run {
    /// Rows it planned.
    pub planned: usize,
    /// Rows that it took from the journal of earlier runs.
    pub resumed: usize,
    /// How long it took [s].
    pub wall_s: f64,
}

/// The two bodies that come nearest to each other in any plan, the end effector left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NearestOf {
    /// Id of the scenario.
    pub scenario: String,
    /// The two, as in the table.
    pub pair: String,
    /// Smallest distance [m].
    pub distance_m: f64,
    /// Time of the smallest distance, in the plan's time [s].
    pub time_s: f64,
}

impl NearestOf {
    /// Finds it in one row.
    pub(super) fn of(row: &Row) -> Self {
        let Nearest { at, pair } = &row.nearest;
        let (scenario, pair) = (row.scenario.clone(), pair.clone());
        Self { scenario, pair, distance_m: at.distance, time_s: at.time_s }
    }
}

/// Statistics of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Format of the file.
    pub format: &'static str,
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Initial guess of Stage 2.
    pub warm_start: WarmStart,
    /// Solver of the subproblems.
    pub qp: Qp,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Number of scenarios.
    pub scenarios: usize,
    /// Number of them that were solved.
    pub solved: usize,
    /// `solved / scenarios`.
    pub success_rate: f64,
    /// Counts by status, those that occur, best first.
    pub by_status: BTreeMap<Status, usize>,
    /// Counts by verdict, all three, best first.
    pub by_verdict: BTreeMap<Verdict, usize>,
    /// Counts by what makes plans not flyable: constraints and residuals, by name.
    pub by_reason: BTreeMap<String, usize>,
    /// Scenarios that were refused before planning.
    pub refused: usize,
    /// Stage 1.
    pub stage1: StageSummary,
    /// Stage 2.
    pub stage2: StageSummary,
    /// Time in a learned warm start, over all rows that were planned [s].
    pub inference_s: Statistics,
    /// Time of the whole plan, over all rows that were planned [s].
    pub time_s: Statistics,
    /// Processor time of the thread that planned, over those that tell [s].
    pub cpu_time_s: Statistics,
    /// Scenarios for which a model was asked and the heuristic used.
    pub fallbacks: usize,
    /// The smallest distance of bodies; none if none was computed.
    pub nearest: Option<NearestOf>,
    /// Ids that were not solved.
    pub unsolved: Vec<String>,
    /// The run that wrote this.
    pub run: Run,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Clearances, Closest, Flight, ScenarioSet, StageRow};
    use crate::method::Method;
    use remora_core::advanced::model::Refusal;

    #[test]
    fn statistics_by_hand() {
        let s = Statistics::of([4.0, 1.0, 2.0, 9.0]);
        assert_eq!(s.mean, 4.0);
        // Deviations 0, -3, -2, 5: 38 / 3.
        assert!((s.std - (38.0f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(s.median, 3.0);
        // 0.99 * 3 = 2.97: between 4 and 9.
        assert!((s.p99 - 8.85).abs() < 1e-12);
        assert_eq!(s.max, 9.0);
        let one = Statistics::of([7.0]);
        assert_eq!((one.mean, one.std, one.median, one.p99, one.max), (7.0, 0.0, 7.0, 7.0, 7.0));
        assert_eq!(Statistics::of([]), Statistics::default());
        let hundred = Statistics::of((0..=100).map(f64::from));
        assert_eq!((hundred.median, hundred.p99), (50.0, 99.0));
    }

    fn row(id: &str, status: Status, iterations: u64, cost: f64) -> Row {
        let stage = StageRow { iterations, corrections: 2, cost, time_s: 0.5 };
        Row {
            scenario: id.into(),
            status,
            verdict: Verdict::of(status == Status::Solved, status),
            reason: String::new(),
            warm_start: "heuristic".into(),
            stage1: stage,
            stage2: stage,
            inference_s: 0.0,
            residuals: [0.0; 12],
            clearances: Clearances::NONE,
            nearest: Nearest::NONE,
            end_effector: Closest::NONE,
            flight: Flight::default(),
            time_s: 1.0,
            cpu_time_s: 1.0,
            plan_checksum: String::new(),
        }
    }

    #[test]
    fn costs_are_those_of_the_solved_and_iterations_those_of_all() {
        let rows = [
            row("a", Status::Solved, 4, 1.0),
            row("b", Status::IterationLimit, 50, 100.0),
            row("c", Status::Solved, 6, 3.0),
            row("d", Status::Infeasible, 0, 0.0),
        ];
        let summary = Summary::of(&rows, &Method::default(), Run::default());
        assert_eq!((summary.scenarios, summary.solved, summary.success_rate), (4, 2, 0.5));
        assert_eq!(summary.unsolved, ["b", "d"]);
        let counts: Vec<_> = summary.by_status.iter().map(|(s, n)| (s.name(), *n)).collect();
        assert_eq!(counts, [("solved", 2), ("iteration_limit", 1), ("infeasible", 1)]);
        assert_eq!(summary.stage2.cost.mean, 2.0);
        assert_eq!(summary.stage2.iterations.mean, 15.0);
        assert_eq!(summary.stage1.corrections.mean, 2.0);
        assert_eq!(summary.stage1.time_s.median, 0.5);
    }

    #[test]
    fn outcomes_are_three_and_reasons_are_counted() {
        let verified =
            Row { verdict: Verdict::Verified, ..row("b", Status::IterationLimit, 50, 9.0) };
        let failed = Row { reason: "dynamics2".into(), ..row("c", Status::Deadline, 7, 9.0) };
        let refusal = Refusal::Force { needed: 3.0, limit: 2.5 };
        let scenario = &ScenarioSet::built_in().unwrap().scenarios[0];
        let refused = Row::refused(scenario, &refusal);
        let rows = [row("a", Status::Solved, 4, 1.0), verified, failed, refused];
        let summary = Summary::of(&rows, &Method::default(), Run::default());
        let counts: Vec<_> = summary.by_verdict.iter().map(|(v, n)| (v.name(), *n)).collect();
        let expected = [("optimal", 1), ("verified_not_converged", 1), ("not_flyable", 2)];
        assert_eq!(counts, expected);
        let reasons: Vec<_> = summary.by_reason.iter().map(|(r, n)| (r.as_str(), *n)).collect();
        assert_eq!(reasons, [("dynamics2", 1), ("force", 1)]);
        assert_eq!((summary.refused, summary.solved, summary.scenarios), (1, 1, 4));
        // The refused scenario does not count in the mean.
        assert_eq!(summary.stage2.iterations.mean, (4.0 + 50.0 + 7.0) / 3.0);
    }
}
