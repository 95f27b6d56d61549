//! Parts of the solver by themselves, against what they stand for.

mod cost_to_go;
mod infeasible;
mod kernels;
mod memory;
mod newton;
mod optimality;
mod restarts;
mod variables;

use crate::Qp;
use nalgebra::{SMatrix, SVector};

/// Fixed numbers in [-1, 1), of a linear congruence.
pub(super) struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn matrix<const R: usize, const C: usize>(&mut self, size: f64) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|_, _| size * self.next())
    }

    /// Positive definite.
    pub fn definite<const D: usize>(&mut self) -> SMatrix<f64, D, D> {
        let root: SMatrix<f64, D, D> = self.matrix(1.0);
        root * root.transpose() + SMatrix::identity() * 0.2
    }
}

/// A convex program with bounds of each kind: two-sided, one-sided, none, and equal.
fn program<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    numbers: &mut Numbers,
    defect_penalty: f64,
) -> Qp<N, NX, NU, NG> {
    let mut qp = Qp { defect_penalty, path_penalty: 3.0, ..Qp::ZERO };
    for (k, stage) in qp.stages.iter_mut().enumerate() {
        stage.hessian_xx = numbers.definite::<NX>() * 2.0;
        stage.hessian_uu = numbers.definite::<NU>() + SMatrix::identity();
        stage.hessian_ux = numbers.matrix(0.1);
        stage.gradient_x = numbers.matrix(1.0);
        stage.gradient_u = numbers.matrix(1.0);
        stage.a = numbers.matrix(0.7);
        stage.b = numbers.matrix(1.0);
        stage.c = numbers.matrix(0.3);
        stage.path_jacobian = numbers.matrix(1.0);
        stage.path_offset = numbers.matrix(0.5);
        let open = |i: usize, side: usize| (i + k) % 4 == side || (i + k) % 4 == 2;
        stage.lower_x = SVector::from_fn(|i, _| if open(i, 0) { f64::NEG_INFINITY } else { -1.5 });
        stage.upper_x = SVector::from_fn(|i, _| if open(i, 1) { f64::INFINITY } else { 2.0 });
        stage.lower_u = SVector::from_fn(|i, _| if open(i, 1) { f64::NEG_INFINITY } else { -0.7 });
        stage.upper_u = SVector::from_fn(|i, _| if open(i, 0) { f64::INFINITY } else { 0.9 });
    }
    let first = numbers.matrix(0.5);
    (qp.stages[0].lower_x, qp.stages[0].upper_x) = (first, first);
    // One state at the end and one control on the way are fixed too.
    (qp.stages[N - 1].lower_x[0], qp.stages[N - 1].upper_x[0]) = (0.25, 0.25);
    (qp.stages[1].lower_u[0], qp.stages[1].upper_u[0]) = (0.125, 0.125);
    qp
}
