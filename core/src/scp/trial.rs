//! Trial steps of one iteration: the full step, second-order corrections, the line search.

use super::solve::ScpSolver;
use super::{IterationRecord, Problem};
use core::mem;
use remora_qp::dense::{clamp, divisor};
use remora_qp::{Qp, QpSolver, Solution};

impl<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    ScpSolver<'_, P, S, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    /// Tries the full step; returns the L1 violation that remains in the linearised constraints.
    pub(super) fn try_full_step(&mut self, record: &mut IterationRecord) -> f64 {
        let (w, z) = (&mut *self.w, &mut *self.z);
        let slack = linear_violation(&w.qp, &w.step);
        record.predicted_full = self.penalty_parameter * w.residuals.l1_violation()
            - w.qp.cost(&w.step)
            - self.penalty_parameter * slack;
        record.predicted_reduction = record.predicted_full;
        record.step = self.problem.step_length(&w.step);
        self.problem.retract(&z.trajectory, &w.qp, &w.step, &mut z.trial);
        self.problem.residuals(&z.trial, &mut w.trial_residuals);
        record.actual_reduction = self.actual_reduction(&self.w.trial_residuals);
        record.rho = rho(record, self.merit);
        slack
    }

    /// Second-order corrections: solves the subproblem again with the linearisation error at the trial
    /// added to its right-hand sides. Keeps the best trial.
    pub(super) fn correct(&mut self, record: &mut IterationRecord) {
        let w = &mut *self.w;
        for ((c, offset), stage) in w.c.iter_mut().zip(&mut w.path_offset).zip(w.qp.used()) {
            (*c, *offset) = (stage.c, stage.path_offset);
        }
        // Bound: corrections.
        while record.corrections < self.settings.max_corrections
            && record.rho < self.settings.correct_below
            && !self.deadline.has_passed()
        {
            if !self.correct_once(record) {
                break;
            }
        }
        let w = &mut *self.w;
        for ((c, offset), stage) in w.c.iter().zip(&w.path_offset).zip(w.qp.used_mut()) {
            (stage.c, stage.path_offset) = (*c, *offset);
        }
    }

    /// One correction; returns whether it improved the trial.
    fn correct_once(&mut self, record: &mut IterationRecord) -> bool {
        let (w, z) = (&mut *self.w, &mut *self.z);
        let step = if record.corrections == 0 { &w.step } else { &w.correction };
        for k in 0..w.qp.nodes() {
            if k + 1 < w.qp.nodes() {
                let linear = -w.qp.slack(step, k);
                w.qp.stages[k].c += w.trial_residuals.defect[k] - linear;
            }
            let stage = &mut w.qp.stages[k];
            let linear = stage.path_jacobian * step.x[k] + stage.path_offset;
            stage.path_offset += w.trial_residuals.path[k] - linear;
        }
        let before = self.deadline.seconds();
        let solved = self.solver.solve_again(&w.qp, &mut w.correction, self.deadline);
        record.qp_time_s += self.deadline.seconds() - before;
        record.corrections += 1;
        record.count(solved);
        if !solved.status.is_usable() {
            return false;
        }
        self.problem.retract(&z.trajectory, &w.qp, &w.correction, &mut z.corrected);
        self.problem.residuals(&z.corrected, &mut w.searched);
        let actual = self.actual_reduction(&self.w.searched);
        if self.deadline.has_passed() || !(actual > record.actual_reduction) {
            return false;
        }
        self.keep(actual, record);
        record.step = self.problem.step_length(&self.w.correction);
        record.rho = rho(record, self.merit);
        true
    }

    /// Line search along the step by the non-linear model: a parabola through the slope and the last
    /// trial gives the next length, shorter where the actual reduction is below the predicted one,
    /// longer where it is above. Keeps the best trial.
    pub(super) fn search(&mut self, record: &mut IterationRecord) {
        if (WELL_PREDICTED.0..=WELL_PREDICTED.1).contains(&record.rho) {
            return;
        }
        let w = &*self.w;
        // Predicted reduction at length t: slope t - curvature t^2 / 2.
        let slope = self.penalty_parameter
            * (w.residuals.l1_violation() - linear_violation(&w.qp, &w.step))
            - w.qp.slope(&w.step);
        let curvature = 2.0 * (slope - record.predicted_full);
        // Lengths are relative to the subproblem's step, without corrections.
        let (full, mut length) = (self.problem.step_length(&w.step), 1.0);
        let mut fitted = record.actual_reduction;
        // Bound: searches.
        for _ in 0..MAX_SEARCHES {
            if self.deadline.has_passed() {
                return;
            }
            // Vertex of the parabola with this slope through the last trial.
            let bend = slope * length - fitted;
            let vertex = if bend > 0.0 {
                slope * length * length / divisor(2.0 * bend)
            } else {
                f64::INFINITY
            };
            length = clamp(vertex, 0.1 * length, 2.0 * length);
            fitted = self.try_length(length);
            if self.deadline.has_passed() {
                return;
            }
            if fitted > record.actual_reduction {
                self.keep(fitted, record);
                record.length = length;
                record.step = full * length;
                // Beyond the full step the predicted reduction falls, which is no measure of a longer
                // step with a larger actual reduction.
                let share = length.min(1.0);
                record.predicted_reduction = share * (slope - 0.5 * curvature * share);
                record.rho = rho(record, self.merit);
            }
            if !(record.actual_reduction <= 0.0) {
                return;
            }
        }
    }

    /// Tries the step scaled by `length`; returns its actual reduction.
    fn try_length(&mut self, length: f64) -> f64 {
        let (w, z) = (&mut *self.w, &mut *self.z);
        for k in 0..N {
            w.correction.x[k] = w.step.x[k] * length;
            w.correction.u[k] = w.step.u[k] * length;
        }
        self.problem.retract(&z.trajectory, &w.qp, &w.correction, &mut z.corrected);
        self.problem.residuals(&z.corrected, &mut w.searched);
        self.actual_reduction(&self.w.searched)
    }

    /// Keeps the last trial as the best one.
    fn keep(&mut self, actual: f64, record: &mut IterationRecord) {
        mem::swap(&mut self.z.trial, &mut self.z.corrected);
        mem::swap(&mut self.w.trial_residuals, &mut self.w.searched);
        record.actual_reduction = actual;
    }
}

/// Range of `rho` in which no line search is needed.
const WELL_PREDICTED: (f64, f64) = (0.8, 1.2);

/// Most trials of a line search; it ends at the first reduction.
pub const MAX_SEARCHES: usize = 3;

/// L1 violation of the linearised constraints at `step`: the subproblem's slacks.
fn linear_violation<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    step: &Solution<N, NX, NU, NG>,
) -> f64 {
    let defects = if qp.defect_penalty.is_finite() { qp.defect_norm(step) } else { 0.0 };
    qp.path_violation(step) + defects
}

/// Actual over predicted reduction: -1 where it is NaN or nothing is predicted, 1 where both are lost
/// in rounding.
fn rho(record: &IterationRecord, merit: f64) -> f64 {
    let noise = 1e-9 * merit.abs().max(1e-6);
    if record.predicted_reduction.abs() <= noise && record.actual_reduction.abs() <= noise {
        return 1.0;
    }
    let rho = record.actual_reduction / divisor(record.predicted_reduction);
    if record.predicted_reduction > 0.0 && rho.is_finite() { rho } else { -1.0 }
}
