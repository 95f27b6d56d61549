//! The embedded solver: a primal-dual interior-point method over the stage structure.

mod settings;

pub use settings::InteriorPointSettings;

use super::{Qp, QpOutcome, QpSolver, Solution};
use crate::time::Deadline;
use nalgebra::SMatrix;

/// The embedded solver with all the memory it needs.
#[derive(Clone, Debug)]
pub struct EmbeddedQp<const N: usize, const NX: usize, const NU: usize, const NR: usize> {
    /// How it works; may be changed between solves.
    pub settings: InteriorPointSettings,
    gains: [SMatrix<f64, NU, NX>; N],
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> EmbeddedQp<N, NX, NU, NR> {
    /// Storage for any number of solves.
    pub const fn new(settings: InteriorPointSettings) -> Self {
        Self { settings, gains: [super::zeros(); N] }
    }

    /// Feedback gain of node `k` in the last solve: along the optimum `du = K dx`.
    pub fn gain(&self, k: usize) -> SMatrix<f64, NU, NX> {
        self.gains[k]
    }
}

impl<const N: usize, const NX: usize, const NU: usize, const NR: usize> QpSolver<N, NX, NU, NR>
    for EmbeddedQp<N, NX, NU, NR>
{
    fn reset(&mut self) {}

    fn solve(
        &mut self,
        _qp: &Qp<N, NX, NU, NR>,
        _solution: &mut Solution<N, NX, NU, NR>,
        _deadline: &Deadline,
    ) -> QpOutcome {
        QpOutcome::default()
    }
}
