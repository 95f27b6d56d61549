//! Feedback gains for a tracking controller.

use super::Solver;
use crate::executor::Sequential;
use crate::model::Mission;
use crate::stages::{NODES, Reorientation, size};
use nalgebra::{SMatrix, SVector};

/// Control [N m] by state: rows `[bus torque (bus axes); joint torques]`, columns
/// `[attitude (rad, RTN); joint angles (rad); bus rate (rad/s, RTN); joint rates (rad/s)]`.
pub type Gain<const NX: usize = { size::NX }, const NU: usize = { size::NU }> =
    SMatrix<f64, NU, NX>;

/// Feedback gain of interval `k < NODES - 1` in the last subproblem of the plan that `solver` made
/// last. `None` at the last node, from a solver that has none, and where that subproblem was not
/// solved; trust it where Stage 2's status is solved, so that the subproblem was the plan's own.
///
/// A tracking controller applies `u = u_k + K_k (x - x_k)` at node `k`, where `x - x_k` is the
/// measured state less the planned one in the tangent space of the plan: the attitude part is the
/// turn from planned to measured attitude, `quaternion::difference(measured, planned)` (twice the
/// vector part of `q q_k^-1`, RTN axes), the others are differences. The gains know the
/// dynamics, the cost and, as soft barriers, the limits that the plan comes close to; what they ask
/// for must still be projected onto the torque limits. Costs nothing in memory: the solver keeps them.
pub fn feedback_gain<
    S: Solver<NX, NU> + ?Sized,
    const NL: usize,
    const NX: usize,
    const NU: usize,
>(
    mission: &Mission<NL>,
    solver: &S,
    k: usize,
) -> Option<Gain<NX, NU>> {
    Scales::of(mission).gain(solver, k)
}

/// Scales of states and controls in Stage 2's subproblems: all that gains need of a mission.
pub(crate) struct Scales<const NX: usize, const NU: usize> {
    x: SVector<f64, NX>,
    u: SVector<f64, NU>,
}

impl<const NX: usize, const NU: usize> Scales<NX, NU> {
    /// Those of a mission.
    pub fn of<const NL: usize>(mission: &Mission<NL>) -> Self {
        let (x, u) = Reorientation::<Sequential, NODES, NL, NX, NU>::scales(mission);
        Self { x, u }
    }

    /// As [`feedback_gain`].
    pub fn gain<S: Solver<NX, NU> + ?Sized>(&self, solver: &S, k: usize) -> Option<Gain<NX, NU>> {
        if k + 1 >= NODES {
            return None;
        }
        let scaled = solver.gain(k)?;
        Some(SMatrix::from_fn(|i, j| scaled[(i, j)] * self.u[i] / self.x[j]))
    }
}
