//! The loop's memory.

use super::{Log, Residuals};
use crate::qp::{Qp, Solution, zeros};
use nalgebra::SVector;

/// Memory of the loop for one size of problem; the caller keeps it.
#[derive(Clone, Debug)]
pub struct Workspace<T, const N: usize, const NX: usize, const NU: usize, const NR: usize> {
    /// The current trajectory: the start before a solve, the result after it.
    pub trajectory: T,
    pub(super) trial: T,
    pub(super) corrected: T,
    /// The best feasible iterate, while the loop is elsewhere.
    pub(super) best: T,
    /// The subproblem.
    pub qp: Qp<N, NX, NU, NR>,
    /// Its solution: the step last computed.
    pub step: Solution<N, NX, NU, NR>,
    pub(super) correction: Solution<N, NX, NU, NR>,
    pub(super) residuals: Residuals<N, NX, NR>,
    pub(super) trial_residuals: Residuals<N, NX, NR>,
    pub(super) searched: Residuals<N, NX, NR>,
    /// The subproblem's `c` and row offsets before corrections.
    pub(super) c: [SVector<f64, NX>; N],
    pub(super) row_offset: [SVector<f64, NR>; N],
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
            best: placeholder,
            qp: Qp::ZERO,
            step: Solution::ZERO,
            correction: Solution::ZERO,
            residuals: Residuals::ZERO,
            trial_residuals: Residuals::ZERO,
            searched: Residuals::ZERO,
            c: [zeros(); N],
            row_offset: [zeros(); N],
            log: Log::new(),
        }
    }
}
