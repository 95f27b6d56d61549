//! One plan: the stages, the verifier, and further tries after its findings.

use super::kept::Path;
use super::scrub::Scrubbed;
use super::tighten::{force_limit_of_wheels, gentler, slower, tightened};
use super::{
    ArmWorkspace, GuessRecord, InitialGuess, MAX_FORCE_TRIALS, MAX_TIGHTENINGS, PhaseTimes,
    PlanSettings, Report, SolveRecord, Solver, StageReport, StageSolveRecord, guess,
    output_checksum, refused, status_of,
};
use crate::executor::ForkJoin;
use crate::scp::{self, Outcome, Settings, Status};
use crate::stages::{
    ArmClearances, Clearances, Formulation, Mode, NODES, Reorientation, Residuals, Translation,
    Verification, recovery, verify, verify_first,
};
use core::hint::black_box;
use remora_qp::time::Deadline;
use remora_qp::{QpSolver, Valid};

/// Time reserved for the verifier, over the measured time of one interval times their number.
const RESERVE: f64 = 1.5;

/// Fraction of the iterations that an offered guess may take before the heuristic is tried.
const TRIAL_SHARE: f64 = 0.6;

/// Iterations of Stage 2 that are kept back where limits hold between nodes, too: a plan that has not
/// converged and passes one there is led back within them.
const SPARE: usize = 8;

/// State of a plan.
pub(super) struct Run<'a, 'w, S, P, const NL: usize, const NX: usize, const NU: usize> {
    /// The current formulation; its deadline leaves the verifier its time.
    pub formulation: Formulation<'a, NL>,
    /// Deadline of the whole plan.
    pub deadline: Deadline<'a>,
    pub options: &'a PlanSettings,
    pub solver: Scrubbed<'w, 'a, S, NL>,
    pub executor: &'a P,
    pub workspace: &'w mut ArmWorkspace<NL, NX, NU>,
}

/// Result of one stage.
pub(super) struct StageResult {
    pub report: StageReport,
    record: StageSolveRecord,
    /// Times of its initial guess and iterations.
    times: PhaseTimes,
}

impl StageResult {
    /// Adds the work of an earlier try.
    // Not inlined: it is called between tries, and an image's room counts.
    #[inline(never)]
    fn after(mut self, first: &Self) -> Self {
        self.report = self.report.after(&first.report);
        self.record = self.record.after(&first.record);
        self.times.add(&first.times);
        self
    }

    /// Says of a result that it has not converged, though the last try has ended as it should.
    fn is_unfinished(&mut self) {
        let status = &mut self.report.outcome.status;
        *status = (*status).max(Status::IterationLimit);
        self.record.status = *status;
    }

    /// Iterations left in the stage's budget, over all tries.
    fn left(&self, settings: &Settings) -> usize {
        settings.max_iterations.saturating_sub(self.report.outcome.iterations)
    }
}

