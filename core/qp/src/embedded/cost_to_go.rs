//! The cost-to-go of the next stage, seen through dual-regularised dynamics.
//!
//! With `D` the barrier scaling `Z/S` of the dynamics' multipliers plus the dual (proximal)
//! regularisation, the dynamics of the Newton system read `x+ = y - D lambda`. With the cost-to-go
//! `1/2 x+^T P x+ + p^T x+` of the next stage, `lambda = P x+ + p`. Eliminating `x+` leaves the
//! Schur complement `P~ = (P^-1 + D)^-1` as the Hessian of the cost-to-go by `y`. A fixed component
//! has `x+ = 0`, `P~ = 1 / D` and a zero row of `P`. Rigid dynamics have `D = 0` for all others:
//! `P~ = P`, and nothing has to be factored.

use super::kernels::{NotPositiveDefinite, factor};
use super::variables::Free;
use crate::dense::matrix::{axpy, multiply_vector_add, transpose};
use core::array::from_fn;

/// Entry of `D` above which `lambda` is computed as `(y - x+) / D` rather than as `P x+ + p`.
const LARGE_REGULARISATION: f64 = 1.0;

/// Dual-regularised cost-to-go of a stage, factored.
#[derive(Clone, Copy, Debug)]
pub(super) struct CostToGo<const NX: usize> {
    /// `P`.
    hessian: [[f64; NX]; NX],
    /// With `P + D^-1 = L E L^T`: `L^-1` by columns, and `L^-T E^-1` by columns.
    forward: [[f64; NX]; NX],
    backward: [[f64; NX]; NX],
    /// `D`; of rigid dynamics that of fixed components alone has a meaning.
    regularisation: [f64; NX],
    is_rigid: bool,
    /// Which components of the next stage's state are not fixed.
    free: Free<NX>,
    /// `p`, zero where the component is fixed.
    pub gradient: [f64; NX],
}

#[cfg(any(test, feature = "testing"))]
impl<const NX: usize> CostToGo<NX> {
    /// Storage in which every number is `value`.
    pub fn filled(value: f64) -> Self {
        let (matrix, vector) = ([[value; NX]; NX], [value; NX]);
        Self {
            hessian: matrix,
            forward: matrix,
            backward: matrix,
            regularisation: vector,
            is_rigid: value > 0.0,
            free: Free::filled(value),
            gradient: vector,
        }
    }
}

impl<const NX: usize> CostToGo<NX> {
    /// Storage, to be filled.
    pub const ZERO: Self = Self {
        hessian: [[0.0; NX]; NX],
        forward: [[0.0; NX]; NX],
        backward: [[0.0; NX]; NX],
        regularisation: [0.0; NX],
        is_rigid: false,
        free: Free::NONE,
        gradient: [0.0; NX],
    };

    /// Factors the next stage's cost-to-go `p` (symmetric, zero where fixed) with `D` =
    /// `regularisation` and writes the Schur complement `P~` in its place.
    ///
    /// `P~ = P (P + D^-1)^-1 D^-1` has no subtraction and so no cancellation: active bounds make `P`
    /// much larger than `D^-1`, slack in use makes it much smaller. The error of a column grows with
    /// its entry of `D^-1`, so the column with the smaller entry is mirrored. Cost: about `5 NX^3`
    /// flops.
    ///
    /// # Errors
    /// `P + D^-1` is not positive definite.
    #[inline(always)]
    pub fn schur_complement(
        &mut self,
        p: &mut [[f64; NX]; NX],
        regularisation: [f64; NX],
        free: Free<NX>,
    ) -> Result<(), NotPositiveDefinite> {
        self.hessian = *p;
        self.regularisation = regularisation;
        (self.free, self.is_rigid) = (free, false);
        let inverse_d: [f64; NX] = from_fn(|i| 1.0 / regularisation[i]);
        let mut sum = *p;
        for i in 0..NX {
            sum[i][i] += inverse_d[i];
        }
        factor(&mut sum)?;
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
            column[j] = (1.0 - free[j]) * inverse_d[j];
            for k in j..NX {
                let factor = self.backward[k][j] * inverse_d[j];
                axpy(&mut column, &rows[k], factor);
            }
            p[j] = column;
        }
        for j in 1..NX {
            for i in 0..j {
                let better = if inverse_d[i] < inverse_d[j] { p[i][j] } else { p[j][i] };
                (p[i][j], p[j][i]) = (better, better);
            }
        }
        Ok(())
    }

    /// Schur complement of rigid dynamics, whose fixed components alone have a `D`. Cost: `NX^2` moves.
    #[inline(always)]
    pub fn of_rigid_dynamics(
        &mut self,
        p: &mut [[f64; NX]; NX],
        regularisation: f64,
        free: Free<NX>,
    ) {
        self.hessian = *p;
        self.regularisation = [regularisation; NX];
        (self.free, self.is_rigid) = (free, true);
        for (i, free) in free.factors().iter().enumerate() {
            p[i][i] += (1.0 - free) / regularisation;
        }
    }

    /// The next state `x+` and the multipliers `lambda` that follow from `y`, by forward and backward
    /// substitution where the dynamics are regularised.
    ///
    /// `y - D lambda` would cancel where `D` is large, `(y - x+) / D` where it is small; neither is
    /// computed there. Cost: `6 NX^2` flops, `2 NX^2` of rigid dynamics.
    #[inline(always)]
    pub fn substitute(&self, y: &[f64; NX]) -> ([f64; NX], [f64; NX]) {
        let mut x = *y;
        if !self.is_rigid {
            let rhs: [f64; NX] = from_fn(|i| y[i] / self.regularisation[i] - self.gradient[i]);
            let mut half = [0.0; NX];
            multiply_vector_add(&mut half, &self.forward, &rhs);
            x = [0.0; NX];
            multiply_vector_add(&mut x, &self.backward, &half);
        }
        let free = self.free.factors();
        let x: [f64; NX] = from_fn(|i| x[i] * free[i]);
        let mut lambda = self.gradient;
        multiply_vector_add(&mut lambda, &self.hessian, &x);
        for i in 0..NX {
            let is_large = self.regularisation[i] > LARGE_REGULARISATION;
            if is_large || free[i] == 0.0 {
                lambda[i] = (y[i] - x[i]) / self.regularisation[i];
            }
        }
        (x, lambda)
    }
}
