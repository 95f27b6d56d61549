//! Trials of one iteration: the subproblem's step, second-order corrections, the line search.

use super::solve::Descent;
use super::{IterationRecord, Problem};
use core::mem;
use remora_qp::dense::clamp;
use remora_qp::{Qp, QpSolver, Solution};

impl<P, S, const N: usize, const NX: usize, const NU: usize, const NG: usize>
    Descent<'_, P, S, N, NX, NU, NG>
where
    P: Problem<N, NX, NU, NG>,
    S: QpSolver<N, NX, NU, NG>,
{
    /// The whole step as the first trial; returns what it leaves of the linearised penalty.
    pub(super) fn attempt(&mut self, record: &mut IterationRecord) -> f64 {
        let (w, z) = (&mut *self.w, &mut *self.z);
        let slack = linear_penalty(&w.qp, &w.step);
        record.promised =
            self.weight * w.residuals.penalty() - w.qp.cost(&w.step) - self.weight * slack;
        record.predicted = record.promised;
        record.step = self.problem.step_length(&w.step);
        self.problem.retract(&z.trajectory, &w.qp, &w.step, &mut z.trial);
        self.problem.residuals(&z.trial, &mut w.trial_residuals);
        record.actual = self.decrease(&self.w.trial_residuals);
        record.ratio = ratio(record, self.merit);
        slack
    }

    /// Second-order corrections: the subproblem again, with the error of its linearisation at the
    /// trial added to the right-hand sides. Keeps the best trial.
    pub(super) fn correct(&mut self, record: &mut IterationRecord) {
        let w = &mut *self.w;
        for k in 0..N {
            w.c[k] = w.qp.stages[k].c;
            w.path_offset[k] = w.qp.stages[k].path_offset;
        }
        // Bound: corrections.
        while record.corrections < self.settings.max_corrections
            && record.ratio < self.settings.correct_below
            && !self.deadline.has_passed()
        {
            if !self.correct_once(record) {
                break;
            }
        }
        let w = &mut *self.w;
        for k in 0..N {
            w.qp.stages[k].c = w.c[k];
            w.qp.stages[k].path_offset = w.path_offset[k];
        }
    }

    /// One correction; whether it was an improvement.
    fn correct_once(&mut self, record: &mut IterationRecord) -> bool {
        let (w, z) = (&mut *self.w, &mut *self.z);
        let step = if record.corrections == 0 { &w.step } else { &w.correction };
        for k in 0..N {
            if k + 1 < N {
                let linear = -w.qp.slack(step, k);
                w.qp.stages[k].c += w.trial_residuals.defect[k] - linear;
            }
            let stage = &mut w.qp.stages[k];
            let linear = stage.path_jacobian * step.x[k] + stage.path_offset;
            stage.path_offset += w.trial_residuals.row[k] - linear;
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
        let actual = self.decrease(&self.w.searched);
        if self.deadline.has_passed() || !(actual > record.actual) {
            return false;
        }
        self.keep(actual, record);
        record.step = self.problem.step_length(&self.w.correction);
        record.ratio = ratio(record, self.merit);
        true
    }

    /// Line search along the step, by the non-linear model alone: one parabola through the slope
    /// and the trial tells where to try again, shorter where the step delivered less than
    /// promised, longer where it delivered more. Keeps the best trial.
    pub(super) fn search(&mut self, record: &mut IterationRecord) {
        if (WELL_PREDICTED.0..=WELL_PREDICTED.1).contains(&record.ratio) {
            return;
        }
        let w = &*self.w;
        // Decrease along the step as the subproblem sees it: slope t - curvature t^2 / 2.
        let slope = self.weight * (w.residuals.penalty() - linear_penalty(&w.qp, &w.step))
            - w.qp.slope(&w.step);
        let curvature = 2.0 * (slope - record.promised);
        // Lengths are shares of the subproblem's step, whatever a correction made of it.
        let (full, mut length) = (self.problem.step_length(&w.step), 1.0);
        let mut fitted = record.actual;
        // Bound: searches.
        for _ in 0..MAX_SEARCHES {
            if self.deadline.has_passed() {
                return;
            }
            // Vertex of the parabola with this slope through the last trial.
            let bend = slope * length - fitted;
            let vertex =
                if bend > 0.0 { slope * length * length / (2.0 * bend) } else { f64::INFINITY };
            length = clamp(vertex, 0.1 * length, 2.0 * length);
            fitted = self.try_length(length);
            if self.deadline.has_passed() {
                return;
            }
            if fitted > record.actual {
                self.keep(fitted, record);
                record.length = length;
                record.step = full * length;
                // Beyond its minimum the subproblem promises less again, which is no measure of a
                // longer step that delivers more.
                let share = length.min(1.0);
                record.predicted = share * (slope - 0.5 * curvature * share);
                record.ratio = ratio(record, self.merit);
            }
            if !(record.actual <= 0.0) {
                return;
            }
        }
    }

    /// Tries a share of the step; returns the decrease.
    fn try_length(&mut self, length: f64) -> f64 {
        let (w, z) = (&mut *self.w, &mut *self.z);
        for k in 0..N {
            w.correction.x[k] = w.step.x[k] * length;
            w.correction.u[k] = w.step.u[k] * length;
        }
        self.problem.retract(&z.trajectory, &w.qp, &w.correction, &mut z.corrected);
        self.problem.residuals(&z.corrected, &mut w.searched);
        self.decrease(&self.w.searched)
    }

    /// Keeps the last trial as the best one.
    fn keep(&mut self, actual: f64, record: &mut IterationRecord) {
        mem::swap(&mut self.z.trial, &mut self.z.corrected);
        mem::swap(&mut self.w.trial_residuals, &mut self.w.searched);
        record.actual = actual;
    }
}

/// Ratios at which no line search is needed.
const WELL_PREDICTED: (f64, f64) = (0.8, 1.2);

/// Most trials of a line search; it ends at the first decrease.
pub const MAX_SEARCHES: usize = 3;

/// What the linearised constraints leave violated at `step`, with the subproblem's slacks.
fn linear_penalty<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    step: &Solution<N, NX, NU, NG>,
) -> f64 {
    let defects = if qp.defect_penalty.is_finite() { qp.defect_norm(step) } else { 0.0 };
    qp.path_violation(step) + defects
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
