//! The loop.

use super::{IterationRecord, Log, Problem, Residuals, Settings};
use crate::qp::{Qp, QpSolver, QpStatus, Solution};
use crate::time::Deadline;
use core::mem;
use nalgebra::SVector;

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord)]
#[non_exhaustive]
#[repr(u32)]
pub enum Status {
    /// Feasible, and the cost has settled where that was asked for.
    Solved = 0,
    /// The iteration limit was reached first.
    IterationLimit = 1,
    /// The convex subproblem has no feasible point.
    Infeasible = 2,
    /// Time ran out first.
    Deadline = 3,
    /// Arithmetic or the subproblem's solver broke down.
    #[default]
    NumericalFailure = 4,
}

impl Status {
    /// Stable code for records.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// The status of a loop whose subproblem could not be solved.
    pub fn of_failed(subproblem: QpStatus) -> Self {
        match subproblem {
            QpStatus::Infeasible | QpStatus::AlmostInfeasible => Self::Infeasible,
            QpStatus::TimeLimit | QpStatus::Interrupted => Self::Deadline,
            _ => Self::NumericalFailure,
        }
    }
}

/// What a solve reports besides trajectory and log.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// Linearisations with their subproblem solved, rejected steps counted.
    pub iterations: usize,
    /// Second-order corrections beside them.
    pub corrections: usize,
    /// Worst violation of the final trajectory over its tolerance.
    pub violation: f64,
}

/// Memory of the loop for one size of problem; the caller keeps it.
#[derive(Clone, Debug)]
pub struct Workspace<T, const N: usize, const NX: usize, const NU: usize, const NR: usize> {
    /// The current trajectory: the start before a solve, the result after it.
    pub trajectory: T,
    trial: T,
    corrected: T,
    /// The subproblem.
    pub qp: Qp<N, NX, NU, NR>,
    /// Its solution: the step last computed.
    pub step: Solution<N, NX, NU, NR>,
    correction: Solution<N, NX, NU, NR>,
    residuals: Residuals<N, NX, NR>,
    trial_residuals: Residuals<N, NX, NR>,
    searched: Residuals<N, NX, NR>,
    /// The subproblem's `c` and row offsets before corrections.
    c: [SVector<f64, NX>; N],
    row_offset: [SVector<f64, NR>; N],
    /// One record an iteration.
    pub log: Log,
}

impl<T: Copy, const N: usize, const NX: usize, const NU: usize, const NR: usize>
    Workspace<T, N, NX, NU, NR>
{
    /// Storage around a placeholder trajectory.
    pub const fn new(placeholder: T) -> Self {
        Self {
            trajectory: placeholder,
            trial: placeholder,
            corrected: placeholder,
            qp: Qp::ZERO,
            step: Solution::ZERO,
            correction: Solution::ZERO,
            residuals: Residuals::ZERO,
            trial_residuals: Residuals::ZERO,
            searched: Residuals::ZERO,
            c: [crate::qp::zeros(); N],
            row_offset: [crate::qp::zeros(); N],
            log: Log::new(),
        }
    }
}

