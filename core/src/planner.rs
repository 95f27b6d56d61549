//! Scenario in, plan out: the stages in order.

use crate::dynamics::Integrator;
use crate::model::{Mission, Scenario, TargetState};
use crate::qp::QpSolver;
use crate::scp::{self, Log, Outcome, Settings, Status};
use crate::stages::{
    LINKS, Mode, NODES, Reorientation, ReorientationTrajectory, Residuals, Translation,
    TranslationTrajectory, heuristic, reorientation_size as two, translation_size as one, verify,
};
use crate::time::Clock;

/// Solver of Stage 1's subproblems.
pub trait TranslationSolver: QpSolver<NODES, { one::NX }, { one::NU }, { one::NR }> {}
impl<S: QpSolver<NODES, { one::NX }, { one::NU }, { one::NR }>> TranslationSolver for S {}

/// Solver of Stage 2's subproblems.
pub trait ReorientationSolver: QpSolver<NODES, { two::NX }, { two::NU }, { two::NR }> {}
impl<S: QpSolver<NODES, { two::NX }, { two::NU }, { two::NR }>> ReorientationSolver for S {}

/// How a plan is to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Optimality or feasibility.
    pub mode: Mode,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// The loop's settings for Stage 1.
    pub translation: Settings,
    /// The loop's settings for Stage 2.
    pub reorientation: Settings,
}

impl Options {
    /// The tuned settings for a mode and an integrator.
    pub fn new(mode: Mode, integrator: Integrator) -> Self {
        Self {
            mode,
            integrator,
            translation: Settings { settle: 1e-6, weight: 100.0, ..Settings::default() },
            reorientation: Settings {
                stop_when_feasible: mode == Mode::Feasible,
                ..Settings::default()
            },
        }
    }
}

/// Report of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct StageReport {
    /// How the loop ended.
    pub outcome: Outcome,
    /// Cost as the problem defines it.
    pub cost: f64,
    /// Time of the whole stage [s].
    pub time_s: f64,
}

/// Report of a plan; the trajectories are in the workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The worse of the stages' statuses; solved only where the verifier agrees.
    pub status: Status,
    /// Stage 1.
    pub translation: StageReport,
    /// Stage 2.
    pub reorientation: StageReport,
    /// The verifier's residuals.
    pub residuals: Residuals,
}

/// All the memory a plan needs. The caller owns it; [`Workspace::BYTES`] is its size.
pub struct Workspace {
    /// The target's tumble at the nodes.
    pub target: [TargetState; NODES],
    /// Stage 1: path and log.
    pub translation:
        scp::Workspace<TranslationTrajectory<NODES>, NODES, { one::NX }, { one::NU }, { one::NR }>,
    /// Stage 2: attitude, arm and log.
    pub reorientation: scp::Workspace<
        ReorientationTrajectory<NODES, LINKS>,
        NODES,
        { two::NX },
        { two::NU },
        { two::NR },
    >,
}

impl Workspace {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Storage for any number of plans, one after the other. Place it in static memory or on a
    /// heap: it is too large for a small stack. All bits are zero, so that static memory costs no
    /// room in an image.
    pub const fn new() -> Self {
        Self {
            target: [TargetState::BLANK; NODES],
            translation: scp::Workspace::new(TranslationTrajectory::ZERO),
            reorientation: scp::Workspace::new(ReorientationTrajectory::BLANK),
        }
    }

    /// The path of the centre of mass last planned.
    pub fn path(&self) -> &TranslationTrajectory<NODES> {
        &self.translation.trajectory
    }

    /// Attitude and arm last planned.
    pub fn motion(&self) -> &ReorientationTrajectory<NODES, LINKS> {
        &self.reorientation.trajectory
    }

    /// The loops' logs.
    pub fn logs(&self) -> (&Log, &Log) {
        (&self.translation.log, &self.reorientation.log)
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

/// Plans one approach with the heuristic start; the trajectories are left in `workspace`.
///
/// `mission` and the settings must be valid. A stage that fails leaves its best iterate; Stage 2
/// runs whatever became of Stage 1, so that there is always something to look at.
pub fn plan<S1: TranslationSolver, S2: ReorientationSolver>(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &Options,
    solvers: (&mut S1, &mut S2),
    clock: &dyn Clock,
    workspace: &mut Workspace,
) -> Report {
    let dt = mission.approach.duration / (NODES - 1) as f64;
    mission.target.tumble(
        mission.mean_motion(),
        &scenario.target_attitude,
        &scenario.target_rate,
        dt,
        &mut workspace.target,
    );
    let translation =
        plan_translation(mission, scenario, &options.translation, solvers.0, clock, workspace);
    let started = clock.seconds();
    heuristic::warm_start(
        mission,
        &workspace.translation.trajectory,
        &workspace.target,
        &mut workspace.reorientation.trajectory,
    );
    let mut reorientation = plan_reorientation(mission, options, solvers.1, clock, workspace);
    reorientation.time_s = clock.seconds() - started;

    let residuals = verify(
        mission,
        scenario,
        options.integrator,
        &workspace.translation.trajectory,
        &workspace.reorientation.trajectory,
    );
    let mut status = translation.outcome.status.max(reorientation.outcome.status);
    if status == Status::Solved && !residuals.are_within(&mission.tolerances) {
        status = Status::NumericalFailure;
    }
    Report { status, translation, reorientation, residuals }
}

/// Stage 1 from its own start.
fn plan_translation<S: TranslationSolver>(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    settings: &Settings,
    solver: &mut S,
    clock: &dyn Clock,
    workspace: &mut Workspace,
) -> StageReport {
    let started = clock.seconds();
    let Workspace { target, translation: w, .. } = workspace;
    let mut problem = Translation::new(mission, scenario, target);
    solver.reset();
    let start = problem.warm_start(solver, &mut w.qp, &mut w.step, &mut w.trajectory);
    let mut outcome = if start.status.is_usable() {
        scp::solve(&mut problem, solver, settings, clock, w)
    } else {
        w.log.clear();
        Outcome { status: Status::of_failed(start.status), ..Default::default() }
    };
    // The start is a subproblem too.
    outcome.iterations += 1;
    StageReport {
        outcome,
        cost: problem.cost(&w.trajectory.force),
        time_s: clock.seconds() - started,
    }
}

/// Stage 2 from the trajectory in the workspace, along the path in the workspace.
pub fn plan_reorientation<S: ReorientationSolver>(
    mission: &Mission<LINKS>,
    options: &Options,
    solver: &mut S,
    clock: &dyn Clock,
    workspace: &mut Workspace,
) -> StageReport {
    let started = clock.seconds();
    let Workspace { target, translation, reorientation: w } = workspace;
    let mut problem = Reorientation::<NODES, LINKS, { two::NX }, { two::NU }>::new(
        mission,
        &translation.trajectory,
        target,
        options.integrator,
        options.mode,
    );
    solver.reset();
    let outcome = scp::solve(&mut problem, solver, &options.reorientation, clock, w);
    StageReport {
        outcome,
        cost: problem.cost(&w.trajectory.controls),
        time_s: clock.seconds() - started,
    }
}
