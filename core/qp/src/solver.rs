//! What the SCP loop asks of a solver of the convex subproblem.

use super::{Qp, Solution};
use crate::Checksum;
use crate::time::Deadline;
use nalgebra::SMatrix;

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
#[repr(u32)]
pub enum QpStatus {
    /// Optimal to the requested accuracy.
    Solved = 0,
    /// Optimal to a reduced accuracy.
    ReducedAccuracy = 1,
    /// The iteration cap was reached first.
    IterationLimit = 2,
    /// The time limit was reached first.
    TimeLimit = 3,
    /// No point satisfies the constraints.
    Infeasible = 4,
    /// The same, to a reduced accuracy.
    AlmostInfeasible = 5,
    /// The objective has no lower bound.
    Unbounded = 6,
    /// The same, to a reduced accuracy.
    AlmostUnbounded = 7,
    /// Steps became too short to make progress.
    Stalled = 8,
    /// Factorisation or arithmetic broke down.
    #[default]
    NumericalFailure = 9,
    /// Stopped from outside.
    Interrupted = 10,
}

impl QpStatus {
    /// Stable code for records.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Whether the solution may be used as a step.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Solved | Self::ReducedAccuracy)
    }
}

/// What a solve reports besides the solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct QpOutcome {
    /// How it ended.
    pub status: QpStatus,
    /// Interior-point iterations it took.
    pub iterations: u32,
}

/// A solver of the stage-structured program.
///
/// The loop cannot tell which one it has. A solver may keep state between calls (factorisations,
/// workspaces) but its answers must not depend on earlier plans: [`QpSolver::reset`] marks the
/// start of each.
pub trait QpSolver<const N: usize, const NX: usize, const NU: usize, const NR: usize> {
    /// Forgets everything that could make this plan depend on the one before.
    fn reset(&mut self);

    /// Solves `qp` into `solution`, which holds the multipliers of the last subproblem on entry: a
    /// solver may start from them. Ends with [`QpStatus::TimeLimit`] once `deadline` has passed.
    /// Where the outcome's status is not usable the solution is
    /// whatever stood last, and need not be finite.
    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        solution: &mut Solution<N, NX, NU, NR>,
        deadline: &Deadline,
    ) -> QpOutcome;

    /// Solves `qp` again after only `c`, the row offsets and the gradients have changed since
    /// [`QpSolver::solve`]: a second-order correction. A solver that can reuse work does.
    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NR>,
        solution: &mut Solution<N, NX, NU, NR>,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.solve(qp, solution, deadline)
    }

    /// Feedback gain at node `k < N - 1` of the last solve, by the program's own (scaled) steps:
    /// near the optimum `u = u_k + K (x - x_k)`. `None` where the solver has none, where its last
    /// solve was not usable, and after [`QpSolver::reset`].
    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        let _ = k;
        None
    }

    /// Adds to `checksum` what tells this solver and its settings from others. Nothing by
    /// default.
    fn identify(&self, checksum: &mut Checksum) {
        let _ = checksum;
    }
}
