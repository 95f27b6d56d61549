//! Distance of a plan from a local optimum, whatever made it: by one subproblem of each stage at the plan.
//!
//! The subproblem's best step is zero at a local optimum. The cost's change along the best step within the
//! trust region is therefore a residual of the conditions of Karush, Kuhn and Tucker, in units of the cost.

use crate::formats::{MAX_JOINTS, Mission, Motion, Scenario, resized_motion};
use crate::memory::{on_heap, on_large_stack};
use crate::method::{Integrator, Mode};
use crate::threads::Threads;
use remora_core::advanced::model::{self, TargetState};
use remora_core::advanced::planner::{ArmSolver, PlanSettings};
use remora_core::advanced::qp::{Qp, QpSolver, Solution};
use remora_core::advanced::scp::{Problem, Residuals, Settings};
use remora_core::advanced::stages::{
    Formulation, LINKS, NODES, Reorientation, ReorientationTrajectory, Translation,
    TranslationTrajectory, size,
};
use remora_core::advanced::time::Deadline;
use serde::Serialize;

/// Change of a stage's cost along the best step from a plan, as a share of the cost. It is infinite if no
/// subproblem at the plan can be solved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Optimality {
    /// Share of Stage 1.
    pub stage1: f64,
    /// Share of Stage 2.
    pub stage2: f64,
    /// Whether both are small, and no constraint is violated by much, whatever the mission tolerates.
    pub is_converged: bool,
}

impl Optimality {
    /// Computes it for a plan in [`Mode::Optimal`].
    pub fn of(
        mission: &Mission,
        scenario: &Scenario,
        integrator: Integrator,
        translation: &TranslationTrajectory<NODES>,
        motion: &Motion,
    ) -> Self {
        let work = || {
            if mission.joints() == LINKS {
                let (mission, scenario) = (&mission.sized::<LINKS>(), &scenario.resized());
                let motion = &resized_motion(motion);
                return gains::<LINKS, { size::NX }, { size::NU }>(
                    mission,
                    scenario,
                    integrator,
                    translation,
                    motion,
                );
            }
            gains::<MAX_JOINTS, { size::states(MAX_JOINTS) }, { size::controls(MAX_JOINTS) }>(
                mission,
                scenario,
                integrator,
                translation,
                motion,
            )
        };
        let gains = on_large_stack(work).unwrap_or([Gain::UNKNOWN; 2]);
        let [stage1, stage2] = gains.map(|gain| gain.share);
        Self { stage1, stage2, is_converged: gains.iter().all(|gain| gain.is_small) }
    }

    /// The larger share.
    pub fn worst(&self) -> f64 {
        self.stage1.max(self.stage2)
    }
}

/// The change of one stage's cost.
#[derive(Clone, Copy)]
struct Gain {
    share: f64,
    is_small: bool,
}

impl Gain {
    /// Unknown: no subproblem could be solved.
    const UNKNOWN: Self = Self { share: f64::INFINITY, is_small: false };
}

/// Largest share that counts as small. The planner's own convergence is finer. But margins that it widened, or
/// force that it held back for the wheels, are unknown here.
const SHARE: f64 = 0.01;

/// Multiple of the solver's absolute tolerance up to which a change is small, too.
const PATIENCE: f64 = 2.0;

/// Largest violation in the subproblem's scaled units that is small, whatever the mission tolerates.
const VIOLATION: f64 = 0.05;

/// Penalty of violations: above any multiplier, so that violating a constraint never pays.
const PENALTY: f64 = 1e3;

/// Complementarity of a subproblem's solution over the absolute tolerance, as in the solver.
const GAP: f64 = 2.5e-7;

