//! The SCP solver: a sequence of convex subproblems in a trust region.

use super::{Iterates, IterationRecord, Outcome, Problem, Residuals, Scratch, Settings, Status};
use core::mem;
use remora_qp::time::Deadline;
use remora_qp::{QpOutcome, QpSolver, QpStatus, Valid};

/// Solves `problem` from the initial guess in `iterates.trajectory` and leaves the result there.
///
/// With [`Status::Solved`] the result is the last accepted iterate; otherwise the feasible iterate of
/// least cost, or the last accepted one where none was feasible. Cost of an iteration: one
/// linearisation (none after a rejected step), one subproblem and one evaluation of the residuals; a
/// correction repeats the latter two, a trial of the line search the last.
///
/// `deadline` is checked before and after each of these, and by the QP solver; once it has passed no
/// step is tried or taken. Its clock also times the phases.
pub fn solve<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    problem: &mut P,
    solver: &mut S,
    settings: &Valid<Settings>,
    deadline: &Deadline,
    scratch: &mut Scratch<N, NX, NU, NG>,
    iterates: &mut Iterates<P::Trajectory>,
) -> Outcome
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    let mut scp = ScpSolver {
        problem,
        solver,
        settings,
        deadline,
        w: scratch,
        z: iterates,
        outcome: Outcome::default(),
        radius: settings.radius,
        penalty_parameter: settings.penalty_parameter,
        merit: 0.0,
        needs_linearisation: true,
        best: None,
        failed: 0,
        change: 0.0,
    };
    let mut ended = scp.start();
    // Bound: iterations.
    while ended.is_none() {
        ended = scp.iterate();
    }
    scp.finish(ended.unwrap_or_default())
}

/// Cost and violation of the best feasible iterate.
pub(super) struct Feasible {
    pub(super) cost: f64,
    pub(super) violation: f64,
}

/// State of a solve.
pub(super) struct ScpSolver<
    'a,
    P: Problem<N, NX, NU, NG>,
    S,
    const N: usize,
    const NX: usize,
    const NU: usize,
    const NG: usize,
> {
    pub(super) problem: &'a mut P,
    pub(super) solver: &'a mut S,
    pub(super) settings: &'a Settings,
    pub(super) deadline: &'a Deadline<'a>,
    pub(super) w: &'a mut Scratch<N, NX, NU, NG>,
    pub(super) z: &'a mut Iterates<P::Trajectory>,
    pub(super) outcome: Outcome,
    pub(super) radius: f64,
    pub(super) penalty_parameter: f64,
    /// Merit of the current trajectory with the current penalty parameter.
    pub(super) merit: f64,
    /// Whether the subproblem does not yet belong to the current trajectory.
    needs_linearisation: bool,
    /// Cost and violation of `z.best`, where that is an iterate.
    pub(super) best: Option<Feasible>,
    /// Number of consecutive subproblems without a usable solution.
    failed: u32,
    /// How far the last accepted step changed the cost.
    change: f64,
}

