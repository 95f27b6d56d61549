//! One cell of a map: where it is, and what became of its scenarios.

use crate::campaign::Statistics;
use crate::draw::draw_one;
use crate::formats::{Mission, NamedScenario, Nearest};
use crate::statistics::{Estimate, exact};
use remora_core::advanced::model::Tolerances;
use remora_core::advanced::planner::{Report, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where a cell is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellPlace {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Horizon [s].
    pub horizon_s: f64,
    /// Norm of the target's rate [deg/s].
    pub rate_deg_s: f64,
    /// Distance ahead of the port [m].
    pub distance_m: f64,
}

/// State of a cell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum State {
    /// Its scenarios were planned.
    Planned,
    /// No plan can exist: proved, not tried and failed.
    Impossible {
        /// The proof, in words.
        why: String,
    },
    /// No scenario starts there without violating keep-out or pointing.
    NoStart,
    /// It is no mission.
    Refused {
        /// Field and reason.
        why: String,
    },
}

impl State {
    /// Name in files and tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::Impossible { .. } => "impossible",
            Self::NoStart => "no start",
            Self::Refused { .. } => "refused",
        }
    }

    /// The reason, where there is one.
    pub fn why(&self) -> &str {
        match self {
            Self::Impossible { why } | Self::Refused { why } => why,
            Self::Planned | Self::NoStart => "",
        }
    }
}

/// A cell of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Where it is.
    pub place: CellPlace,
    /// Its state, with the reason.
    #[serde(flatten)]
    pub state: State,
    /// Results of its plans, where there were any.
    pub found: Option<Found>,
}

/// Results of a cell's plans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    /// Scenarios.
    pub scenarios: usize,
    /// Plans that are verified and optimal.
    pub optimal: usize,
    /// Plans that are verified, but have not converged.
    pub verified: usize,
    /// Scenarios without any path within the force limit: Clarabel proves Stage 1's first
    /// program, which is convex, to be infeasible.
    pub out_of_reach: usize,
    /// Median of Stage 2's iterations, over plans within reach.
    pub iterations: Option<f64>,
    /// Median time of a plan within reach [s].
    pub time_s: Option<f64>,
    /// Median of Stage 2's cost, over optimal plans.
    pub cost: Option<f64>,
    /// Smallest distance between bodies, over optimal plans [m]; none where it is not judged.
    pub clearance_m: Option<f64>,
    /// Reasons why plans are not optimal, with the number of plans.
    pub reasons: BTreeMap<String, usize>,
}

impl Found {
    /// Share of optimal plans.
    pub fn success(&self) -> f64 {
        self.optimal as f64 / self.scenarios as f64
    }

    /// The reason of most plans that are not optimal.
    pub fn worst_reason(&self) -> Option<&str> {
        let most = self.reasons.iter().max_by_key(|(_, count)| **count);
        most.map(|(reason, _)| reason.as_str())
    }
}

/// The reason of a scenario without any path.
pub const OUT_OF_REACH: &str = "force limit";
/// The reason of a plan that is verified and not optimal.
pub const NOT_CONVERGED: &str = "not converged";

/// Result of one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    /// Verdict: whether the plan is optimal, verified or not flyable.
    pub verdict: Verdict,
    /// Reason why the plan is not optimal, where it is not.
    pub reason: Option<String>,
    /// Whether there is no path at all.
    pub is_out_of_reach: bool,
    /// Stage 2's iterations.
    pub iterations: usize,
    /// Time of the plan [s].
    pub time_s: f64,
    /// Stage 2's cost.
    pub cost: f64,
    /// Smallest distance between bodies, the end effector left out [m]; none where it is not judged.
    pub clearance_m: Option<f64>,
}

