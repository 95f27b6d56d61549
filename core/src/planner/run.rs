//! One plan under way: the stages, the verifier, and what is done about what it finds.

use super::tighten::{gentler, held, tightened};
use super::{
    Evidence, GuessRecord, InitialGuess, MAX_HELD, MAX_TIGHTENINGS, PhaseTimes, PlanSettings,
    Report, Solver, StageEvidence, StageReport, Workspace, guess, output_checksum, status_of,
};
use crate::model::Scenario;
use crate::pair::Pair;
use crate::scp::{self, Outcome, Settings, Status};
use crate::stages::{
    Formulation, LINKS, MissionReorientation, Mode, NODES, Translation, Verification, verify,
    verify_first,
};
use remora_qp::Valid;
use remora_qp::time::Deadline;

/// Time kept back for the verifier, over what its first interval took for each of them.
const RESERVE: f64 = 1.5;

/// Share of the iterations that a start other than the heuristic may take before it is judged.
const TRIAL_SHARE: f64 = 0.6;

/// A plan under way.
pub(super) struct Run<'a, 'w, S, P> {
    /// What is solved; its deadline leaves the verifier its time.
    pub formulation: Formulation<'a, LINKS>,
    /// That of the whole plan.
    pub deadline: Deadline<'a>,
    pub scenario: &'a Scenario,
    pub options: &'a PlanSettings,
    pub solver: &'w mut S,
    pub pair: &'a P,
    pub workspace: &'w mut Workspace,
}

/// What became of a stage.
pub(super) struct Stage {
    pub report: StageReport,
    evidence: StageEvidence,
    /// Times of its start and its iterations.
    times: PhaseTimes,
}

impl Stage {
    /// Adds the work of a try before this one.
    fn after(mut self, first: &Self) -> Self {
        self.report = self.report.after(&first.report);
        self.evidence = self.evidence.after(&first.evidence);
        self.times.add(&first.times);
        self
    }

    /// Iterations that are left of the stage's budget, all tries together.
    fn left(&self, settings: &Settings) -> usize {
        settings.max_iterations.saturating_sub(self.report.outcome.iterations)
    }
}

impl<S: Solver, P: Pair> Run<'_, '_, S, P> {
    /// All of it.
    pub fn plan(&mut self, start: &InitialGuess<'_>, record: Evidence) -> Report {
        let mut times = PhaseTimes::default();
        let from = self.deadline.seconds();
        self.propagate_target();
        times.start_s = self.deadline.seconds() - from;
        let mut one = self.translate_held();
        self.keep_time_back();
        let (mut two, begun) = self.reorient_from(start);
        let mut found = self.verify(&mut times);
        // Bound: tightenings.
        for _ in 0..MAX_TIGHTENINGS {
            let before = self.formulation;
            let Some(change) = self.change(&found, [&one, &two]) else { break };
            if change != Change::Margins {
                let was = one.report.outcome.iterations;
                let left = one.left(&self.options.translation).saturating_sub(was);
                if left == 0 {
                    break;
                }
                one = self.translate(left).after(&one);
                if one.report.outcome.status != Status::Solved {
                    // The path that Stage 2 knows, once more.
                    self.formulation = before;
                    one = self.translate(was).after(&one);
                    break;
                }
            }
            let left = two.left(&self.options.reorientation);
            let settings = match change {
                Change::Gentler => {
                    guess::write_heuristic(self.formulation.mission, self.workspace);
                    &self.options.reorientation
                }
                _ => &self.options.learned,
            };
            two = self.reorient(settings, left).after(&two);
            found = self.verify(&mut times);
        }
        times.translation_s = one.report.time_s;
        times.add(&two.times);
        self.report([one, two], begun, found, times, record)
    }

    fn report(
        &self,
        [one, two]: [Stage; 2],
        start: GuessRecord,
        found: Verification,
        times: PhaseTimes,
        record: Evidence,
    ) -> Report {
        let Verification { residuals, clearances } = found;
        let is_verified = residuals.are_within(&self.formulation.mission.tolerances);
        let stages = one.report.outcome.status.max(two.report.outcome.status);
        let status = status_of(stages, &found, is_verified, &self.deadline);
        let output = output_checksum(self.workspace.path(), self.workspace.motion());
        let evidence = Evidence {
            output,
            status,
            is_verified,
            start,
            translation: one.evidence,
            reorientation: two.evidence,
            ..record
        };
        let (translation, reorientation) = (one.report, two.report);
        let refusal = None;
        Report {
            status,
            refusal,
            translation,
            reorientation,
            residuals,
            clearances,
            times,
            evidence,
        }
    }