impl<S: Solver<NX, NU>, P: ForkJoin, const NL: usize, const NX: usize, const NU: usize>
    Run<'_, '_, S, P, NL, NX, NU>
{
    /// Plans both stages, verifies, and tries again with changed formulations.
    pub fn plan(&mut self, guess: &InitialGuess<'_, NL>, record: SolveRecord) -> Report {
        let mut times = PhaseTimes::default();
        let from = self.deadline.seconds();
        self.propagate_target();
        times.start_s = self.deadline.seconds() - from;
        let mut translation = self.translate_held();
        self.solver.show(&mut Path(&mut self.workspace.translation.trajectory));
        self.reserve_verifier_time();
        let (mut reorientation, guess_record) = self.reorient_from(guess);
        let residuals = Residuals::UNFINISHED;
        let (clearances, arm) = (Clearances::NONE, ArmClearances::NONE);
        let mut found = Verification { residuals, clearances, arm };
        self.verify(&mut found, &mut times);
        let mut is_last_resort = false;
        // Bound: tightenings.
        for _ in 0..MAX_TIGHTENINGS {
            let before = self.formulation;
            let stages = [&translation, &reorientation];
            let change = match self.change(&found, stages) {
                None if !is_last_resort => self.last_resort(&found, stages),
                change => change,
            };
            let Some(change) = change else { break };
            is_last_resort |= matches!(change, Change::Iterations | Change::WithoutCost);
            if matches!(change, Change::BothStages | Change::Gentler) {
                let was = translation.report.outcome.iterations;
                let left = translation.left(&self.options.translation).saturating_sub(was);
                if left == 0 {
                    break;
                }
                translation = self.translate(left).after(&translation);
                if translation.report.outcome.status != Status::Solved {
                    // Back to the translation that Stage 2 was planned along.
                    self.formulation = before;
                    translation = self.translate(was).after(&translation);
                    break;
                }
            }
            reorientation = self.reorient_after(change, reorientation);
            self.verify(&mut found, &mut times);
        }
        times.translation_s = translation.report.time_s;
        times.add(&reorientation.times);
        self.solver.look::<NX, NU>();
        self.solver.look_at_model();
        let record = SolveRecord { start: guess_record, ..record };
        self.report([&translation, &reorientation], &found, times, record)
    }

    /// Plans Stage 2 again after a change.
    // Not inlined, as `translate_held`.
    #[inline(never)]
    fn reorient_after(&mut self, change: Change, before: StageResult) -> StageResult {
        let options = self.options;
        let left = before.left(&options.reorientation);
        let unfinished = before.report.outcome.status == Status::IterationLimit;
        match change {
            Change::Iterations => {
                let iterations = left.saturating_sub(SPARE / 4).max(1);
                self.reorient(&options.learned, iterations).after(&before)
            }
            Change::WithoutCost => {
                guess::write_heuristic(&self.formulation, self.workspace);
                let settings = Settings::stopping_when_feasible(&options.reorientation);
                let first = self.reorient_in(Mode::Feasible, &settings, left).after(&before);
                let left = first.left(&options.reorientation).saturating_sub(SPARE);
                if first.report.outcome.status != Status::Solved || left == 0 {
                    return first;
                }
                self.reorient(&options.learned, left).after(&first)
            }
            Change::Gentler => {
                guess::write_heuristic(&self.formulation, self.workspace);
                self.reorient(&options.reorientation, left).after(&before)
            }
            _ if unfinished => {
                let settings = Settings::stopping_when_feasible(&options.learned);
                let mut next = self.reorient(&settings, left).after(&before);
                next.is_unfinished();
                next
            }
            _ => self.reorient(&options.learned, left).after(&before),
        }
    }

    /// The report of a plan with these results of its stages, or of a refused one where anything was found
    /// damaged.
    // Not inlined, as `translate_held`.
    #[inline(never)]
    fn report(
        &mut self,
        [translation, reorientation]: [&StageResult; 2],
        found: &Verification,
        times: PhaseTimes,
        record: SolveRecord,
    ) -> Report {
        if let Some(refusal) = self.solver.refusal() {
            let SolveRecord { input, settings, recovery, .. } = record;
            let record = SolveRecord { recovery, ..SolveRecord::new(input, settings) };
            return refused(refusal, record, self.workspace);
        }
        let Verification { residuals, clearances, arm } = *found;
        let is_verified = residuals.are_within(&self.formulation.mission.tolerances);
        let stages = translation.report.outcome.status.max(reorientation.report.outcome.status);
        let status = status_of(stages, found, is_verified, &self.deadline);
        let nodes = self.formulation.grid().nodes;
        let output =
            output_checksum(nodes, self.workspace.translation(), self.workspace.reorientation());
        let recovery =
            recovery(&self.formulation, self.workspace.translation(), &self.workspace.target);
        let record = SolveRecord {
            output,
            recovery: recovery.code(),
            status,
            is_verified,
            translation: translation.record,
            reorientation: reorientation.record,
            ..record
        };
        let (translation, reorientation) = (translation.report, reorientation.report);
        Report {
            status,
            refusal: None,
            translation,
            reorientation,
            residuals,
            clearances,
            arm,
            times,
            record,
        }
    }

    /// Propagates the target's attitude to the nodes.
    pub fn propagate_target(&mut self) {
        let Formulation { mission, scenario, integrator, .. } = self.formulation;
        let grid = self.formulation.grid();
        mission.target.tumble(
            integrator,
            mission.mean_motion(),
            &scenario.target_attitude,
            &scenario.target_rate,
            grid.interval(),
            &mut self.workspace.target[..grid.nodes.min(NODES)],
        );
    }

    /// Measures one interval of the verifier, on the heuristic guess, and moves the planning deadline
    /// earlier by the verifier's estimated time.
    #[inline(never)]
    fn reserve_verifier_time(&mut self) {
        if !self.deadline.is_finite() {
            return;
        }
        let Formulation { mission, scenario, integrator, .. } = self.formulation;
        guess::write_heuristic(&self.formulation, self.workspace);
        let from = self.deadline.seconds();
        let (translation, reorientation) =
            (self.workspace.translation(), self.workspace.reorientation());
        let _ = verify_first(mission, scenario, integrator, translation, reorientation);
        let each = self.deadline.seconds() - from;
        let runs = if self.solver.is_on() { 2 } else { 1 };
        let intervals = runs * self.formulation.grid().nodes;
        self.formulation.deadline = self.deadline.earlier_by(RESERVE * intervals as f64 * each);
    }

    /// Runs the verifier, twice where plans are scrubbed, and adds its time. What it has found is left in place,
    /// for the stack holds it once.
    // Not inlined, as `translate_held`.
    #[inline(never)]
    fn verify(&mut self, found: &mut Verification, times: &mut PhaseTimes) {
        let from = self.deadline.seconds();
        *found = self.verify_once();
        if self.solver.is_on() {
            let first = *found;
            *found = self.verify_once();
            self.solver.compare(&first, found, &self.deadline);
        }
        times.verify_s += self.deadline.seconds() - from;
    }

    // Not inlined: it is called twice.
    #[inline(never)]
    fn verify_once(&self) -> Verification {
        let Formulation { mission, scenario, integrator, .. } = self.formulation;
        // The second run is none of what the compiler knows of the first.
        let (mission, scenario) = (black_box(mission), black_box(scenario));
        let (translation, reorientation) =
            (self.workspace.translation(), self.workspace.reorientation());
        verify(mission, scenario, integrator, translation, reorientation, &self.deadline)
    }

    /// Changes the formulation for another try; `None` where no change would help.
    fn change(
        &mut self,
        found: &Verification,
        [translation, reorientation]: [&StageResult; 2],
    ) -> Option<Change> {
        let left = reorientation.left(&self.options.reorientation);
        let [translation, reorientation] =
            [translation, reorientation].map(|stage| stage.report.outcome.status);
        if translation != Status::Solved || left == 0 || self.formulation.deadline.has_passed() {
            return None;
        }
        let limits = &self.formulation.mission.tolerances;
        if found.residuals.dynamics1 > limits.dynamics {
            // A path is rolled out from its forces: this one is not what Stage 1 left.
            return Some(Change::BothStages);
        }
        match reorientation {
            Status::Solved | Status::IterationLimit => {
                self.formulation = tightened(&self.formulation, &found.residuals)?;
                let both = found.residuals.keep_out > limits.keep_out_m;
                Some(if both { Change::BothStages } else { Change::ReorientationMargins })
            }
            Status::Infeasible if found.residuals.dynamics2 > limits.dynamics => {
                let Formulation { mission, scenario, integrator, .. } = self.formulation;
                let needs = mission.needs::<NODES>(scenario, integrator).ok()?;
                let path = self.workspace.translation();
                self.formulation = slower(&self.formulation, path)
                    .or_else(|| gentler(&self.formulation, path, needs.force))?;
                Some(Change::Gentler)
            }
            _ => None,
        }
    }

    /// Change if no other formulation helps but iterations are left. It goes on from a plan that has not
    /// converged, or drops the cost if Stage 2 found no plan with it.
    fn last_resort(
        &self,
        found: &Verification,
        [translation, reorientation]: [&StageResult; 2],
    ) -> Option<Change> {
        let Formulation { mission, margins, extra_clearance, .. } = self.formulation;
        let is_verified = found.residuals.are_within(&mission.tolerances);
        // A plan that was led back within limits between nodes must not leave them again.
        let is_first = margins == mission.margins && extra_clearance == 0.0;
        let left = reorientation.left(&self.options.reorientation);
        if translation.report.outcome.status != Status::Solved
            || left == 0
            || self.options.mode == Mode::Feasible
            || self.formulation.deadline.has_passed()
        {
            return None;
        }
        match reorientation.report.outcome.status {
            Status::IterationLimit if is_verified && is_first => Some(Change::Iterations),
            Status::Infeasible if !is_verified => Some(Change::WithoutCost),
            _ => None,
        }
    }

    /// Plans Stage 1, and again with less force where the wheels cannot hold its moment: with as little
    /// force as the scenario allows.
    // Not inlined: its tries' results are on no other stage's stack.
    #[inline(never)]
    pub fn translate_held(&mut self) -> StageResult {
        let free = self.formulation;
        let mut stage = self.translate(self.options.translation.max_iterations);
        let left = stage.left(&self.options.translation);
        if stage.report.outcome.status == Status::NumericalFailure && left > 0 {
            // No sound data lead there: once more, from data that are made anew.
            stage = self.translate(left).after(&stage);
        }
        let again = stage.report.outcome.iterations;
        let translation = self.workspace.translation();
        if stage.report.outcome.status != Status::Solved {
            return stage;
        }
        let Ok(needs) = free.mission.needs::<NODES>(free.scenario, free.integrator) else {
            return stage;
        };
        let Some([mut max_force, largest]) = force_limit_of_wheels(&free, translation, needs.force)
        else {
            return stage;
        };
        // Bound: trials of less force.
        for _ in 0..MAX_FORCE_TRIALS {
            let left = stage.left(&self.options.translation).saturating_sub(again);
            if left == 0 {
                break;
            }
            self.formulation = Formulation { max_force, ..free };
            stage = self.translate(left).after(&stage);
            if stage.report.outcome.status == Status::Solved {
                return stage;
            }
            // The geometric mean with the force that was enough.
            max_force = libm::sqrt(max_force * largest);
        }
        self.formulation = free;
        self.translate(again).after(&stage)
    }

    /// Plans Stage 1 from its own initial guess.
    // Not inlined: stages and verifier use the stack one after the other.
    #[inline(never)]
    fn translate(&mut self, iterations: usize) -> StageResult {
        let deadline = self.formulation.deadline;
        let started = deadline.seconds();
        let ArmWorkspace { target, scratch: w, translation: z, .. } = &mut *self.workspace;
        let mut problem = Translation::new(&self.formulation, target);
        let solver = &mut self.solver;
        solver.reset();
        let (start, tries) = problem.start(solver, &deadline, w, z);
        // The initial guess is a subproblem too.
        let max_iterations = iterations.saturating_sub(tries).max(1);
        let settings = Settings::with_max_iterations(&self.options.translation, max_iterations);
        let mut outcome = if start.status.is_usable() {
            scp::solve(&mut problem, solver, &settings, &deadline, w, z)
        } else {
            z.log.clear();
            Outcome {
                status: Status::of_failed(start.status),
                violation: f64::INFINITY,
                ..Default::default()
            }
        };
        outcome.iterations += tries;
        z.trajectory.clear_from(self.formulation.grid().nodes);
        let cost = problem.cost(&z.trajectory.force);
        let report = StageReport { outcome, cost, time_s: deadline.seconds() - started };
        let mut record = StageSolveRecord::new(&report, &z.log);
        record.count(start);
        StageResult { report, record, times: PhaseTimes::default() }
    }

    /// Plans Stage 2 along the translation in the workspace from `guess`, and again from the heuristic
    /// where an offered guess fails.
    pub fn reorient_from(&mut self, guess: &InitialGuess<'_, NL>) -> (StageResult, GuessRecord) {
        let (clock, options) = (self.deadline, self.options);
        let from = clock.seconds();
        let mut guess_record =
            guess.write(&self.formulation, options, self.executor, self.workspace);
        let mut times = PhaseTimes { start_s: clock.seconds() - from, ..Default::default() };
        if !matches!(guess, InitialGuess::Heuristic) {
            times.inference_s = times.start_s;
        }
        let budget = options.reorientation.max_iterations;
        let spare = self.spare(budget);
        let mut stage = if guess_record.is_offered() {
            let trial = (TRIAL_SHARE * budget as f64) as usize;
            let first = self.reorient(&options.learned, trial.max(1));
            let left = first.left(&options.reorientation).saturating_sub(spare);
            match self.next_step(&first, left) {
                Next::Accept => first,
                Next::Continue => self.reorient(&options.learned, left).after(&first),
                Next::Heuristic => {
                    guess_record = GuessRecord::Unsolved;
                    guess::write_heuristic(&self.formulation, self.workspace);
                    self.reorient(&options.reorientation, left).after(&first)
                }
            }
        } else {
            self.reorient(&options.reorientation, budget - spare)
        };
        let outcome = &stage.report.outcome;
        if outcome.status == Status::IterationLimit && outcome.violation > 1.0 && spare > 0 {
            // Not even the nodes are feasible: all that is left goes there.
            stage =
                self.reorient(&options.learned, stage.left(&options.reorientation)).after(&stage);
        }
        stage.times.add(&times);
        stage.report.time_s = clock.seconds() - from;
        (stage, guess_record)
    }

    /// Iterations that the first tries of Stage 2 leave of a `budget`: [`SPARE`] where limits hold between
    /// the nodes, but no more than half of it.
    fn spare(&self, budget: usize) -> usize {
        let Formulation { mission, integrator, .. } = self.formulation;
        match mission.approach.between_nodes.is_on(integrator) {
            true => SPARE.min(budget / 2),
            false => 0,
        }
    }

    /// Chooses the next step after a first try of Stage 2 from an offered guess; a feasible plan is kept.
    fn next_step(&self, first: &StageResult, left: usize) -> Next {
        let outcome = &first.report.outcome;
        match outcome.status {
            Status::Solved | Status::Deadline => Next::Accept,
            _ if left == 0 => Next::Accept,
            Status::IterationLimit if outcome.violation <= 1.0 => Next::Continue,
            _ => Next::Heuristic,
        }
    }

    /// Plans Stage 2 from the trajectory in the workspace, in at most `iterations`.
    fn reorient(&mut self, settings: &Valid<Settings>, iterations: usize) -> StageResult {
        self.reorient_in(self.options.mode, settings, iterations)
    }

    // Not inlined, as `StageResult::after`.
    #[inline(never)]
    fn reorient_in(
        &mut self,
        mode: Mode,
        settings: &Valid<Settings>,
        iterations: usize,
    ) -> StageResult {
        let max_iterations = iterations.min(settings.max_iterations);
        let settings = Settings::with_max_iterations(settings, max_iterations);
        let (solver, executor, workspace) = (&mut self.solver, self.executor, &mut *self.workspace);
        let report = reorient(&self.formulation, mode, &settings, solver, executor, workspace);
        let log = &self.workspace.reorientation.log;
        let mut times = PhaseTimes::default();
        times.add_iterations(log);
        StageResult { report, record: StageSolveRecord::new(&report, log), times }
    }
}

