//! The conditions of Karush, Kuhn and Tucker, from the program's definition alone. Nothing here knows how a
//! solver works.

use remora_qp::nalgebra::SVector;
use remora_qp::{Qp, Solution};

/// Largest violation of each condition; infinite where something is not a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kkt {
    /// Component of the Lagrangian's gradient.
    pub stationarity: f64,
    /// Violation of a bound or of hard dynamics.
    pub primal: f64,
    /// Multiplier beyond its range.
    pub dual: f64,
    /// Product of a multiplier with the distance from its constraint.
    pub complementarity: f64,
}

impl Kkt {
    /// The conditions of `qp` at `point`.
    pub fn of<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
        point: &Solution<N, NX, NU, NG>,
    ) -> Self {
        let mut kkt = Self::default();
        let nodes = qp.nodes();
        for k in 0..nodes {
            let stage = &qp.stages[k];
            let (x, u) = (&point.x[k], &point.u[k]);
            let mut of_x = stage.hessian_xx * x + stage.gradient_x + point.bound_multiplier_x[k];
            of_x += stage.path_jacobian.tr_mul(&point.path_multiplier[k]);
            if k > 0 {
                of_x -= point.defect_multiplier[k - 1];
            }
            if k + 1 < nodes {
                let lambda = &point.defect_multiplier[k];
                of_x += stage.hessian_ux.tr_mul(u) + stage.a.tr_mul(lambda);
                let of_u = stage.hessian_uu * u
                    + stage.hessian_ux * x
                    + stage.gradient_u
                    + stage.b.tr_mul(lambda)
                    + point.bound_multiplier_u[k];
                of_u.iter().for_each(|v| note(&mut kkt.stationarity, *v));
                kkt.bounds(u, &point.bound_multiplier_u[k], &stage.lower_u, &stage.upper_u);
                kkt.dynamics(&qp.slack(point, k), lambda, qp.defect_penalty);
            }
            of_x.iter().for_each(|v| note(&mut kkt.stationarity, *v));
            kkt.bounds(x, &point.bound_multiplier_x[k], &stage.lower_x, &stage.upper_x);
            let rows = stage.path_jacobian * x + stage.path_offset;
            kkt.rows(&rows, &point.path_multiplier[k], qp.path_penalty);
        }
        // Zero by definition, there being no dynamics after the last stage.
        for k in nodes - 1..N {
            point.u[k].iter().for_each(|v| note(&mut kkt.primal, *v));
            point.defect_multiplier[k].iter().for_each(|v| note(&mut kkt.dual, *v));
            point.bound_multiplier_u[k].iter().for_each(|v| note(&mut kkt.dual, *v));
        }
        kkt
    }

    /// The largest of them.
    pub fn worst(&self) -> f64 {
        self.stationarity.max(self.primal).max(self.dual).max(self.complementarity)
    }

    /// Variables within bounds; a multiplier is positive at the upper one.
    fn bounds<const D: usize>(
        &mut self,
        value: &SVector<f64, D>,
        multiplier: &SVector<f64, D>,
        lower: &SVector<f64, D>,
        upper: &SVector<f64, D>,
    ) {
        for i in 0..D {
            let m = multiplier[i];
            note(&mut self.primal, 0.0 * (value[i] + m));
            note(&mut self.primal, (lower[i] - value[i]).max(value[i] - upper[i]).max(0.0));
            let room = if m > 0.0 { upper[i] - value[i] } else { value[i] - lower[i] };
            if lower[i] == upper[i] || m == 0.0 {
                continue;
            } else if room.is_finite() {
                self.pair(room, m.abs());
            } else {
                note(&mut self.dual, m);
            }
        }
    }

    /// Slack `xi` costs `penalty |xi| + lambda xi`.
    fn dynamics<const D: usize>(
        &mut self,
        slack: &SVector<f64, D>,
        multiplier: &SVector<f64, D>,
        penalty: f64,
    ) {
        for (xi, lambda) in slack.iter().zip(multiplier) {
            note(&mut self.primal, 0.0 * (xi + lambda));
            if penalty == f64::INFINITY {
                note(&mut self.primal, *xi);
                continue;
            }
            note(&mut self.dual, (lambda.abs() - penalty).max(0.0));
            self.pair(*xi, penalty + lambda);
            self.pair(-xi, penalty - lambda);
        }
    }

    /// Rows pay nothing below zero and the penalty above.
    fn rows<const D: usize>(
        &mut self,
        rows: &SVector<f64, D>,
        multiplier: &SVector<f64, D>,
        penalty: f64,
    ) {
        for (row, nu) in rows.iter().zip(multiplier) {
            note(&mut self.primal, 0.0 * (row + nu));
            note(&mut self.dual, (-nu).max(nu - penalty).max(0.0));
            self.pair(-row, *nu);
            self.pair(*row, penalty - nu);
        }
    }

    /// Two numbers of which one should be zero, as far as neither is negative.
    fn pair(&mut self, distance: f64, multiplier: f64) {
        note(&mut self.complementarity, distance.max(0.0) * multiplier.max(0.0));
    }
}

/// Keeps the larger magnitude; what is not a number counts as infinite.
fn note(worst: &mut f64, value: f64) {
    *worst = if value.is_nan() { f64::INFINITY } else { worst.max(value.abs()) };
}

/// The whole objective at `point`: the smooth part and the penalties.
pub fn objective<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    point: &Solution<N, NX, NU, NG>,
) -> f64 {
    let is_soft = qp.defect_penalty.is_finite();
    let defects = if is_soft { qp.defect_penalty * qp.defect_norm(point) } else { 0.0 };
    qp.cost(point) + defects + qp.path_penalty * qp.path_violation(point)
}

/// Largest difference of a state or control between two points.
pub fn distance<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    a: &Solution<N, NX, NU, NG>,
    b: &Solution<N, NX, NU, NG>,
) -> f64 {
    let mut worst = 0.0;
    for k in 0..N {
        (a.x[k] - b.x[k]).iter().for_each(|v| note(&mut worst, *v));
        (a.u[k] - b.u[k]).iter().for_each(|v| note(&mut worst, *v));
    }
    worst
}