/// Solves `problem` from the trajectory in `workspace`, and leaves the result there.
///
/// `settings` must be valid. Whatever the status, the trajectory left is the best iterate: the
/// last accepted one. Cost: an iteration is one linearisation (none after a rejected step), one
/// subproblem and one evaluation of the residuals, the latter two again for each correction.
pub fn solve<P, S, const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    problem: &mut P,
    solver: &mut S,
    settings: &Settings,
    deadline: &Deadline,
    workspace: &mut Workspace<P::Trajectory, N, NX, NU, NR>,
) -> Outcome
where
    P: Problem<N, NX, NU, NR>,
    S: QpSolver<N, NX, NU, NR>,
{
    let w = workspace;
    w.log.clear();
    w.step.clear_multipliers();
    problem.clip(&mut w.trajectory);
    problem.residuals(&w.trajectory, &mut w.residuals);
    let mut outcome = Outcome { violation: problem.violation(&w.residuals), ..Default::default() };
    let mut radius = settings.radius;
    let mut weight = settings.weight;
    let mut fresh = true;

    if !(w.residuals.cost + w.residuals.penalty()).is_finite() {
        return outcome;
    }
    if settings.stop_when_feasible && outcome.violation <= 1.0 {
        outcome.status = Status::Solved;
        return outcome;
    }
    while outcome.iterations < settings.max_iterations {
        let started = deadline.seconds();
        if fresh {
            let near =
                weight * w.residuals.penalty() <= settings.curvature_below * w.residuals.cost;
            let multipliers = near.then_some(&w.step);
            problem.linearise(&w.trajectory, multipliers, &mut w.qp);
        }
        if w.qp.defect_weight.is_finite() {
            w.qp.defect_weight = weight;
        }
        w.qp.row_weight = weight;
        problem.bound(&w.trajectory, radius, &mut w.qp);

        outcome.iterations += 1;
        let before_qp = deadline.seconds();
        let solved = solver.solve(&w.qp, &mut w.step, deadline);
        let mut record = IterationRecord {
            radius,
            weight,
            qp_iterations: solved.iterations,
            qp_status: solved.status,
            qp_time_s: deadline.seconds() - before_qp,
            length: 1.0,
            ..Default::default()
        };
        if !solved.status.is_usable() {
            // A smaller box may be solvable; where even that fails the cause is the status.
            let _ = w.log.push(record);
            fresh = false;
            radius *= settings.shrink * settings.shrink;
            if radius < settings.min_radius {
                outcome.status = Status::of_failed(solved.status);
                return outcome;
            }
            continue;
        }

        let merit = w.residuals.cost + weight * w.residuals.penalty();
        let slack = linear_penalty(&w.qp, &w.step);
        record.promised = weight * w.residuals.penalty() - w.qp.cost(&w.step) - weight * slack;
        record.predicted = record.promised;
        record.step = problem.step_length(&w.step);
        problem.retract(&w.trajectory, &w.qp, &w.step, &mut w.trial);
        problem.residuals(&w.trial, &mut w.trial_residuals);
        record.actual = merit - w.trial_residuals.cost - weight * w.trial_residuals.penalty();
        record.ratio = ratio(&record, merit);

        // Corrections mend linearised constraints, the line search a cost that is not quadratic:
        // which of them is to blame decides.
        let excess = weight * (w.trial_residuals.penalty() - slack);
        let missing = record.predicted - record.actual;
        if record.ratio < settings.correct_below
            && settings.max_corrections > 0
            && !(excess < 0.5 * missing)
        {
            correct(problem, solver, settings, deadline, w, merit, weight, &mut record);
            outcome.corrections += record.corrections as usize;
        }
        search(problem, w, merit, weight, &mut record);

        record.cost = w.trial_residuals.cost;
        record.penalty = w.trial_residuals.penalty();
        record.violation = problem.violation(&w.trial_residuals);
        record.accepted = record.ratio >= settings.accept;
        fresh = record.accepted;
        if record.accepted {
            mem::swap(&mut w.trajectory, &mut w.trial);
            mem::swap(&mut w.residuals, &mut w.trial_residuals);
            outcome.violation = record.violation;
        }
        record.time_s = deadline.seconds() - started;
        let _ = w.log.push(record);

        let done = settings.stop_when_feasible || settled(&record, settings, merit);
        if record.accepted && outcome.violation <= 1.0 && done {
            outcome.status = Status::Solved;
            return outcome;
        }
        let interior = record.step < 0.99 * radius;
        if record.ratio < settings.shrink_below {
            radius = settings.shrink * radius.min(record.step.max(settings.min_radius));
        } else if record.ratio >= settings.grow_above && !interior {
            radius = (settings.grow * radius).min(settings.max_radius);
        }
        if record.length < CUT_SHORT {
            // A program of this size beats the remnant of a larger one.
            radius = radius.min(2.0 * record.step);
        }
        if radius < settings.min_radius {
            // The model can't predict even tiny steps: no progress is possible from here.
            outcome.status = Status::NumericalFailure;
            return outcome;
        }
        if record.accepted && interior && weight * slack > 1e-6 * merit.abs().max(1e-3) {
            weight = (settings.weight_growth * weight).min(settings.max_weight);
        }
    }
    outcome.status = Status::IterationLimit;
    outcome
}

/// Second-order corrections: the subproblem again, with the error of its linearisation at the
/// trial added to the right-hand sides. Keeps the best trial.
#[allow(clippy::too_many_arguments)]
fn correct<P, S, const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    problem: &mut P,
    solver: &mut S,
    settings: &Settings,
    deadline: &Deadline,
    w: &mut Workspace<P::Trajectory, N, NX, NU, NR>,
    merit: f64,
    weight: f64,
    record: &mut IterationRecord,
) where
    P: Problem<N, NX, NU, NR>,
    S: QpSolver<N, NX, NU, NR>,
{
    for k in 0..N {
        w.c[k] = w.qp.stages[k].c;
        w.row_offset[k] = w.qp.stages[k].row_offset;
    }
    let mut at_step = true;
    while record.corrections < settings.max_corrections && record.ratio < settings.correct_below {
        let step = if at_step { &w.step } else { &w.correction };
        for k in 0..N {
            if k + 1 < N {
                let linear = -w.qp.slack(step, k);
                w.qp.stages[k].c += w.trial_residuals.defect[k] - linear;
            }
            let stage = &mut w.qp.stages[k];
            let linear = stage.row_x * step.x[k] + stage.row_offset;
            stage.row_offset += w.trial_residuals.row[k] - linear;
        }
        let before = deadline.seconds();
        let solved = solver.solve_again(&w.qp, &mut w.correction, deadline);
        record.qp_time_s += deadline.seconds() - before;
        record.qp_iterations += solved.iterations;
        record.corrections += 1;
        if !solved.status.is_usable() {
            break;
        }
        problem.retract(&w.trajectory, &w.qp, &w.correction, &mut w.corrected);
        problem.residuals(&w.corrected, &mut w.searched);
        let actual = merit - w.searched.cost - weight * w.searched.penalty();
        if !(actual > record.actual) {
            break;
        }
        mem::swap(&mut w.trial, &mut w.corrected);
        mem::swap(&mut w.trial_residuals, &mut w.searched);
        at_step = false;
        record.actual = actual;
        record.step = problem.step_length(&w.correction);
        record.ratio = ratio(record, merit);
    }
    for k in 0..N {
        w.qp.stages[k].c = w.c[k];
        w.qp.stages[k].row_offset = w.row_offset[k];
    }
}