    /// The target's motion at the nodes.
    pub fn propagate_target(&mut self) {
        let mission = self.formulation.mission;
        mission.target.tumble(
            self.formulation.integrator,
            mission.mean_motion(),
            &self.scenario.target_attitude,
            &self.scenario.target_rate,
            self.formulation.interval(NODES),
            &mut self.workspace.target,
        );
    }

    /// Sees how long the verifier takes, at the heuristic start, and ends planning by so much
    /// earlier.
    #[inline(never)]
    fn keep_time_back(&mut self) {
        if !self.deadline.is_finite() {
            return;
        }
        let Formulation { mission, integrator, .. } = self.formulation;
        guess::write_heuristic(mission, self.workspace);
        let from = self.deadline.seconds();
        let (path, motion) = (self.workspace.path(), self.workspace.motion());
        let _ = verify_first(mission, self.scenario, integrator, path, motion);
        let each = self.deadline.seconds() - from;
        self.formulation.deadline = self.deadline.earlier_by(RESERVE * NODES as f64 * each);
    }

    fn verify(&self, times: &mut PhaseTimes) -> Verification {
        let from = self.deadline.seconds();
        let Formulation { mission, integrator, .. } = self.formulation;
        let (path, motion) = (self.workspace.path(), self.workspace.motion());
        let found = verify(mission, self.scenario, integrator, path, motion, &self.deadline);
        times.verify_s += self.deadline.seconds() - from;
        found
    }

    /// What to change before planning again, which is then in force; none where no change would
    /// help.
    fn change(&mut self, found: &Verification, [one, two]: [&Stage; 2]) -> Option<Change> {
        let left = two.left(&self.options.reorientation);
        let [one, two] = [one, two].map(|stage| stage.report.outcome.status);
        if one != Status::Solved || left == 0 || self.formulation.deadline.has_passed() {
            return None;
        }
        let limits = &self.formulation.mission.tolerances;
        match two {
            Status::Solved => {
                self.formulation = tightened(&self.formulation, &found.residuals)?;
                let path = found.residuals.keep_out > limits.keep_out;
                Some(if path { Change::Path } else { Change::Margins })
            }
            Status::Infeasible if found.residuals.dynamics2 > limits.dynamics => {
                let Formulation { mission, integrator, .. } = self.formulation;
                let needs = mission.needs::<NODES>(self.scenario, integrator).ok()?;
                self.formulation = gentler(&self.formulation, self.workspace.path(), needs.force)?;
                Some(Change::Gentler)
            }
            _ => None,
        }
    }

    /// Stage 1, and again with less force where its moment is more than the wheels have: as little
    /// as leads to the port clear of the target.
    pub fn translate_held(&mut self) -> Stage {
        let free = self.formulation;
        let mut stage = self.translate(self.options.translation.max_iterations);
        let again = stage.report.outcome.iterations;
        let path = self.workspace.path();
        if stage.report.outcome.status != Status::Solved {
            return stage;
        }
        let Ok(needs) = free.mission.needs::<NODES>(self.scenario, free.integrator) else {
            return stage;
        };
        let Some([mut max_force, largest]) = held(&free, path, needs.force) else { return stage };
        // Bound: trials of less force.
        for _ in 0..MAX_HELD {
            let left = stage.left(&self.options.translation).saturating_sub(again);
            if left == 0 {
                break;
            }
            self.formulation = Formulation { max_force, ..free };
            stage = self.translate(left).after(&stage);
            if stage.report.outcome.status == Status::Solved {
                return stage;
            }
            // Half way to what was enough.
            max_force = libm::sqrt(max_force * largest);
        }
        self.formulation = free;
        self.translate(again).after(&stage)
    }

    /// Stage 1 from its own start.
    // The stages and the verifier share the stack, one after the other.
    #[inline(never)]
    fn translate(&mut self, iterations: usize) -> Stage {
        let deadline = self.formulation.deadline;
        let started = deadline.seconds();
        let Workspace { target, scratch: w, translation: z, .. } = &mut *self.workspace;
        let mut problem = Translation::new(&self.formulation, self.scenario, target);
        let solver = &mut *self.solver;
        solver.reset();
        let start =
            problem.warm_start(solver, &deadline, &mut w.qp, &mut w.step, &mut z.trajectory);
        // The start is a subproblem too.
        let max_iterations = iterations.saturating_sub(1).max(1);
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
        outcome.iterations += 1;
        let cost = problem.cost(&z.trajectory.force);
        let report = StageReport { outcome, cost, time_s: deadline.seconds() - started };
        let mut evidence = StageEvidence::new(&report, &z.log);
        evidence.count(start);
        Stage { report, evidence, times: PhaseTimes::default() }
    }

