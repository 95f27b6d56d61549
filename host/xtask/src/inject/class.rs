//! Classes of faults, and the judge of plans.

use remora_core::advanced::dynamics::{Control, Integrator, State};
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::output_checksum;
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{
    LINKS, NODES, ReorientationTrajectory, Residuals, TranslationTrajectory, verify,
};
use remora_core::advanced::time::Deadline;
use serde::{Deserialize, Serialize};

/// Class of a fault by its outcome. Each case has one class: among those that fit, the last of this
/// list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// Solved, with the bits and iterations that the plan has without the fault.
    NoEffect,
    /// Solved and verified, but another plan, or after other iterations.
    Tolerated,
    /// Solved from the heuristic, after the damaged start had led nowhere.
    FellBack,
    /// Solved; a check had refused what was hit: the model when it was opened, the roll-out or
    /// the start when they were tested, the solver a program, the loop the step that came of it.
    Detected,
    /// Not solved, and said so.
    FailedCleanly,
    /// Called solved or verified, where the judge rejects the plan; or it does not hold what it is
    /// said to hold; or the next plan without a fault was not what it has to be.
    Wrong,
    /// A panic.
    Panicked,
    /// More iterations than there can be. A case that does not end at all ends the program, by its
    /// watchdog.
    Hung,
}

impl Class {
    /// All of them, from harmless to worst.
    pub const ALL: [Self; 8] = [
        Self::NoEffect,
        Self::Tolerated,
        Self::FellBack,
        Self::Detected,
        Self::FailedCleanly,
        Self::Wrong,
        Self::Panicked,
        Self::Hung,
    ];

    /// Whether it must not happen.
    pub fn is_forbidden(self) -> bool {
        matches!(self, Self::Wrong | Self::Panicked | Self::Hung)
    }

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoEffect => "no_effect",
            Self::Tolerated => "tolerated",
            Self::FellBack => "fell_back",
            Self::Detected => "detected",
            Self::FailedCleanly => "failed_cleanly",
            Self::Wrong => "wrong",
            Self::Panicked => "panicked",
            Self::Hung => "hung",
        }
    }
}

/// Observations of a case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// It took more iterations than it can.
    pub is_late: bool,
    /// It panicked.
    pub panicked: bool,
    /// The judge found the plan's claim wrong.
    pub is_wrong: bool,
    /// The next plan without a fault had other bits.
    pub leaked: bool,
    /// It ended solved.
    pub is_solved: bool,
    /// A check refused what was hit.
    pub is_refused: bool,
    /// It ended from the heuristic because the damaged initial guess led nowhere.
    pub fell_back: bool,
    /// Bits and iterations are those without the fault.
    pub is_same: bool,
}

impl Seen {
    /// Its class.
    pub fn class(&self) -> Class {
        match self {
            Self { is_late: true, .. } => Class::Hung,
            Self { panicked: true, .. } => Class::Panicked,
            Self { is_wrong: true, .. } | Self { leaked: true, .. } => Class::Wrong,
            Self { is_solved: false, .. } => Class::FailedCleanly,
            Self { is_refused: true, .. } => Class::Detected,
            Self { fell_back: true, .. } => Class::FellBack,
            Self { is_same: true, .. } => Class::NoEffect,
            _ => Class::Tolerated,
        }
    }
}

/// Claim of a planner about its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// How it ended.
    pub status: Status,
    /// Whether the verifier found all residuals within tolerance.
    pub is_verified: bool,
    /// Residuals by the verifier.
    pub residuals: Residuals,
    /// Checksum of the plan.
    pub output: u64,
}

/// The plan itself.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// Path of the centre of mass.
    pub path: &'a TranslationTrajectory<NODES>,
    /// Attitude and arm.
    pub motion: &'a ReorientationTrajectory<NODES, LINKS>,
}

/// Judges plans with a mission and a scenario that nothing has touched.
#[derive(Clone, Copy, Debug)]
pub struct Judge<'a> {
    /// The mission.
    pub mission: &'a Mission<LINKS>,
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The discretisation of Stage 2.
    pub integrator: Integrator,
}

impl Judge<'_> {
    /// Whether a plan is not what is said of it: called solved or verified, with a residual beyond
    /// its tolerance or a number that is not finite; or with other residuals, or another checksum,
    /// than those claimed, whatever its status.
    pub fn is_wrong(&self, claim: &Claim, plan: Plan<'_>) -> bool {
        let Self { mission, scenario, integrator } = *self;
        let deadline = Deadline::never();
        let found =
            verify(mission, scenario, integrator, plan.path, plan.motion, &deadline).residuals;
        let feasible = found.are_within(&mission.tolerances) && is_finite(plan);
        let claimed = claim.status == Status::Solved || claim.is_verified;
        let pairs = found.against(&mission.tolerances).into_iter();
        let said = claim.residuals.against(&mission.tolerances);
        // A NaN is a NaN, whatever its bits.
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        let honest = pairs.zip(said).all(|((_, found, _), (_, said, _))| same(found, said));
        let sum = output_checksum(mission.grid(scenario).nodes, plan.path, plan.motion);
        (claimed && !feasible) || !honest || sum != claim.output
    }
}

/// Whether every number of a plan is finite, those beyond its end too.
fn is_finite(plan: Plan<'_>) -> bool {
    let Plan { path, motion } = plan;
    let vectors = path.position.iter().chain(&path.velocity).chain(&path.force);
    vectors.flatten().all(|x| x.is_finite())
        && motion.states.iter().all(State::is_finite)
        && motion.controls.iter().all(Control::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_that_fits_is_the_class() {
        let solved = Seen { is_solved: true, ..Seen::default() };
        let cases = [
            (Seen { is_same: true, ..solved }, Class::NoEffect),
            (solved, Class::Tolerated),
            (Seen { fell_back: true, ..solved }, Class::FellBack),
            (Seen { fell_back: true, is_refused: true, ..solved }, Class::Detected),
            (Seen { is_refused: true, is_same: true, ..solved }, Class::Detected),
            (Seen { is_refused: true, ..Seen::default() }, Class::FailedCleanly),
            (Seen { is_wrong: true, is_same: true, ..solved }, Class::Wrong),
            (Seen { leaked: true, is_same: true, ..solved }, Class::Wrong),
            (Seen { panicked: true, is_wrong: true, ..solved }, Class::Panicked),
            (Seen { is_late: true, panicked: true, ..solved }, Class::Hung),
        ];
        for (seen, class) in cases {
            assert_eq!(seen.class(), class, "{seen:?}");
        }
        assert_eq!(Class::ALL.map(Class::is_forbidden).iter().filter(|f| **f).count(), 3);
        assert!(Class::ALL.is_sorted());
    }
}
