//! The SCP solver's memory: scratch that every solve overwrites, and the iterates that it leaves.

use super::{Log, Residuals};
use nalgebra::SVector;
use remora_qp::dense::zeros;
use remora_qp::{Qp, Solution};

/// Scratch of the SCP solver for one size of problem, owned by the caller. No result depends on what
/// an earlier solve left in it.
#[derive(Clone, Debug)]
pub struct Scratch<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// The subproblem.
    pub qp: Qp<N, NX, NU, NG>,
    /// Its solution: the last step computed.
    pub step: Solution<N, NX, NU, NG>,
    pub(super) correction: Solution<N, NX, NU, NG>,
    pub(crate) residuals: Residuals<N, NX, NG>,
    pub(crate) trial_residuals: Residuals<N, NX, NG>,
    pub(super) searched: Residuals<N, NX, NG>,
    /// The subproblem's `c` and path offsets before corrections.
    pub(super) c: [SVector<f64, NX>; N],
    pub(super) path_offset: [SVector<f64, NG>; N],
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Scratch<N, NX, NU, NG> {
    /// Storage, all bits zero.
    pub const fn new() -> Self {
        Self {
            qp: Qp::ZERO,
            step: Solution::ZERO,
            correction: Solution::ZERO,
            residuals: Residuals::ZERO,
            trial_residuals: Residuals::ZERO,
            searched: Residuals::ZERO,
            c: [zeros(); N],
            path_offset: [zeros(); N],
        }
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Default
    for Scratch<N, NX, NU, NG>
{
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Scratch<N, NX, NU, NG> {
    /// Overwrites every number with `value`.
    pub(crate) fn fill(&mut self, value: f64) {
        self.qp.fill(value);
        self.step.fill(value);
        self.correction.fill(value);
        for residuals in [&mut self.residuals, &mut self.trial_residuals, &mut self.searched] {
            residuals.cost = value;
            residuals.defect.iter_mut().for_each(|vector| vector.fill(value));
            residuals.path.iter_mut().for_each(|vector| vector.fill(value));
            residuals.ignored_defect.fill(value);
            residuals.ignored_path.fill(value);
        }
        self.c.iter_mut().for_each(|vector| vector.fill(value));
        self.path_offset.iter_mut().for_each(|vector| vector.fill(value));
    }
}

#[cfg(test)]
impl<T: Copy> Iterates<T> {
    /// Overwrites all trajectories.
    pub(crate) fn fill(&mut self, with: T) {
        (self.trajectory, self.trial, self.corrected, self.best) = (with, with, with, with);
    }
}

/// The trajectories of one problem and the log of the solve, owned by the caller.
#[derive(Clone, Debug)]
pub struct Iterates<T> {
    /// The current trajectory: the initial guess before a solve, the result after it.
    pub trajectory: T,
    pub(crate) trial: T,
    pub(super) corrected: T,
    /// The best feasible iterate, where the current one is another.
    pub(crate) best: T,
    /// Whether the trajectory is projected and the scratch memory holds its residuals: the next solve then begins
    /// with them.
    pub(crate) is_evaluated: bool,
    /// One record for each iteration.
    pub log: Log,
}

impl<T: Copy> Iterates<T> {
    /// Storage around a placeholder trajectory.
    pub const fn new(placeholder: T) -> Self {
        Self {
            trajectory: placeholder,
            trial: placeholder,
            corrected: placeholder,
            best: placeholder,
            is_evaluated: false,
            log: Log::new(),
        }
    }
}
