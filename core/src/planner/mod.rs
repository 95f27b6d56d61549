//! Scenario in, plan out: the stages in order, within a deadline, with a record of evidence.
//!
//! [`plan`] needs a solver of the convex subproblem, an [`Environment`] and a [`Workspace`], all
//! the caller's. `docs/planner.md` tells how it is used in flight.

mod evidence;
mod gains;
pub mod memory;
mod options;
mod report;
mod start;
#[cfg(test)]
mod tests;
mod workspace;

pub use evidence::{Evidence, Fallback, StageEvidence, VERSION, output_checksum};
pub use gains::{Gain, feedback_gain};
pub use options::{Environment, Options};
pub use report::{PhaseTimes, Report, StageReport, Verdict};
pub use start::{Start, StartRecord};
pub use workspace::{EmbeddedSolver, Workspace};

use crate::math::Checksum;
use crate::model::{Integrator, Mission, Scenario};
use crate::pair::Pair;
use crate::qp::QpSolver;
use crate::scp::{self, Outcome, Settings, Status};
use crate::stages::{LINKS, NODES, Reorientation, Translation, Verification, size, verify};
use crate::time::Deadline;

/// Solver of the subproblems of both stages. The planner resets it at the start of each.
pub trait Solver: QpSolver<NODES, { size::NX }, { size::NU }, { size::NR }> {}
impl<S: QpSolver<NODES, { size::NX }, { size::NU }, { size::NR }>> Solver for S {}

/// Plans one approach; the trajectories are left in `workspace`.
///
/// `mission` and the settings must be valid. A stage that fails leaves its best iterate; Stage 2
/// runs whatever became of Stage 1, so that there is always something to look at. Once the deadline
/// has passed nothing more is tried: a stage that has not begun is left at its start (Stage 1
/// coasting, Stage 2 at its start). What is left is verified in any case, and
/// [`Report::is_verified`] tells whether it can be flown.
// An entry point: the stack below it has a bound of its own.
#[inline(never)]
pub fn plan<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &Options,
    start: &mut Start<'_>,
    solver: &mut S,
    environment: &Environment<P>,
    workspace: &mut Workspace,
) -> Report {
    let clock = environment.clock;
    let deadline = Deadline::after(clock, options.deadline_s);
    let mut times = PhaseTimes::default();
    let started = clock.seconds();
    tumble(mission, scenario, options.integrator, workspace);
    times.start_s = clock.seconds() - started;
    let (translation, one) =
        plan_translation(mission, scenario, options, solver, &deadline, workspace);
    times.translation_s = translation.time_s;

    let attitude =
        plan_attitude(mission, options, start, solver, environment.pair, &deadline, workspace);
    times.add(&attitude.times);

    let from = clock.seconds();
    let (path, motion) = (workspace.path(), workspace.motion());
    let Verification { residuals, clearances } =
        verify(mission, scenario, options.integrator, path, motion, &Deadline::never());
    let is_verified = residuals.are_within(&mission.tolerances);
    times.verify_s = clock.seconds() - from;

    let mut status = translation.outcome.status.max(attitude.report.outcome.status);
    if status == Status::Solved && !is_verified {
        status = Status::NumericalFailure;
    }
    let mut settings = Checksum::new();
    evidence::add_options(&mut settings, options);
    start.identify(&mut settings);
    solver.identify(&mut settings);
    let evidence = Evidence {
        version: VERSION,
        input: evidence::input_checksum(mission, scenario),
        settings: settings.value(),
        output: output_checksum(path, motion),
        status,
        is_verified,
        start: attitude.start,
        translation: one,
        reorientation: attitude.evidence,
    };
    times.total_s = clock.seconds() - started;
    let reorientation = attitude.report;
    Report { status, translation, reorientation, residuals, clearances, times, evidence }
}

/// What became of Stage 2.
struct Attitude {
    report: StageReport,
    evidence: StageEvidence,
    start: StartRecord,
    /// Times of its start and its iterations.
    times: PhaseTimes,
}