/// Line search along the step, by the non-linear model alone: one parabola through the slope and
/// the trial tells where to try again, shorter where the step delivered less than promised,
/// longer where it delivered more. Keeps the best trial.
fn search<P, const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    problem: &P,
    w: &mut Workspace<P::Trajectory, N, NX, NU, NR>,
    merit: f64,
    weight: f64,
    record: &mut IterationRecord,
) where
    P: Problem<N, NX, NU, NR>,
{
    if (WELL_PREDICTED.0..=WELL_PREDICTED.1).contains(&record.ratio) {
        return;
    }
    // Decrease along the step as the subproblem sees it: slope t - curvature t^2 / 2.
    let slope =
        weight * (w.residuals.penalty() - linear_penalty(&w.qp, &w.step)) - w.qp.slope(&w.step);
    let curvature = 2.0 * (slope - record.promised);
    let (full, mut length) = (record.step, 1.0);
    let mut fitted = record.actual;
    for _ in 0..MAX_SEARCHES {
        // Vertex of the parabola with this slope through the last trial.
        let bend = slope * length - fitted;
        let vertex =
            if bend > 0.0 { slope * length * length / (2.0 * bend) } else { f64::INFINITY };
        length = vertex.clamp(0.1 * length, 2.0 * length);
        for k in 0..N {
            w.correction.x[k] = w.step.x[k] * length;
            w.correction.u[k] = w.step.u[k] * length;
        }
        problem.retract(&w.trajectory, &w.qp, &w.correction, &mut w.corrected);
        problem.residuals(&w.corrected, &mut w.searched);
        fitted = merit - w.searched.cost - weight * w.searched.penalty();
        if fitted > record.actual {
            mem::swap(&mut w.trial, &mut w.corrected);
            mem::swap(&mut w.trial_residuals, &mut w.searched);
            record.actual = fitted;
            record.length = length;
            record.step = full * length;
            record.predicted = length * (slope - 0.5 * curvature * length);
            record.ratio = ratio(record, merit);
        }
        if !(record.actual <= 0.0) {
            return;
        }
    }
}

/// Ratios at which no line search is needed.
const WELL_PREDICTED: (f64, f64) = (0.8, 1.2);

/// A step cut below this share was solved for in too large a region.
const CUT_SHORT: f64 = 0.75;

/// Most trials of a line search; it ends at the first decrease.
const MAX_SEARCHES: usize = 3;

/// What the linearised constraints leave violated at `step`, with the subproblem's slacks.
fn linear_penalty<const N: usize, const NX: usize, const NU: usize, const NR: usize>(
    qp: &Qp<N, NX, NU, NR>,
    step: &Solution<N, NX, NU, NR>,
) -> f64 {
    let defects = if qp.defect_weight.is_finite() { qp.defect_norm(step) } else { 0.0 };
    qp.row_violation(step) + defects
}

/// Actual over predicted decrease; NaN and steps that lead nowhere count as bad, decreases lost in
/// rounding as good.
fn ratio(record: &IterationRecord, merit: f64) -> f64 {
    let noise = 1e-9 * merit.abs().max(1e-6);
    if record.predicted.abs() <= noise && record.actual.abs() <= noise {
        return 1.0;
    }
    let ratio = record.actual / record.predicted;
    if record.predicted > 0.0 && ratio.is_finite() { ratio } else { -1.0 }
}

/// Whether cost and penalty have stopped changing, and not because the radius was cut.
fn settled(record: &IterationRecord, settings: &Settings, merit: f64) -> bool {
    let small = settings.settle * merit.abs();
    record.actual.abs() <= small
        && record.promised.abs() <= small
        && record.step < 0.99 * record.radius
}
