//! Outcome of a solve.

use core::fmt;
use remora_qp::QpStatus;

/// Status of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[repr(u32)]
pub enum Status {
    /// Feasible, and converged unless the first feasible iterate was asked for.
    Solved = 0,
    /// The iteration limit was reached, or steps became too small, at a feasible iterate or before.
    IterationLimit = 1,
    /// A subproblem's hard constraints are infeasible, the solver converged to an infeasible point, the
    /// verifier found a violation, or the scenario was refused.
    Infeasible = 2,
    /// The deadline passed first.
    Deadline = 3,
    /// Arithmetic broke down.
    #[default]
    NumericalFailure = 4,
}

impl Status {
    /// All of them, best first.
    pub const ALL: [Self; 5] = [
        Self::Solved,
        Self::IterationLimit,
        Self::Infeasible,
        Self::Deadline,
        Self::NumericalFailure,
    ];

    /// Code for records; it never changes its meaning.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::IterationLimit => "iteration_limit",
            Self::Infeasible => "infeasible",
            Self::Deadline => "deadline",
            Self::NumericalFailure => "numerical_failure",
        }
    }

    /// Status of a solve whose subproblem could not be solved.
    pub fn of_failed(subproblem: QpStatus) -> Self {
        match subproblem {
            QpStatus::Infeasible | QpStatus::AlmostInfeasible => Self::Infeasible,
            QpStatus::TimeLimit | QpStatus::Interrupted => Self::Deadline,
            _ => Self::NumericalFailure,
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Outcome of a solve, besides trajectory and log.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outcome {
    /// Its status.
    pub status: Status,
    /// Iterations, one subproblem each, rejected steps included.
    pub iterations: usize,
    /// Second-order corrections.
    pub corrections: usize,
    /// Largest violation of the final trajectory over its tolerance: feasible where at most one.
    pub violation: f64,
    /// Whether the final trajectory is the best feasible iterate rather than the last.
    pub is_earlier: bool,
}