/// Stage 2 along the path in the workspace: its start, its loop, and the loop again from the
/// heuristic where a learned start, or one handed in, led nowhere.
fn plan_attitude<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    options: &Options,
    start: &mut Start<'_>,
    solver: &mut S,
    pair: &P,
    deadline: &Deadline,
    workspace: &mut Workspace,
) -> Attitude {
    let from = deadline.seconds();
    let mut times = PhaseTimes::default();
    let mut begun = start.write(mission, options, pair, deadline, workspace);
    times.start_s = deadline.seconds() - from;
    if !matches!(start, Start::Heuristic) {
        times.inference_s = times.start_s;
    }
    let settings = match begun.is_offered() {
        true => &options.learned,
        false => &options.reorientation,
    };
    let mut report = reorient(mission, options, settings, solver, pair, deadline, workspace);
    times.add_iterations(&workspace.reorientation.log);
    let mut evidence = StageEvidence::new(&report, &workspace.reorientation.log);
    if begun.is_offered() && gives_way(&report.outcome, options) {
        begun = StartRecord::Unsolved;
        start::write_heuristic(mission, workspace);
        let settings = &options.reorientation;
        let again = reorient(mission, options, settings, solver, pair, deadline, workspace);
        times.add_iterations(&workspace.reorientation.log);
        evidence = StageEvidence::new(&again, &workspace.reorientation.log).after(&evidence);
        report = again.after(&report);
    }
    report.time_s = deadline.seconds() - from;
    Attitude { report, evidence, start: begun, times }
}

/// Whether Stage 2 is worth trying again from the heuristic, after it ended so from another start.
/// A feasible plan in the hand is not given away against the clock.
fn gives_way(outcome: &Outcome, options: &Options) -> bool {
    match outcome.status {
        Status::Solved | Status::Deadline => false,
        _ => !(outcome.violation <= 1.0 && options.deadline_s.is_finite()),
    }
}

/// The target's motion at the nodes.
fn tumble(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    integrator: Integrator,
    workspace: &mut Workspace,
) {
    let dt = mission.approach.duration / (NODES - 1) as f64;
    mission.target.tumble(
        integrator,
        mission.mean_motion(),
        &scenario.target_attitude,
        &scenario.target_rate,
        dt,
        &mut workspace.target,
    );
}

/// Stage 1 from its own start.
// The stages and the verifier share the stack, one after the other.
#[inline(never)]
fn plan_translation<S: Solver>(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &Options,
    solver: &mut S,
    deadline: &Deadline,
    workspace: &mut Workspace,
) -> (StageReport, StageEvidence) {
    let started = deadline.seconds();
    let Workspace { target, scratch: w, translation: z, .. } = workspace;
    let mut problem = Translation::new(mission, options.integrator, scenario, target);
    solver.reset();
    let start = problem.warm_start(solver, deadline, &mut w.qp, &mut w.step, &mut z.trajectory);
    let mut outcome = if start.status.is_usable() {
        scp::solve(&mut problem, solver, &options.translation, deadline, w, z)
    } else {
        z.log.clear();
        Outcome {
            status: Status::of_failed(start.status),
            violation: f64::INFINITY,
            ..Default::default()
        }
    };
    // The start is a subproblem too.
    outcome.iterations += 1;
    let report = StageReport {
        outcome,
        cost: problem.cost(&z.trajectory.force),
        time_s: deadline.seconds() - started,
    };
    let mut evidence = StageEvidence::new(&report, &z.log);
    evidence.count(start);
    (report, evidence)
}

/// Stage 2 from the trajectory in the workspace, along the path in the workspace.
pub fn plan_reorientation<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    options: &Options,
    solver: &mut S,
    environment: &Environment<P>,
    workspace: &mut Workspace,
) -> StageReport {
    let deadline = Deadline::after(environment.clock, options.deadline_s);
    let settings = &options.reorientation;
    reorient(mission, options, settings, solver, environment.pair, &deadline, workspace)
}

/// The same, with a deadline that may have begun before.
#[inline(never)]
fn reorient<S: Solver, P: Pair>(
    mission: &Mission<LINKS>,
    options: &Options,
    settings: &Settings,
    solver: &mut S,
    pair: &P,
    deadline: &Deadline,
    workspace: &mut Workspace,
) -> StageReport {
    let started = deadline.seconds();
    let Workspace { target, scratch: w, translation, reorientation: z } = workspace;
    let mut problem = Reorientation::<P, NODES, LINKS, { size::NX }, { size::NU }>::new(
        mission,
        &translation.trajectory,
        target,
        options.integrator,
        options.mode,
        pair,
    );
    solver.reset();
    let outcome = scp::solve(&mut problem, solver, settings, deadline, w, z);
    StageReport {
        outcome,
        cost: problem.cost(&z.trajectory.controls),
        time_s: deadline.seconds() - started,
    }
}