/// Change of the formulation before another try.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Change {
    /// Wider margins of Stage 2.
    ReorientationMargins,
    /// Wider margins of both stages.
    BothStages,
    /// Less force, or a slower line of sight, in Stage 1, which Stage 2 could not follow.
    Gentler,
    /// No other change than the iterations that are left.
    Iterations,
    /// Stage 2 without its cost, then with it from there.
    WithoutCost,
}

/// Next step after a try of Stage 2.
enum Next {
    /// Accept the result.
    Accept,
    /// Continue from the result.
    Continue,
    /// Try again from the heuristic.
    Heuristic,
}

/// Solves Stage 2 from the trajectory in the workspace, along the translation in it.
#[inline(never)]
pub(super) fn reorient<
    S: Solver<NX, NU>,
    P: ForkJoin,
    const NL: usize,
    const NX: usize,
    const NU: usize,
>(
    formulation: &Formulation<'_, NL>,
    mode: Mode,
    settings: &Valid<Settings>,
    solver: &mut S,
    executor: &P,
    workspace: &mut ArmWorkspace<NL, NX, NU>,
) -> StageReport {
    let deadline = formulation.deadline;
    let started = deadline.seconds();
    let ArmWorkspace { target, scratch: w, translation, reorientation: z } = workspace;
    let translation = &translation.trajectory;
    let mut problem = Reorientation::<P, NODES, NL, NX, NU>::new(
        formulation,
        translation,
        target,
        mode,
        executor,
    );
    solver.reset();
    let outcome = scp::solve(&mut problem, solver, settings, &deadline, w, z);
    z.trajectory.clear_from(formulation.grid().nodes);
    let cost = problem.cost(&z.trajectory);
    StageReport { outcome, cost, time_s: deadline.seconds() - started }
}
