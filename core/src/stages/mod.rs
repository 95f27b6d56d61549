//! The two stages as problems for the SCP solver, the heuristic initial guess, and the independent
//! verifier.

use crate::model::{Grid, Integrator, Margins, Mission, Scenario};
use remora_qp::time::Deadline;

mod clearance;
mod detour;
pub mod heuristic;
mod recovery;
mod reorientation;
mod terminal;
mod translation;
mod verifier;

pub(crate) use recovery::recovery;
pub use reorientation::{Mode, Reorientation, ReorientationTrajectory};
pub use translation::{Translation, TranslationTrajectory};
pub(crate) use verifier::verify_first;
pub use verifier::{
    ArmClearances, Clearances, Closest, Residuals, Verification, clearances_at, verify,
    verify_translation,
};
pub(crate) use verifier::{MAX_DOUBLINGS, MAX_HALVINGS, MAX_PART_SUBSTEPS, MAX_TARGET_STEPS};

/// The larger of two violations; unlike `f64::max` it keeps NaN.
// One copy of it makes images smaller.
#[inline(never)]
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The mission as one try of planning formulates it: margins, discretisation, deadline.
#[derive(Clone, Copy, Debug)]
pub struct Formulation<'a, const NL: usize> {
    /// The mission.
    pub mission: &'a Mission<NL>,
    /// The scenario.
    pub scenario: &'a Scenario<NL>,
    /// Discretisation of Stage 2; it also says what [`Switch::Auto`](crate::model::Switch) means.
    pub integrator: Integrator,
    /// Margins of planning to the verifier's limits; the mission's at first.
    pub margins: Margins,
    /// Clearance added to the margin, up to the last interval [m].
    pub extra_clearance: f64,
    /// Bound of every force component in planning, beside its own limit [N]; the largest limit at first.
    pub max_force: f64,
    /// Bound of the rate at which Stage 1 lets the line of sight turn [rad/s]; infinite at first.
    pub sight_rate: f64,
    /// Deadline of this try.
    pub deadline: Deadline<'a>,
}

impl<'a, const NL: usize> Formulation<'a, NL> {
    /// The formulation with the mission's own margins and no deadline.
    pub fn new(
        mission: &'a Mission<NL>,
        scenario: &'a Scenario<NL>,
        integrator: Integrator,
    ) -> Self {
        Self {
            mission,
            scenario,
            integrator,
            margins: mission.margins,
            extra_clearance: 0.0,
            max_force: mission.servicer.force_limit_n.max(),
            sight_rate: f64::INFINITY,
            deadline: Deadline::never(),
        }
    }

    /// The time grid.
    pub(crate) fn grid(&self) -> Grid {
        self.mission.grid(self.scenario)
    }
}

/// Most nodes of a plan: what this build has room for.
pub const NODES: usize = 60;
/// Links of the mission's arm.
pub const LINKS: usize = 3;

/// Stage 2 at the size of this build's horizon and of the mission's arm.
pub type MissionReorientation<'a, P> =
    Reorientation<'a, P, NODES, LINKS, { size::NX }, { size::NU }>;

/// Number of states, controls and path constraints of the subproblems of both stages, for the mission's
/// arm; for another, [`states`](size::states) and [`controls`](size::controls).
///
/// They are Stage 2's: attitude and joints with their rates; torques; pointing and clearances. Stage 1
/// needs fewer (position, velocity, previous force; force; keep-out) and is padded with variables that
/// stay zero. That costs some time, but both stages share memory and the code of one QP solver.
pub mod size {
    use super::LINKS;
    /// States of an arm of so many joints: attitude and joint angles with their rates.
    pub const fn states(joints: usize) -> usize {
        6 + 2 * joints
    }
    /// Its controls: torques of bus and joints.
    pub const fn controls(joints: usize) -> usize {
        3 + joints
    }
    /// States.
    pub const NX: usize = states(LINKS);
    /// Controls.
    pub const NU: usize = controls(LINKS);
    /// Path constraints: pointing and clearances; in Stage 1 keep-out at the node and at three points
    /// of the interval before it.
    pub const NG: usize = 1 + super::clearance::CONSTRAINTS;
}

#[cfg(test)]
mod tests {
    use super::worse;

    #[test]
    fn what_is_not_a_number_stays_so() {
        assert_eq!(worse(1.0, 2.0), 2.0);
        assert_eq!(worse(0.0, -1.0), 0.0);
        assert!(worse(1.0, f64::NAN).is_nan() && worse(f64::NAN, 1.0).is_nan());
        assert_eq!(worse(f64::INFINITY, 1.0), f64::INFINITY);
    }
}
