//! Scenario in, plan out: the stages in order, within a deadline, with a record of evidence.
//!
//! [`plan`] needs a solver of the convex subproblem, an [`Environment`] and a [`Workspace`], all
//! the caller's. `docs/planner.md` tells how it is used in flight.

mod evidence;
mod gains;
mod guess;
pub mod memory;
mod options;
mod report;
mod run;
mod session;
#[cfg(test)]
mod tests;
mod tighten;
mod workspace;

pub use evidence::{
    Evidence, Fallback, StageEvidence, VERSION, mission_checksum, output_checksum,
    scenario_checksum,
};
pub use gains::{Gain, feedback_gain};
pub use guess::{GuessRecord, InitialGuess};
pub use options::{Environment, Options, OptionsBuilder, PlanSettings};
pub use report::{PhaseTimes, Report, StageReport, Verdict};
pub(crate) use session::Session;
pub use workspace::{EmbeddedSolver, Workspace};

use crate::model::{Mission, Refusal, Scenario};
use crate::pair::Pair;
use crate::scp::Status;
use crate::stages::{
    Clearances, Formulation, LINKS, NODES, ReorientationTrajectory, Residuals,
    TranslationTrajectory, Verification, size,
};
use remora_qp::Checksum;
use remora_qp::QpSolver;
use remora_qp::time::Deadline;
use run::Run;

/// Solver of the subproblems of both stages. The planner resets it at the start of each.
pub trait Solver: QpSolver<NODES, { size::NX }, { size::NU }, { size::NG }> {}
impl<S: QpSolver<NODES, { size::NX }, { size::NU }, { size::NG }>> Solver for S {}

/// Most trials of a Stage 1 with less force than its optimum, where the wheels cannot hold the moment
/// of that.
pub const MAX_HELD: usize = 3;

/// Most times that margins are widened where the verifier finds a limit passed between nodes.
pub const MAX_TIGHTENINGS: usize = 3;

/// Plans one approach; the trajectories are left in `workspace`.
///
/// A scenario that no plan can end well is refused
/// before anything is planned ([`Report::refusal`]). A stage that fails leaves its best iterate;
/// Stage 2 runs whatever became of Stage 1, so that there is always something to look at. Where
/// the verifier finds a limit passed between nodes, planning keeps further from it and goes on from
/// the plan there is. Once the deadline has passed nothing more is tried: a stage that has not
/// begun is left at its start (Stage 1 coasting, Stage 2 at its start). Time is kept back for the
/// verifier; [`Report::is_verified`] tells whether what is left can be flown.
// An entry point: the stack below it has a bound of its own.
#[inline(never)]
pub fn plan<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &PlanSettings,
    start: &InitialGuess<'_>,
    solver: &mut S,
    environment: &Environment<P>,
    workspace: &mut Workspace,
) -> Report {
    let clock = environment.clock;
    let started = clock.seconds();
    let mut settings = Checksum::new();
    evidence::add_options(&mut settings, options);
    start.identify(&mut settings);
    solver.identify(&mut settings);
    let record = Evidence::new(evidence::input_checksum(mission, scenario), settings.value());
    if let Err(refusal) = mission.check::<NODES>(scenario, options.integrator) {
        return refused(refusal, record, workspace);
    }
    let deadline = Deadline::after(clock, options.deadline_s);
    let formulation = Formulation { deadline, ..Formulation::new(mission, options.integrator) };
    let pair = environment.pair;
    let mut run = Run { formulation, deadline, scenario, options, solver, pair, workspace };
    let mut report = run.plan(start, record);
    report.times.total_s = clock.seconds() - started;
    report
}

/// What is reported of a scenario that was refused; no trajectory is left from before.
#[inline(never)]
fn refused(refusal: Refusal, record: Evidence, workspace: &mut Workspace) -> Report {
    workspace.translation.trajectory = TranslationTrajectory::ZERO;
    workspace.translation.log.clear();
    workspace.reorientation.trajectory = ReorientationTrajectory::BLANK;
    workspace.reorientation.log.clear();
    let status = Status::Infeasible;
    let output = output_checksum(workspace.path(), workspace.motion());
    Report {
        status,
        refusal: Some(refusal),
        translation: StageReport::default(),
        reorientation: StageReport::default(),
        residuals: Residuals::UNFINISHED,
        clearances: Clearances::NONE,
        times: PhaseTimes::default(),
        evidence: Evidence { status, output, ..record },
    }
}

/// The status of a plan whose stages ended so.
fn status_of(
    stages: Status,
    found: &Verification,
    is_verified: bool,
    deadline: &Deadline,
) -> Status {
    if stages != Status::Solved || is_verified {
        return stages;
    }
    match found.residuals.is_finite() {
        true => Status::Infeasible,
        false if deadline.has_passed() => Status::Deadline,
        false => Status::NumericalFailure,
    }
}

/// Stage 2 from the trajectory in the workspace, along the path in the workspace.
pub fn plan_reorientation<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    options: &PlanSettings,
    solver: &mut S,
    environment: &Environment<P>,
    workspace: &mut Workspace,
) -> StageReport {
    let deadline = Deadline::after(environment.clock, options.deadline_s);
    let formulation = Formulation { deadline, ..Formulation::new(mission, options.integrator) };
    run::reorient(
        &formulation,
        options.mode,
        &options.reorientation,
        solver,
        environment.pair,
        workspace,
    )
}
