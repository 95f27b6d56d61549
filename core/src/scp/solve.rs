//! The loop: one convex program after the other, in a trust region.

use super::{Iterates, IterationRecord, Outcome, Problem, Residuals, Scratch, Settings, Status};
use core::mem;
use remora_qp::time::Deadline;
use remora_qp::{QpOutcome, QpSolver, QpStatus, Valid};

/// Solves `problem` from the trajectory in `iterates`, and leaves the result there.
///
/// Where the status is solved the trajectory left is the last accepted
/// iterate; otherwise the feasible one of least cost, and the last accepted one where none was
/// feasible. Cost: an iteration is one linearisation (none after a rejected step), one subproblem
/// and one evaluation of the residuals, the latter two again for each correction, the last again
/// for each trial of the line search.
///
/// `deadline` is looked at before and after each of these, and by the solver; once it has passed
/// nothing more is tried or taken, so that the loop ends as soon as the problem and the solver give
/// up what they are at. It times the work too.
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
    let mut descent = Descent {
        problem,
        solver,
        settings,
        deadline,
        w: scratch,
        z: iterates,
        outcome: Outcome::default(),
        radius: settings.radius,
        weight: settings.weight,
        merit: 0.0,
        fresh: true,
        best: None,
        failed: 0,
    };
    let mut ended = descent.start();
    // Bound: iterations.
    while ended.is_none() {
        ended = descent.iterate();
    }
    descent.finish(ended.unwrap_or_default())
}

/// Cost and violation of a feasible iterate.
struct Feasible {
    cost: f64,
    violation: f64,
}

/// A solve under way.
pub(super) struct Descent<
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
    outcome: Outcome,
    radius: f64,
    pub(super) weight: f64,
    /// Merit of the current trajectory, at the current weight.
    pub(super) merit: f64,
    /// Whether the current trajectory has not been linearised at.
    fresh: bool,
    /// What is known of `z.best`, where that is an iterate.
    best: Option<Feasible>,
    /// Subproblems without a usable solution, one after the other.
    failed: u32,
}