impl Attempt {
    /// Result of a plan; `is_out_of_reach` where its scenario is proved to have no path at all.
    pub fn of(report: &Report, tolerances: &Tolerances, is_out_of_reach: bool) -> Self {
        let verdict = report.verdict();
        let reason = match verdict {
            Verdict::Optimal => None,
            Verdict::Verified => Some(NOT_CONVERGED.into()),
            Verdict::NotFlyable if is_out_of_reach => Some(OUT_OF_REACH.into()),
            Verdict::NotFlyable => Some(worst(&report.residuals.against(tolerances))),
        };
        let nearest = Nearest::of(&report.clearances, &report.arm.links).at.distance;
        Self {
            verdict,
            reason,
            is_out_of_reach,
            iterations: report.reorientation.outcome.iterations,
            time_s: report.times.total_s,
            cost: report.reorientation.cost,
            clearance_m: nearest.is_finite().then_some(nearest),
        }
    }
}

/// The residual that is largest against its tolerance; a NaN is larger than all.
fn worst(residuals: &[(&'static str, f64, f64)]) -> String {
    let ratio = |value: f64, tolerance: f64| {
        if value.is_nan() { f64::INFINITY } else { value / tolerance }
    };
    let most = residuals.iter().max_by(|a, b| ratio(a.1, a.2).total_cmp(&ratio(b.1, b.2)));
    most.map_or("nothing", |(name, _, _)| name).into()
}

impl Cell {
    /// A cell whose scenarios were planned, whatever their order.
    pub fn planned(place: CellPlace, attempts: &[Attempt]) -> Self {
        let found = Found::of(attempts);
        let why = "no path within the force limit, in any scenario";
        let state = match found.out_of_reach == found.scenarios {
            true => State::Impossible { why: why.into() },
            false => State::Planned,
        };
        Self { place, state, found: Some(found) }
    }

    /// Share of optimal plans; none where nothing could be planned.
    pub fn success(&self) -> Option<f64> {
        let found = self.found.as_ref().filter(|_| self.state == State::Planned);
        found.map(Found::success)
    }

    /// Share of optimal plans with its exact interval.
    pub fn interval(&self) -> Option<Estimate> {
        let found = self.found.as_ref().filter(|_| self.state == State::Planned);
        found.map(|found| exact(found.optimal as u64, found.scenarios as u64))
    }
}

impl Found {
    fn of(attempts: &[Attempt]) -> Self {
        let count = |which: &dyn Fn(&Attempt) -> bool| attempts.iter().filter(|a| which(a)).count();
        let within = || attempts.iter().filter(|attempt| !attempt.is_out_of_reach);
        let optimal = || attempts.iter().filter(|attempt| attempt.verdict == Verdict::Optimal);
        let mut reasons = BTreeMap::new();
        for reason in attempts.iter().filter_map(|attempt| attempt.reason.as_ref()) {
            *reasons.entry(reason.clone()).or_insert(0) += 1;
        }
        Self {
            scenarios: attempts.len(),
            optimal: optimal().count(),
            verified: count(&|attempt| attempt.verdict == Verdict::Verified),
            out_of_reach: count(&|attempt| attempt.is_out_of_reach),
            iterations: median(within().map(|attempt| attempt.iterations as f64)),
            time_s: median(within().map(|attempt| attempt.time_s)),
            cost: median(optimal().map(|attempt| attempt.cost)),
            clearance_m: optimal().filter_map(|attempt| attempt.clearance_m).reduce(f64::min),
            reasons,
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values = values.peekable();
    values.peek()?;
    Some(Statistics::of(values).median)
}

/// A cell before anything is planned.
pub(super) struct CellWork {
    pub(super) place: CellPlace,
    content: Result<(Box<Mission>, Vec<NamedScenario>), State>,
}

impl CellWork {
    /// A cell in which nothing can be planned.
    pub(super) fn settled(place: CellPlace, state: State) -> Self {
        Self { place, content: Err(state) }
    }

    /// A cell with scenarios drawn for it.
    pub(super) fn drawn(place: CellPlace, mission: Box<Mission>, seed: u64, count: u64) -> Self {
        let drawn = (0..count).map(|index| draw_one(seed, index, &mission)).collect();
        let drawn: Option<Vec<NamedScenario>> = drawn;
        let content = drawn.map(|drawn| (mission, drawn)).ok_or(State::NoStart);
        Self { place, content }
    }

    /// Mission and scenarios to be planned, if there are any.
    pub(super) fn ready(&self) -> Option<(&Mission, &[NamedScenario])> {
        let (mission, drawn) = self.content.as_ref().ok()?;
        Some((mission, drawn))
    }

    /// The cell, where nothing is to be planned.
    pub(super) fn cell(&self) -> Option<Cell> {
        let state = self.content.as_ref().err()?.clone();
        Some(Cell { place: self.place.clone(), state, found: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> CellPlace {
        CellPlace { vehicle: "a".into(), horizon_s: 60.0, rate_deg_s: 0.5, distance_m: 2.0 }
    }

    fn attempt(verdict: Verdict, reason: Option<&str>, time_s: f64) -> Attempt {
        Attempt {
            verdict,
            reason: reason.map(String::from),
            is_out_of_reach: reason == Some(OUT_OF_REACH),
            iterations: (10.0 * time_s) as usize,
            time_s,
            cost: 2.0 * time_s,
            clearance_m: Some(0.5 - 0.1 * time_s),
        }
    }

    #[test]
    fn medians_are_over_what_is_within_reach_and_costs_over_what_is_optimal() {
        let cell = Cell::planned(
            place(),
            &[
                attempt(Verdict::Optimal, None, 1.0),
                attempt(Verdict::NotFlyable, Some("clearance"), 4.0),
                attempt(Verdict::NotFlyable, Some(OUT_OF_REACH), 9.0),
                attempt(Verdict::Optimal, None, 3.0),
                attempt(Verdict::Verified, Some(NOT_CONVERGED), 2.0),
            ],
        );
        assert_eq!((&cell.state, cell.success()), (&State::Planned, Some(0.4)));
        let found = cell.found.as_ref().unwrap();
        assert_eq!((found.optimal, found.verified, found.out_of_reach), (2, 1, 1));
        assert_eq!((found.iterations, found.time_s), (Some(25.0), Some(2.5)));
        assert_eq!((found.cost, found.clearance_m), (Some(4.0), Some(0.5 - 0.1 * 3.0)));
        assert_eq!(found.reasons.len(), 3);
        let back: Cell = serde_json::from_str(&serde_json::to_string(&cell).unwrap()).unwrap();
        assert_eq!(back, cell);
    }

    #[test]
    fn a_cell_without_any_path_is_impossible_and_no_failure() {
        let cell = Cell::planned(place(), &[attempt(Verdict::NotFlyable, Some(OUT_OF_REACH), 1.0)]);
        assert_eq!((cell.state.name(), cell.success()), ("impossible", None));
        assert!(cell.state.why().contains("force limit"));
        assert_eq!(cell.found.unwrap().time_s, None);
    }

    #[test]
    fn a_cell_nearer_than_keep_out_has_no_start() {
        let mut mission = Mission::default();
        mission.approach.keep_out_far_m = 50.0;
        let prepared = CellWork::drawn(place(), Box::new(mission), 1, 2);
        assert_eq!(prepared.cell().unwrap().state, State::NoStart);
        let prepared = CellWork::drawn(place(), Box::default(), 1, 2);
        assert_eq!((prepared.cell(), prepared.ready().unwrap().1.len()), (None, 2));
    }

    #[test]
    fn the_worst_residual_is_that_against_its_tolerance() {
        let residuals = [("a", 2.0, 1.0), ("b", 1.0, 0.1), ("c", 5.0, 4.0)];
        assert_eq!(worst(&residuals), "b");
        assert_eq!(worst(&[("a", 2.0, 1.0), ("b", f64::NAN, 1.0), ("c", 5.0, 4.0)]), "b");
    }
}
