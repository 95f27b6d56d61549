//! The per-iteration log.

use remora_qp::{QpOutcome, QpStatus};

/// Most iterations the loop can be asked for: the size of its log.
pub const MAX_ITERATIONS: usize = 64;

/// One iteration: a linearisation (reused after a rejected step) with its subproblem solved.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct IterationRecord {
    /// Cost of the trial trajectory, as the loop scales it.
    pub cost: f64,
    /// L1 norm of the trial's defects and violated rows, scaled.
    pub penalty: f64,
    /// Actual decrease of the merit.
    pub actual: f64,
    /// Decrease the subproblem promised for its whole step.
    pub promised: f64,
    /// Decrease it predicts for the step taken.
    pub predicted: f64,
    /// `actual / predicted`.
    pub ratio: f64,
    /// Trust-region radius of this iteration.
    pub radius: f64,
    /// Length of the step, in the same unit.
    pub step: f64,
    /// Share of the subproblem's step that was tried last: the line search's result.
    pub length: f64,
    /// Penalty weight `w`.
    pub weight: f64,
    /// Worst violation of the trial over its tolerance.
    pub violation: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// Interior-point iterations, corrections included.
    pub qp_iterations: u32,
    /// How the subproblem ended.
    pub qp_status: QpStatus,
    /// How many programs, corrections included, ended other than solved to full accuracy.
    pub qp_unsolved: u32,
    /// Second-order corrections tried.
    pub corrections: u32,
    /// Time of the whole iteration [s].
    pub time_s: f64,
    /// Share of it spent on the linearisation and the subproblem's bounds [s].
    pub linearise_time_s: f64,
    /// Share of it spent in the subproblem solver [s].
    pub qp_time_s: f64,
}

impl IterationRecord {
    /// Counts a program among those of this iteration.
    pub(super) fn count(&mut self, solved: QpOutcome) {
        self.qp_iterations += solved.iterations;
        self.qp_unsolved += u32::from(solved.status != QpStatus::Solved);
    }
}

/// The iterations of one solve in order.
pub type Log = heapless::Vec<IterationRecord, MAX_ITERATIONS>;
