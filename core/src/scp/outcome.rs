//! How a solve ended.

use remora_qp::QpStatus;

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord)]
#[non_exhaustive]
#[repr(u32)]
pub enum Status {
    /// Feasible, and the cost has settled where that was asked for.
    Solved = 0,
    /// It ended first: at the iteration limit, or because steps became too small to go on.
    IterationLimit = 1,
    /// The hard constraints of a subproblem have no feasible point, or the loop came to rest where
    /// constraints are violated, or the verifier found one violated; or the scenario was refused.
    Infeasible = 2,
    /// Time ran out first.
    Deadline = 3,
    /// Arithmetic broke down.
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
    /// Worst violation of the final trajectory over its tolerance: feasible where at most one.
    pub violation: f64,
    /// Whether the trajectory left is an earlier iterate: the best feasible one, where the loop
    /// ended on another.
    pub is_earlier: bool,
}
