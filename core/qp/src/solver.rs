//! The trait of a solver of stage-structured QPs.

use super::{Qp, Solution};
use crate::Checksum;
use crate::kept::Kept;
use crate::time::Deadline;
use nalgebra::SMatrix;

/// Status of a QP solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
#[repr(u32)]
pub enum QpStatus {
    /// Optimal to the requested accuracy.
    Solved = 0,
    /// Optimal to reduced accuracy.
    ReducedAccuracy = 1,
    /// The iteration limit was reached first.
    IterationLimit = 2,
    /// The time limit was reached first.
    TimeLimit = 3,
    /// No point satisfies the constraints.
    Infeasible = 4,
    /// Infeasible to reduced accuracy.
    AlmostInfeasible = 5,
    /// The objective has no lower bound.
    Unbounded = 6,
    /// Unbounded to reduced accuracy.
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
    /// Code for records; it never changes its meaning.
    pub fn code(self) -> u32 {
        self as u32
    }

    /// Whether no other start of the solver would tell more.
    pub(crate) fn is_final(self) -> bool {
        matches!(self, Self::Solved | Self::TimeLimit | Self::Infeasible)
    }

    /// Whether the solution may be used as a step.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Solved | Self::ReducedAccuracy)
    }
}

/// Outcome of a solve, besides the solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct QpOutcome {
    /// Its status.
    pub status: QpStatus,
    /// Interior-point iterations it took.
    pub iterations: u32,
}

/// A solver of stage-structured QPs.
///
/// A solver may keep state between calls (factorisations), but its solutions must not
/// depend on anything before the last [`QpSolver::reset`].
pub trait QpSolver<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// Discards all state that later solutions could depend on.
    fn reset(&mut self);

    /// Solves `qp` into `solution`, whatever that holds on entry. Ends with [`QpStatus::TimeLimit`] once `deadline` has
    /// passed. Where the status is not usable, `solution` is the last iterate and need not be finite.
    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome;

    /// Solves `qp` again for a second-order correction: only `c`, the path offsets and the gradients
    /// have changed since [`QpSolver::solve`], so that a solver can reuse its work.
    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        self.solve(qp, solution, deadline)
    }

    /// Riccati feedback gain `K` at stage `k < N - 1` of the last solve, in the QP's own (scaled)
    /// variables: near the optimum `u = u_k + K (x - x_k)`. `None` where the solver has none, where its last
    /// solve was not usable, and after [`QpSolver::reset`].
    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        let _ = k;
        None
    }

    /// Adds the solver's name and settings to `checksum`; the default adds nothing.
    fn identify(&self, checksum: &mut Checksum) {
        let _ = checksum;
    }

    /// Shows what a loop keeps, before each of its iterations. For fault injection; the default, and so
    /// what flies, does nothing.
    #[inline]
    fn show(&mut self, kept: &mut dyn Kept) {
        let _ = kept;
    }
}

/// A borrowed solver, of a type known only at run time where the caller wants it so.
impl<S, const N: usize, const NX: usize, const NU: usize, const NG: usize> QpSolver<N, NX, NU, NG>
    for &mut S
where
    S: QpSolver<N, NX, NU, NG> + ?Sized,
{
    #[inline]
    fn reset(&mut self) {
        (**self).reset();
    }

    #[inline]
    fn solve(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        (**self).solve(qp, solution, deadline)
    }

    #[inline]
    fn solve_again(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        solution: &mut Solution<N, NX, NU, NG>,
        deadline: &Deadline,
    ) -> QpOutcome {
        (**self).solve_again(qp, solution, deadline)
    }

    #[inline]
    fn gain(&self, k: usize) -> Option<SMatrix<f64, NU, NX>> {
        (**self).gain(k)
    }

    #[inline]
    fn identify(&self, checksum: &mut Checksum) {
        (**self).identify(checksum);
    }

    #[inline]
    fn show(&mut self, kept: &mut dyn Kept) {
        (**self).show(kept);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kept::Part;

    #[test]
    fn three_statuses_need_no_other_start() {
        use QpStatus::*;
        for status in [Solved, TimeLimit, Infeasible] {
            assert!(status.is_final(), "{status:?}");
        }
        for status in [ReducedAccuracy, IterationLimit, Stalled, NumericalFailure, Unbounded] {
            assert!(!status.is_final(), "{status:?}");
        }
    }

    struct Showing(u32);

    impl QpSolver<1, 1, 1, 1> for Showing {
        fn reset(&mut self) {}

        fn solve(
            &mut self,
            _: &Qp<1, 1, 1, 1>,
            _: &mut Solution<1, 1, 1, 1>,
            _: &Deadline,
        ) -> QpOutcome {
            QpOutcome::default()
        }

        fn show(&mut self, kept: &mut dyn Kept) {
            self.0 += 1;
            kept.number(Part::Best, 0, 0).into_iter().for_each(|number| *number = 1.0);
        }
    }

    struct Memory([f64; 1]);

    impl Kept for Memory {
        fn number(&mut self, _: Part, _: usize, element: usize) -> Option<&mut f64> {
            crate::kept::nth([&mut self.0[..]], element)
        }
    }

    #[test]
    fn a_borrowed_solver_shows_what_is_kept() {
        fn show<S: QpSolver<1, 1, 1, 1>>(mut solver: S, kept: &mut Memory) {
            solver.show(kept);
        }
        let (mut solver, mut memory) = (Showing(0), Memory([0.0]));
        show(&mut solver, &mut memory);
        assert_eq!((solver.0, memory.0), (1, [1.0]));
    }
}
