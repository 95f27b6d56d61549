//! The compliant joint between two nodes.
//!
//! With `D` the barriers' stiffness of the multipliers of the dynamics, the linearised dynamics read
//! `x+ = y - D lambda`: the node after is pushed to `y`, and yields to the force `lambda`. Its
//! cost-to-go `1/2 x+^T P x+ + slope^T x+` answers with `lambda = P x+ + slope`, and seen from the
//! node before the joint has the stiffness `P~ = (P^-1 + D)^-1`, `P` and `D^-1` in series. What is
//! pinned is infinitely stiff: there `x+ = 0` and `P~ = 1 / D`, and its row of `P` stands at zero.

use super::kernels::{NotPositiveDefinite, factor};
use super::node::Free;
use crate::dense::matrix::{axpy, multiply_vector_add, transpose};
use core::array::from_fn;

/// Compliance above which a component counts as soft: its force follows from its stretch.
const SOFT: f64 = 1.0;

/// A joint, factored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint<const NX: usize> {
    /// `P`.
    stiffness: [[f64; NX]; NX],
    /// With `P + D^-1 = L E L^T`: `L^-1` by columns, and `L^-T E^-1` by columns.
    forward: [[f64; NX]; NX],
    backward: [[f64; NX]; NX],
    /// `D`.
    compliance: [f64; NX],
    /// Where the node after may move.
    free: Free<NX>,
    /// Gradient of the cost-to-go of the node after, zero where that is pinned.
    pub slope: [f64; NX],
}

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize> Joint<NX> {
    /// Storage that holds anything.
    pub fn filled(value: f64) -> Self {
        let (matrix, vector) = ([[value; NX]; NX], [value; NX]);
        Self {
            stiffness: matrix,
            forward: matrix,
            backward: matrix,
            compliance: vector,
            free: Free::filled(value),
            slope: vector,
        }
    }
}

impl<const NX: usize> Joint<NX> {
    /// Storage.
    pub const ZERO: Self = Self {
        stiffness: [[0.0; NX]; NX],
        forward: [[0.0; NX]; NX],
        backward: [[0.0; NX]; NX],
        compliance: [0.0; NX],
        free: Free::NONE,
        slope: [0.0; NX],
    };

    /// Joins a node of cost-to-go `p` (symmetric, zero where pinned) and writes `P~`.
    ///
    /// Of the ways to write it, `P (P + D^-1)^-1 D^-1` is the one that subtracts nothing: a barrier
    /// may have made `P` much stiffer than `D^-1`, slack may have made it much softer. Its columns
    /// are as exact as their entry of `D^-1` is small; of two mirror images the better one serves
    /// for both. Cost: about `5 NX^3` flops.
    #[inline(always)]
    pub fn soften(
        &mut self,
        p: &[[f64; NX]; NX],
        compliance: [f64; NX],
        free: Free<NX>,
        out: &mut [[f64; NX]; NX],
    ) -> Result<(), NotPositiveDefinite> {
        self.stiffness = *p;
        self.compliance = compliance;
        self.free = free;
        let rigid: [f64; NX] = from_fn(|i| 1.0 / compliance[i]);
        let mut sum = *p;
        for i in 0..NX {
            sum[i][i] += rigid[i];
        }
        let factored = factor(&mut sum);
        // Rows of L^-1 P and of L^-1.
        let (mut rows, mut inverse) = ([[0.0; NX]; NX], [[0.0; NX]; NX]);
        for i in 0..NX {
            let (mut row, mut unit) = (p[i], [0.0; NX]);
            unit[i] = 1.0;
            for k in 0..i {
                let l = sum[k][i];
                axpy(&mut row, &rows[k], -l);
                axpy(&mut unit, &inverse[k], -l);
            }
            rows[i] = row;
            inverse[i] = unit;
            self.backward[i] = unit.map(|u| u * sum[i][i]);
        }
        transpose(&mut self.forward, &inverse);
        let free = free.factors();
        for j in 0..NX {
            let mut column = [0.0; NX];
            column[j] = (1.0 - free[j]) * rigid[j];
            for k in j..NX {
                let factor = self.backward[k][j] * rigid[j];
                axpy(&mut column, &rows[k], factor);
            }
            out[j] = column;
        }
        for j in 1..NX {
            for i in 0..j {
                let better = if rigid[i] < rigid[j] { out[i][j] } else { out[j][i] };
                (out[i][j], out[j][i]) = (better, better);
            }
        }
        factored
    }

    /// Where the node after comes to lie when it is pushed to `y`, and the force in the joint.
    ///
    /// Nothing in it is the small difference of large numbers, which `y - D lambda` would be where
    /// the joint is soft and `(y - x+) / D` where it is stiff. Cost: `6 NX^2` flops.
    #[inline(always)]
    pub fn yield_to(&self, y: &[f64; NX]) -> ([f64; NX], [f64; NX]) {
        let push: [f64; NX] = from_fn(|i| y[i] / self.compliance[i] - self.slope[i]);
        let (mut half, mut x) = ([0.0; NX], [0.0; NX]);
        multiply_vector_add(&mut half, &self.forward, &push);
        multiply_vector_add(&mut x, &self.backward, &half);
        let free = self.free.factors();
        let x: [f64; NX] = from_fn(|i| x[i] * free[i]);
        let mut force = self.slope;
        multiply_vector_add(&mut force, &self.stiffness, &x);
        for i in 0..NX {
            if self.compliance[i] > SOFT || free[i] == 0.0 {
                force[i] = (y[i] - x[i]) / self.compliance[i];
            }
        }
        (x, force)
    }
}