impl<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    Descent<'_, P, S, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    /// Looks at the start; the status where there is nothing to do.
    fn start(&mut self) -> Option<Status> {
        let (w, z) = (&mut *self.w, &mut *self.z);
        z.log.clear();
        w.step.clear_multipliers();
        self.problem.clip(&mut z.trajectory);
        self.problem.residuals(&z.trajectory, &mut w.residuals);
        self.outcome.violation = f64::INFINITY;
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.outcome.violation = self.problem.violation(&w.residuals);
        if !(w.residuals.cost + w.residuals.penalty()).is_finite() {
            return Some(Status::NumericalFailure);
        }
        (self.settings.stop_when_feasible && self.outcome.violation <= 1.0)
            .then_some(Status::Solved)
    }

    /// One iteration; the status where it was the last.
    fn iterate(&mut self) -> Option<Status> {
        if self.outcome.iterations >= self.settings.max_iterations {
            return Some(Status::IterationLimit);
        }
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.outcome.iterations += 1;
        let started = self.deadline.seconds();
        let mut record = IterationRecord {
            radius: self.radius,
            weight: self.weight,
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
            false => self.retreat(solved),
        };
        record.time_s = self.deadline.seconds() - started;
        // The log holds as many as there can be iterations.
        let _ = self.z.log.push(record);
        ended
    }

    /// Fills in the subproblem.
    fn prepare(&mut self) {
        let (w, at, weight) = (&mut *self.w, &self.z.trajectory, self.weight);
        if self.fresh {
            let near =
                weight * w.residuals.penalty() <= self.settings.curvature_below * w.residuals.cost;
            // What is beyond its bounds was not computed but damaged: as curvature it would make
            // a program that no radius makes solvable.
            let sound = near && w.step.multipliers_are_within(CREDIBLE * weight);
            let multipliers = sound.then_some(&w.step);
            self.problem.linearise(at, multipliers, &mut w.qp);
        }
        if w.qp.defect_penalty.is_finite() {
            w.qp.defect_penalty = weight;
        }
        w.qp.path_penalty = weight;
        self.problem.bound(at, self.radius, &mut w.qp);
    }

    /// After a subproblem without a usable solution.
    fn retreat(&mut self, solved: QpOutcome) -> Option<Status> {
        if matches!(solved.status, QpStatus::TimeLimit | QpStatus::Interrupted) {
            return Some(Status::Deadline);
        }
        // A smaller box may be solvable; where even that fails the cause is the status.
        self.fresh = false;
        self.failed += 1;
        self.radius *= self.settings.shrink * self.settings.shrink;
        let gives_up = self.failed >= MAX_FAILED || self.radius < self.settings.min_radius;
        gives_up.then(|| match Status::of_failed(solved.status) {
            Status::NumericalFailure if solved.status != QpStatus::NumericalFailure => {
                self.at_rest()
            }
            other => other,
        })
    }

    /// Tries the subproblem's step, improves on it and takes it where it is good enough.
    fn step(&mut self, record: &mut IterationRecord) -> Option<Status> {
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        self.failed = 0;
        let weight = self.weight;
        self.merit = self.w.residuals.cost + weight * self.w.residuals.penalty();
        let slack = self.attempt(record);
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        // Corrections mend linearised constraints, the line search a cost that is not quadratic:
        // which of them is to blame decides.
        let excess = weight * (self.w.trial_residuals.penalty() - slack);
        let missing = record.predicted - record.actual;
        if record.ratio < self.settings.correct_below && !(excess < 0.5 * missing) {
            self.correct(record);
            self.outcome.corrections += record.corrections as usize;
        }
        self.search(record);
        if self.deadline.has_passed() {
            return Some(Status::Deadline);
        }
        record.cost = self.w.trial_residuals.cost;
        record.penalty = self.w.trial_residuals.penalty();
        record.violation = self.problem.violation(&self.w.trial_residuals);
        record.accepted = record.ratio >= self.settings.accept;
        self.fresh = record.accepted;
        if record.accepted {
            self.accept(record);
        }
        // A step that was not taken tells as much: the program at its optimum promises nothing, or a
        // little less than nothing, as a solver of finite accuracy does.
        let done = self.settings.stop_when_feasible || self.has_settled(record);
        if self.outcome.violation <= 1.0 && done {
            return Some(Status::Solved);
        }
        self.adapt(record, slack)
    }

    /// Makes the trial the current trajectory.
    ///
    /// A feasible iterate may be left for an infeasible one: where the cost falls by more than the
    /// weight asks for the violation (on the public scenarios that happens to one plan in 25).
    /// So the best feasible one is kept, in case the loop has to end before it is feasible again.
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

    /// Radius and weight of the next iteration; the status where there can be none.
    fn adapt(&mut self, record: &IterationRecord, slack: f64) -> Option<Status> {
        let settings = self.settings;
        let interior = record.step < 0.99 * self.radius;
        if record.ratio < settings.shrink_below {
            let step = record.step.max(settings.min_radius);
            self.radius = settings.shrink * self.radius.min(step);
        } else if record.ratio >= settings.grow_above && !interior {
            self.radius = (settings.grow * self.radius).min(settings.max_radius);
        }
        if record.length < CUT_SHORT {
            // A program of this size beats the remnant of a larger one.
            self.radius = self.radius.min(2.0 * record.step);
        }
        if self.radius < settings.min_radius {
            // The model can't predict even tiny steps: no progress is possible from here.
            let trial = self.w.trial_residuals.cost + self.w.trial_residuals.penalty();
            let is_sound = trial.is_finite();
            return Some(if is_sound { self.at_rest() } else { Status::NumericalFailure });
        }
        let paid = self.weight * slack > 1e-6 * self.merit.abs().max(1e-3);
        if record.accepted && interior && paid {
            self.weight = (settings.weight_growth * self.weight).min(settings.max_weight);
        }
        None
    }

    /// Whether cost and penalty have stopped changing, and not because the radius was cut.
    fn has_settled(&self, record: &IterationRecord) -> bool {
        let small = self.settings.settle * self.merit.abs();
        record.actual.abs() <= small
            && record.promised.abs() <= small
            && record.step < 0.99 * record.radius
    }

    /// The status of a loop that can't go on from a sound trajectory: nothing has broken down, it
    /// has come to rest where constraints are violated, or short of the least cost.
    fn at_rest(&self) -> Status {
        match self.outcome.violation {
            violation if violation <= 1.0 => Status::IterationLimit,
            violation if violation > 1.0 => Status::Infeasible,
            _ => Status::NumericalFailure,
        }
    }

    /// Decrease of the merit from the current trajectory to one with these residuals.
    pub(super) fn decrease(&self, to: &Residuals<N, NX, NG>) -> f64 {
        self.merit - to.cost - self.weight * to.penalty()
    }

    /// Leaves the best trajectory.
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

/// Subproblems that may fail one after the other, each in a smaller box.
const MAX_FAILED: u32 = 3;

/// Multipliers up to this multiple of the weight may come of a solver of finite accuracy.
const CREDIBLE: f64 = 2.0;

/// A step cut below this share was solved for in too large a region.
const CUT_SHORT: f64 = 0.75;