    /// Stage 2 along the path in the workspace: its start, its loop, and the loop again from the
    /// heuristic where a learned start, or one handed in, led nowhere.
    pub fn reorient_from(&mut self, start: &InitialGuess<'_>) -> (Stage, GuessRecord) {
        let (clock, options) = (self.deadline, self.options);
        let from = clock.seconds();
        let mut begun = start.write(&self.formulation, options, self.pair, self.workspace);
        let mut times = PhaseTimes { start_s: clock.seconds() - from, ..Default::default() };
        if !matches!(start, InitialGuess::Heuristic) {
            times.inference_s = times.start_s;
        }
        let budget = options.reorientation.max_iterations;
        let mut stage = if begun.is_offered() {
            let trial = (TRIAL_SHARE * budget as f64) as usize;
            let first = self.reorient(&options.learned, trial.max(1));
            let left = first.left(&options.reorientation);
            match self.what_next(&first, left) {
                Next::Stay => first,
                Next::GoOn => self.reorient(&options.learned, left).after(&first),
                Next::Heuristic => {
                    begun = GuessRecord::Unsolved;
                    guess::write_heuristic(self.formulation.mission, self.workspace);
                    self.reorient(&options.reorientation, left).after(&first)
                }
            }
        } else {
            self.reorient(&options.reorientation, budget)
        };
        stage.times.add(&times);
        stage.report.time_s = clock.seconds() - from;
        (stage, begun)
    }

    /// What to do after Stage 2 ended so from a start other than the heuristic. A feasible plan in
    /// the hand is not given away.
    fn what_next(&self, first: &Stage, left: usize) -> Next {
        let outcome = &first.report.outcome;
        match outcome.status {
            Status::Solved | Status::Deadline => Next::Stay,
            _ if left == 0 => Next::Stay,
            Status::IterationLimit if outcome.violation <= 1.0 => Next::GoOn,
            _ => Next::Heuristic,
        }
    }

    /// Stage 2 from the trajectory in the workspace, in at most so many iterations.
    fn reorient(&mut self, settings: &Valid<Settings>, iterations: usize) -> Stage {
        let max_iterations = iterations.min(settings.max_iterations);
        let settings = Settings::with_max_iterations(settings, max_iterations);
        let mode: Mode = self.options.mode;
        let (solver, pair, workspace) = (&mut *self.solver, self.pair, &mut *self.workspace);
        let report = reorient(&self.formulation, mode, &settings, solver, pair, workspace);
        let log = &self.workspace.reorientation.log;
        let mut times = PhaseTimes::default();
        times.add_iterations(log);
        Stage { report, evidence: StageEvidence::new(&report, log), times }
    }
}

/// What is changed about the problem before it is planned again.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Change {
    /// Margins of Stage 2.
    Margins,
    /// Margins of both stages.
    Path,
    /// The force of Stage 1, that Stage 2 could not follow.
    Gentler,
}

/// What to do after a try of Stage 2.
enum Next {
    /// What came out stands.
    Stay,
    /// On from where it ended.
    GoOn,
    /// Again from the heuristic.
    Heuristic,
}

/// Stage 2 from the trajectory in the workspace, along the path in the workspace.
#[inline(never)]
pub(super) fn reorient<S: Solver, P: Pair>(
    formulation: &Formulation<'_, LINKS>,
    mode: Mode,
    settings: &Valid<Settings>,
    solver: &mut S,
    pair: &P,
    workspace: &mut Workspace,
) -> StageReport {
    let deadline = formulation.deadline;
    let started = deadline.seconds();
    let Workspace { target, scratch: w, translation, reorientation: z } = workspace;
    let path = &translation.trajectory;
    let mut problem = MissionReorientation::<P>::new(formulation, path, target, mode, pair);
    solver.reset();
    let outcome = scp::solve(&mut problem, solver, settings, &deadline, w, z);
    let cost = problem.cost(&z.trajectory.controls);
    StageReport { outcome, cost, time_s: deadline.seconds() - started }
}