impl<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    ScpSolver<'_, P, S, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    /// Evaluates the initial guess; returns the status where the solve ends there.
    fn start(&mut self) -> Option<Status> {
        let (w, z) = (&mut *self.w, &mut *self.z);
        z.log.clear();
        w.step.clear_multipliers();
        if !mem::take(&mut z.is_evaluated) {
            self.problem.project(&mut z.trajectory);
            self.problem.residuals(&z.trajectory, &mut w.residuals);
        }
        self.outcome.violation = f64::INFINITY;
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.outcome.violation = self.problem.violation(&w.residuals);
        if !(w.residuals.cost + w.residuals.l1_violation()).is_finite() {
            return Some(Status::NumericalFailure);
        }
        (self.settings.stop_when_feasible && self.outcome.violation <= 1.0)
            .then_some(Status::Solved)
    }

    /// One iteration; returns the status where it was the last.
    fn iterate(&mut self) -> Option<Status> {
        if self.outcome.iterations >= self.settings.max_iterations {
            return Some(Status::IterationLimit);
        }
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.outcome.iterations += 1;
        self.show();
        let started = self.deadline.seconds();
        let mut record = IterationRecord {
            radius: self.radius,
            penalty_parameter: self.penalty_parameter,
            length: 1.0,
            ..Default::default()
        };
        self.prepare();
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        let prepared = self.deadline.seconds();
        record.linearise_time_s = prepared - started;
        let solved = self.solver.solve(&self.w.qp, &mut self.w.step, self.deadline);
        record.qp_time_s = self.deadline.seconds() - prepared;
        record.count(solved);
        record.qp_status = solved.status;
        let ended = match solved.status.is_usable() {
            true => self.step(&mut record),
            false => self.shrink_after_failure(solved),
        };
        record.time_s = self.deadline.seconds() - started;
        // The log has room for the largest number of iterations.
        let _ = self.z.log.push(record);
        ended
    }

    /// Linearises where needed and sets penalties and bounds of the subproblem.
    fn prepare(&mut self) {
        let (w, at, penalty_parameter) = (&mut *self.w, &self.z.trajectory, self.penalty_parameter);
        if self.needs_linearisation {
            let near = penalty_parameter * w.residuals.l1_violation()
                <= self.settings.curvature_below * w.residuals.cost;
            // Multipliers beyond their bounds are damaged memory; as curvature they would make the
            // subproblem unsolvable at any radius.
            let sound = near && w.step.multipliers_are_within(MAX_MULTIPLIER * penalty_parameter);
            let multipliers = sound.then_some(&w.step);
            self.problem.linearise(at, multipliers, &mut w.qp);
        }
        if w.qp.defect_penalty.is_finite() {
            w.qp.defect_penalty = penalty_parameter;
        }
        w.qp.path_penalty = penalty_parameter;
        w.qp.complementarity = match self.settings.stop_when_feasible {
            true => FEASIBLE_GAP,
            false => GAP * self.settings.absolute_cost_tolerance,
        };
        self.problem.bound(at, self.radius, &mut w.qp);
    }

    /// Shrinks the trust region after a subproblem without a usable solution; returns the status where
    /// the solve gives up.
    fn shrink_after_failure(&mut self, solved: QpOutcome) -> Option<Status> {
        if matches!(solved.status, QpStatus::TimeLimit | QpStatus::Interrupted) {
            return Some(Status::Deadline);
        }
        // A smaller trust region may be solvable; otherwise the cause becomes the status.
        self.needs_linearisation = false;
        self.failed += 1;
        self.radius *= self.settings.shrink * self.settings.shrink;
        let gives_up = self.failed >= MAX_FAILED || self.radius < self.settings.min_radius;
        gives_up.then(|| match Status::of_failed(solved.status) {
            Status::NumericalFailure if solved.status != QpStatus::NumericalFailure => {
                self.status_without_progress()
            }
            other => other,
        })
    }

    /// Tries the subproblem's step, improves it and accepts it where `rho` is at least `eta_0`.
    fn step(&mut self, record: &mut IterationRecord) -> Option<Status> {
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.failed = 0;
        let penalty_parameter = self.penalty_parameter;
        self.merit = self.w.residuals.cost + penalty_parameter * self.w.residuals.l1_violation();
        let slack = self.try_full_step(record);
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        // A correction helps where the constraints' linearisation is to blame, the line search where
        // the cost's quadratic model is.
        let excess = penalty_parameter * (self.w.trial_residuals.l1_violation() - slack);
        let missing = record.predicted_reduction - record.actual_reduction;
        if record.rho < self.settings.correct_below && !(excess < 0.5 * missing) {
            self.correct(record);
            self.outcome.corrections += record.corrections as usize;
        }
        self.search(record);
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        record.cost = self.w.trial_residuals.cost;
        record.l1_violation = self.w.trial_residuals.l1_violation();
        record.violation = self.problem.violation(&self.w.trial_residuals);
        record.accepted = record.rho >= self.settings.eta_0;
        self.needs_linearisation = record.accepted;
        let change = (self.w.residuals.cost - record.cost).abs();
        if record.accepted {
            self.accept(record);
        }
        // A rejected step counts too: at the optimum the predicted reduction is zero, or slightly
        // negative with a solver of finite accuracy.
        let done = self.settings.stop_when_feasible
            || self.has_converged(record)
            || self.leaves_little(record, change);
        if self.outcome.violation <= 1.0 && done {
            return Some(Status::Solved);
        }
        if record.accepted {
            self.change = change;
        }
        self.adapt(record, slack)
    }

    /// Makes the trial the current trajectory.
    ///
    /// An infeasible iterate may replace a feasible one where the cost falls by more than the penalty
    /// of the violation (one plan in 25 on the public scenarios). The best feasible iterate is kept,
    /// in case the solve ends before it is feasible again.
    fn accept(&mut self, record: &IterationRecord) {
        let (w, z) = (&mut *self.w, &mut *self.z);
        mem::swap(&mut z.trajectory, &mut z.trial);
        mem::swap(&mut w.residuals, &mut w.trial_residuals);
        let left = Feasible { cost: w.trial_residuals.cost, violation: self.outcome.violation };
        let improves = record.violation <= 1.0 && w.residuals.cost <= left.cost;
        let is_best = self.best.as_ref().is_none_or(|best| left.cost < best.cost);
        if left.violation <= 1.0 && !improves && is_best {
            mem::swap(&mut z.best, &mut z.trial);
            self.best = Some(left);
        }
        self.outcome.violation = record.violation;
    }

    /// Updates trust-region radius and penalty parameter; returns the status where no progress is
    /// possible.
    fn adapt(&mut self, record: &IterationRecord, slack: f64) -> Option<Status> {
        let settings = self.settings;
        let interior = record.step < 0.99 * self.radius;
        if record.rho < settings.eta_1 {
            let step = record.step.max(settings.min_radius);
            self.radius = settings.shrink * self.radius.min(step);
        } else if record.rho >= settings.eta_2 && !interior {
            self.radius = (settings.grow * self.radius).min(settings.max_radius);
        }
        if record.length < SHORT_STEP {
            // A subproblem of this size predicts better than part of a larger one's step.
            self.radius = self.radius.min(2.0 * record.step);
        }
        if self.radius < settings.min_radius {
            // The model does not predict even tiny steps.
            let trial = self.w.trial_residuals.cost + self.w.trial_residuals.l1_violation();
            let is_sound = trial.is_finite();
            return Some(if is_sound {
                self.status_without_progress()
            } else {
                Status::NumericalFailure
            });
        }
        let paid = self.penalty_parameter * slack > 1e-6 * self.merit.abs().max(1e-3);
        if record.accepted && interior && paid {
            self.penalty_parameter = (settings.penalty_growth * self.penalty_parameter)
                .min(settings.max_penalty_parameter);
        }
        None
    }

    /// Change of the cost that does not count.
    fn tolerance(&self) -> f64 {
        let relative = self.settings.cost_tolerance * self.merit.abs();
        relative.max(self.settings.absolute_cost_tolerance)
    }

    /// Whether actual and predicted reduction are below the tolerance, inside the trust region. A loss of any size
    /// is, where the subproblem predicts it and none of its trials gains: it pays for defects that are too small to
    /// count.
    fn has_converged(&self, record: &IterationRecord) -> bool {
        let small = self.tolerance();
        let is_small =
            record.actual_reduction.abs() <= small && record.predicted_full.abs() <= small;
        let is_loss =
            record.actual_reduction <= small && record.predicted_full <= 0.0 && !record.accepted;
        (is_small || is_loss) && record.step < 0.99 * record.radius
    }

    /// Whether what is left to gain is so little that no subproblem is worth asking for it. Near the optimum
    /// reductions shrink by a ratio: after `a` and `b` those to come are `b^2 / (a - b)` together. For `a` stands
    /// the change of the cost alone: reductions of violations say nothing of the cost's.
    fn leaves_little(&self, record: &IterationRecord, change: f64) -> bool {
        let small = self.tolerance();
        let last = record.actual_reduction.max(change);
        let as_predicted = (0.5..2.0).contains(&record.rho) && record.length >= 1.0;
        record.accepted
            && as_predicted
            && record.step < 0.99 * record.radius
            && last <= LAST * small
            && last * last <= LEFT * small * (self.change - last)
    }

    /// Status of a solve that makes no more progress from a finite trajectory: feasible but not
    /// converged, or infeasible.
    fn status_without_progress(&self) -> Status {
        match self.outcome.violation {
            violation if violation <= 1.0 => Status::IterationLimit,
            violation if violation > 1.0 => Status::Infeasible,
            _ => Status::NumericalFailure,
        }
    }

    /// Actual reduction of the merit from the current trajectory to one with residuals `to`.
    pub(super) fn actual_reduction(&self, to: &Residuals<N, NX, NG>) -> f64 {
        self.merit - to.cost - self.penalty_parameter * to.l1_violation()
    }

    /// Leaves the best trajectory in `iterates.trajectory`.
    fn finish(mut self, status: Status) -> Outcome {
        self.outcome.status = status;
        if status == Status::Solved {
            return self.outcome;
        }
        let Some(best) = self.best else { return self.outcome };
        if !(self.outcome.violation <= 1.0 && self.w.residuals.cost <= best.cost) {
            mem::swap(&mut self.z.trajectory, &mut self.z.best);
            self.outcome.violation = best.violation;
            self.outcome.is_earlier = true;
        }
        self.outcome
    }
}

/// Number of consecutive failed subproblems, each in a smaller trust region, that ends the solve.
const MAX_FAILED: u32 = 3;

/// Largest multiplier of a solver of finite accuracy, over the penalty parameter.
const MAX_MULTIPLIER: f64 = 2.0;

/// Complementarity of a subproblem's solution over the absolute tolerance. With some thousand pairs the
/// subproblem's duality gap is then below a thousandth of what counts; with more, loops now and then converge to
/// dearer plans or not at all.
const GAP: f64 = 2.5e-7;

/// Complementarity of a subproblem's solution where the first feasible iterate is asked for: no cost counts, and
/// violations that are left are far below their tolerances.
const FEASIBLE_GAP: f64 = 1e-4;

/// Largest reduction after which the rest is estimated, over what is small.
const LAST: f64 = 10.0;

/// Estimated rest that is left, over what is small.
const LEFT: f64 = 0.2;

/// Step length of the line search below which the trust region was too large.
const SHORT_STEP: f64 = 0.75;
