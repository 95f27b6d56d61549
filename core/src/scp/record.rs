//! The log of iterations.

use remora_qp::{QpOutcome, QpStatus};

/// Largest value of [`super::Settings::max_iterations`]: the size of the log.
pub const MAX_ITERATIONS: usize = 64;

/// One iteration: a linearisation (reused after a rejected step) with its subproblem solved.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct IterationRecord {
    /// Cost of the trial trajectory, scaled.
    pub cost: f64,
    /// L1 norm of the trial's defects and path violations, scaled.
    pub l1_violation: f64,
    /// Actual reduction of the merit.
    pub actual_reduction: f64,
    /// Predicted reduction of the subproblem's full step.
    pub predicted_full: f64,
    /// Predicted reduction of the step taken.
    pub predicted_reduction: f64,
    /// `actual_reduction / predicted_reduction`.
    pub rho: f64,
    /// Trust-region radius of this iteration.
    pub radius: f64,
    /// Length of the step, in units of the radius.
    pub step: f64,
    /// Step length of the line search, relative to the subproblem's step.
    pub length: f64,
    /// Penalty parameter of the L1 merit.
    pub penalty_parameter: f64,
    /// Worst violation of the trial over its tolerance.
    pub violation: f64,
    /// Whether the step was accepted.
    pub accepted: bool,
    /// Interior-point iterations, corrections included.
    pub qp_iterations: u32,
    /// Status of the subproblem.
    pub qp_status: QpStatus,
    /// Number of QPs, corrections included, not solved to full accuracy.
    pub qp_unsolved: u32,
    /// Second-order corrections tried.
    pub corrections: u32,
    /// Time of the whole iteration [s].
    pub time_s: f64,
    /// Time of the linearisation and the subproblem's bounds [s].
    pub linearise_time_s: f64,
    /// Time in the QP solver [s].
    pub qp_time_s: f64,
}

impl IterationRecord {
    /// Adds a QP solve to this iteration's counts.
    pub(super) fn count(&mut self, solved: QpOutcome) {
        self.qp_iterations += solved.iterations;
        self.qp_unsolved += u32::from(solved.status != QpStatus::Solved);
    }
}

/// The iterations of one solve in order.
pub type Log = heapless::Vec<IterationRecord, MAX_ITERATIONS>;