fn gains<const NL: usize, const NX: usize, const NU: usize>(
    mission: &model::Mission<NL>,
    scenario: &model::Scenario<NL>,
    integrator: Integrator,
    translation: &TranslationTrajectory<NODES>,
    motion: &ReorientationTrajectory<NODES, NL>,
) -> [Gain; 2] {
    let settings = PlanSettings::new(Mode::Optimal, integrator);
    let target = target_motion(mission, scenario, integrator);
    let formulation = Formulation::new(mission, scenario, integrator);
    let mut solver = on_heap(ArmSolver::<NX, NU>::new);
    let path = |max_force: f64, solver: &mut ArmSolver<NX, NU>| {
        let formulation = Formulation { max_force, ..formulation };
        let mut problem = Translation::new(&formulation, &target);
        gain(&mut problem, translation, &settings.translation, solver)
    };
    let mut first = path(formulation.max_force, &mut solver);
    if !first.is_small {
        // The planner may have had less force, so that the wheels hold its moment.
        let largest = translation.force.iter().fold(0.0, |most, f| f64::max(most, f.amax()));
        let held = path(largest, &mut solver);
        first = if held.share < first.share { held } else { first };
    }
    let mut problem = Reorientation::<Threads, NODES, NL, NX, NU>::new(
        &formulation,
        translation,
        &target,
        Mode::Optimal,
        &Threads::One,
    );
    [first, gain(&mut problem, motion, &settings.reorientation, &mut solver)]
}

/// The target at the nodes of a plan, as the integrator propagates it.
pub(crate) fn target_motion<const NL: usize>(
    mission: &model::Mission<NL>,
    scenario: &model::Scenario<NL>,
    integrator: Integrator,
) -> [TargetState; NODES] {
    let (grid, mean_motion) = (mission.grid(scenario), mission.mean_motion());
    let mut target = [TargetState::ZERO; NODES];
    let nodes = &mut target[..grid.nodes.min(NODES)];
    let (attitude, rate) = (&scenario.target_attitude, &scenario.target_rate);
    mission.target.tumble(integrator, mean_motion, attitude, rate, grid.interval(), nodes);
    target
}

/// Convexifies at a trajectory, and once more with the multipliers found, which the Hessian depends on.
fn gain<P, const NX: usize, const NU: usize>(
    problem: &mut P,
    at: &P::Trajectory,
    settings: &Settings,
    solver: &mut ArmSolver<NX, NU>,
) -> Gain
where
    P: Problem<NODES, NX, NU, { size::NG }>,
    P::Trajectory: Copy,
{
    let mut at = on_heap(|| *at);
    problem.project(&mut at);
    let mut residuals = on_heap(|| Residuals::ZERO);
    problem.residuals(&at, &mut residuals);
    let penalty = settings.penalty_parameter.max(PENALTY);
    let mut qp = on_heap(|| Qp::<NODES, NX, NU, { size::NG }>::ZERO);
    let mut step = on_heap(|| Solution::ZERO);
    let mut change = f64::INFINITY;
    for is_first in [true, false] {
        problem.linearise(&at, (!is_first).then_some(&*step), &mut qp);
        if qp.defect_penalty.is_finite() {
            qp.defect_penalty = penalty;
        }
        qp.path_penalty = penalty;
        qp.complementarity = GAP * settings.absolute_cost_tolerance;
        problem.bound(&at, settings.radius, &mut qp);
        solver.reset();
        if !solver.solve(&qp, &mut step, &Deadline::never()).status.is_usable() {
            change = f64::INFINITY;
            break;
        }
        // A step that repairs violations may cost more: the plan is no optimum then either.
        change = qp.cost(&step).abs();
    }
    let share = if change == 0.0 { 0.0 } else { change / residuals.cost };
    let is_small = share <= SHARE || change <= PATIENCE * settings.absolute_cost_tolerance;
    let defects = residuals.defect.iter().map(|defect| defect.amax());
    let rows = residuals.path.iter().map(|row| row.max());
    let is_kept = defects.chain(rows).all(|violation| violation <= VIOLATION);
    Gain { share, is_small: is_small && is_kept }
}
