//! Scenario in, plan out: the stages in order, within a deadline, with a solve record.
//!
//! [`plan`] needs a QP solver, a [`Platform`] and a [`Workspace`], all the caller's.
//! `docs/concepts/planner.md` describes its use in flight.

mod guess;
mod kept;
pub mod memory;
mod nominal;
mod options;
mod record;
mod report;
mod run;
mod scrub;
mod session;
#[cfg(test)]
mod tests;
mod tighten;
mod workspace;

pub use guess::{GuessRecord, InitialGuess};
pub use nominal::Nominal;
pub use options::{Options, OptionsBuilder, PlanSettings, Platform};
pub use record::{
    Fallback, SolveRecord, StageSolveRecord, VERSION, input_checksum, mission_checksum,
    output_checksum, scenario_checksum,
};
pub use report::{PhaseTimes, Report, StageReport, Verdict};
pub use scrub::settings_checksum;
pub use session::Session;
pub use workspace::{ArmSolver, ArmWorkspace, EmbeddedSolver, Workspace};

use crate::executor::ForkJoin;
use crate::model::{Mission, Refusal, Scenario};
use crate::scp::Status;
use crate::stages::{
    ArmClearances, Clearances, Formulation, NODES, ReorientationTrajectory, Residuals,
    TranslationTrajectory, Verification, size,
};
use remora_qp::QpSolver;
use remora_qp::time::Deadline;
use run::Run;
use scrub::{Constants, Scrubbed};

/// QP solver of both stages. The planner resets it at the start of each.
pub trait Solver<const NX: usize = { size::NX }, const NU: usize = { size::NU }>:
    QpSolver<NODES, NX, NU, { size::NG }>
{
}
impl<const NX: usize, const NU: usize, S: QpSolver<NODES, NX, NU, { size::NG }> + ?Sized>
    Solver<NX, NU> for S
{
}

/// Most trials of Stage 1 with less force, where the wheels cannot hold the optimum's moment.
pub const MAX_FORCE_TRIALS: usize = 3;

/// Most times that margins are widened after the verifier found a violation between nodes.
pub const MAX_TIGHTENINGS: usize = 5;

/// Plans one approach; the trajectories are left in `workspace`.
///
/// An infeasible scenario is refused before planning ([`Report::refusal`]). A stage that fails leaves
/// its best iterate, and Stage 2 runs whatever became of Stage 1. Where the verifier finds a violation
/// between nodes, planning continues with wider margins. Once the deadline has passed no stage begins:
/// it is left at its initial guess (Stage 1 coasting). Time is reserved for the verifier;
/// [`Report::is_verified`] says whether the plan can be flown. With [`Options::scrubbing`] a plan is refused
/// where what it was made from has changed meanwhile.
// Not inlined: an entry point with a stack bound of its own.
#[inline(never)]
pub fn plan<S: Solver<NX, NU>, P: ForkJoin, const NL: usize, const NX: usize, const NU: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    options: &Options<'_, P, NL>,
    solver: &mut S,
    workspace: &mut ArmWorkspace<NL, NX, NU>,
) -> Report {
    let (guess, platform) = (options.initial_guess(), options.platform());
    let (is_scrubbed, options) = (options.is_scrubbed(), options.settings());
    let clock = platform.clock;
    let started = clock.seconds();
    let settings = settings_checksum(options, guess, solver);
    let input = input_checksum(mission, scenario);
    let recovery = mission.recovery(scenario, mission.grid(scenario).keep_out(0)).code();
    let record = SolveRecord { recovery, ..SolveRecord::new(input, settings) };
    if let Err(refusal) = mission.check::<NODES>(scenario, options.integrator) {
        return refused(refusal, record, workspace);
    }
    let deadline = Deadline::after(clock, options.deadline_s);
    let formulation = Formulation::new(mission, scenario, options.integrator);
    let formulation = Formulation { deadline, ..formulation };
    let executor = platform.executor;
    let constants = Constants { mission, scenario, options, guess, input, settings };
    let solver = Scrubbed { constants: is_scrubbed.then_some(&constants), ..Scrubbed::off(solver) };
    let mut run = Run { formulation, deadline, options, solver, executor, workspace };
    let mut report = run.plan(guess, record);
    report.times.total_s = clock.seconds() - started;
    report
}

/// The report of a refused scenario; clears the trajectories in `workspace`.
#[inline(never)]
fn refused<const NL: usize, const NX: usize, const NU: usize>(
    refusal: Refusal,
    record: SolveRecord,
    workspace: &mut ArmWorkspace<NL, NX, NU>,
) -> Report {
    workspace.translation.trajectory = TranslationTrajectory::ZERO;
    workspace.translation.log.clear();
    workspace.reorientation.trajectory = ReorientationTrajectory::BLANK;
    workspace.reorientation.log.clear();
    let status = Status::Infeasible;
    let output = output_checksum(NODES, workspace.translation(), workspace.reorientation());
    Report {
        status,
        refusal: Some(refusal),
        translation: StageReport::default(),
        reorientation: StageReport::default(),
        residuals: Residuals::UNFINISHED,
        clearances: Clearances::NONE,
        arm: ArmClearances::NONE,
        times: PhaseTimes::default(),
        record: SolveRecord { status, output, ..record },
    }
}

/// Status of a plan from its stages' status and the verifier's findings.
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

/// Plans Stage 2 alone, from the trajectory in the workspace along the translation in it.
pub fn plan_reorientation<
    S: Solver<NX, NU>,
    P: ForkJoin,
    const NL: usize,
    const NX: usize,
    const NU: usize,
>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    options: &PlanSettings,
    solver: &mut S,
    platform: &Platform<P>,
    workspace: &mut ArmWorkspace<NL, NX, NU>,
) -> StageReport {
    let deadline = Deadline::after(platform.clock, options.deadline_s);
    let formulation = Formulation::new(mission, scenario, options.integrator);
    let formulation = Formulation { deadline, ..formulation };
    run::reorient(
        &formulation,
        options.mode,
        &options.reorientation,
        solver,
        platform.executor,
        workspace,
    )
}
