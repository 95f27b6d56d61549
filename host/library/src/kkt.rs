//! Optimality of a subproblem's solution, by any solver.
//!
//! The conditions of Karush, Kuhn and Tucker, checked from the program's definition alone: nothing
//! here knows how either solver works. With slacks eliminated they read, for multipliers `l` of
//! the dynamics, `m` of a bound and `r` of a row:
//!
//! - the gradient of the Lagrangian over every `x` and `u` is zero;
//! - boxes hold, and hard dynamics do;
//! - `|l| <= defect_penalty`, `0 <= r <= path_penalty`, and `m` pushes only from bounds that exist;
//! - a slack of the dynamics pays its full weight with the right sign, a violated row pays the
//!   full weight and a satisfied one nothing, a bound that is not reached does not push.

use remora_core::advanced::qp::{Qp, Solution};

/// Largest violation of each optimality condition, in the program's own (scaled) units. Infinite
/// where something is not a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Kkt {
    /// Component of the Lagrangian's gradient.
    pub stationarity: f64,
    /// Violation of a box or of hard dynamics.
    pub primal: f64,
    /// Multiplier beyond its range.
    pub dual: f64,
    /// Product of a multiplier with the distance from its constraint.
    pub complementarity: f64,
    /// The smaller of the two factors: how well it is known which constraints are active. It goes
    /// with the square root of the product, so it is no residual to be held to the same tolerance.
    pub activity: f64,
}

impl Kkt {
    /// The conditions of `qp` at `point`. Cost: a few products with the program's matrices.
    pub fn of<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        qp: &Qp<N, NX, NU, NG>,
        point: &Solution<N, NX, NU, NG>,
    ) -> Self {
        let mut kkt = Self::default();
        for k in 0..qp.nodes() {
            kkt.node(qp, point, k);
            if k + 1 < qp.nodes() {
                kkt.interval(qp, point, k);
            }
        }
        // Controls and multipliers beyond the last interval are zero by definition.
        for k in qp.nodes() - 1..N {
            point.u[k].iter().for_each(|v| note(&mut kkt.primal, *v));
            point.defect_multiplier[k].iter().for_each(|v| note(&mut kkt.dual, *v));
            point.bound_multiplier_u[k].iter().for_each(|v| note(&mut kkt.dual, *v));
        }
        kkt
    }

    /// The largest of all but `activity`.
    pub fn worst(&self) -> f64 {
        self.stationarity.max(self.primal).max(self.dual).max(self.complementarity)
    }

    /// The larger of both, condition by condition.
    pub fn max(self, other: Self) -> Self {
        Self {
            stationarity: self.stationarity.max(other.stationarity),
            primal: self.primal.max(other.primal),
            dual: self.dual.max(other.dual),
            complementarity: self.complementarity.max(other.complementarity),
            activity: self.activity.max(other.activity),
        }
    }

    /// A node's state: its gradient, its box and its rows.
    fn node<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        point: &Solution<N, NX, NU, NG>,
        k: usize,
    ) {
        let (stage, x, m) = (&qp.stages[k], &point.x[k], &point.bound_multiplier_x[k]);
        let mut gradient = stage.hessian_xx * x
            + stage.gradient_x
            + stage.path_jacobian.tr_mul(&point.path_multiplier[k])
            + m;
        if k > 0 {
            gradient -= point.defect_multiplier[k - 1];
        }
        if k + 1 < qp.nodes() {
            gradient +=
                stage.hessian_ux.tr_mul(&point.u[k]) + stage.a.tr_mul(&point.defect_multiplier[k]);
        }
        gradient.iter().for_each(|v| note(&mut self.stationarity, *v));
        for i in 0..NX {
            self.bound(x[i], m[i], stage.lower_x[i], stage.upper_x[i]);
        }
        let rows = stage.path_jacobian * x + stage.path_offset;
        for i in 0..NG {
            let (row, r) = (rows[i], point.path_multiplier[k][i]);
            note(&mut self.dual, (-r).max(0.0));
            note(&mut self.dual, (r - qp.path_penalty).max(0.0));
            self.pair((-row).max(0.0), r);
            self.pair(row.max(0.0), qp.path_penalty - r);
            // `f64::max` drops a NaN.
            note(&mut self.primal, 0.0 * (row + r));
        }
    }

    /// An interval's control and dynamics.
    fn interval<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
        &mut self,
        qp: &Qp<N, NX, NU, NG>,
        point: &Solution<N, NX, NU, NG>,
        k: usize,
    ) {
        let (stage, u, m) = (&qp.stages[k], &point.u[k], &point.bound_multiplier_u[k]);
        let gradient = stage.hessian_uu * u
            + stage.hessian_ux * point.x[k]
            + stage.gradient_u
            + stage.b.tr_mul(&point.defect_multiplier[k])
            + m;
        gradient.iter().for_each(|v| note(&mut self.stationarity, *v));
        for i in 0..NU {
            self.bound(u[i], m[i], stage.lower_u[i], stage.upper_u[i]);
        }
        let slack = qp.slack(point, k);
        for i in 0..NX {
            let (xi, l) = (slack[i], point.defect_multiplier[k][i]);
            if qp.defect_penalty.is_finite() {
                note(&mut self.dual, (l.abs() - qp.defect_penalty).max(0.0));
                // The slack enters the Lagrangian as `weight |xi| + l xi`.
                self.pair(xi.max(0.0), qp.defect_penalty + l);
                self.pair((-xi).max(0.0), qp.defect_penalty - l);
                note(&mut self.primal, 0.0 * (xi + l));
            } else {
                note(&mut self.primal, xi);
            }
        }
    }

    /// A variable within its box, its multiplier positive at the upper end.
    fn bound(&mut self, value: f64, m: f64, lower: f64, upper: f64) {
        note(&mut self.primal, 0.0 * (value + m));
        note(&mut self.primal, (lower - value).max(value - upper).max(0.0));
        if lower == upper {
            return;
        }
        let (room, is_bounded) = if m > 0.0 {
            (upper - value, upper < f64::INFINITY)
        } else {
            (value - lower, lower > f64::NEG_INFINITY)
        };
        if is_bounded {
            self.pair(room.max(0.0), m.abs());
        } else {
            note(&mut self.dual, m);
        }
    }

    /// Two numbers of which at least one should be zero, as far as neither is negative.
    fn pair(&mut self, distance: f64, multiplier: f64) {
        let multiplier = multiplier.max(0.0);
        note(&mut self.complementarity, distance * multiplier);
        note(&mut self.activity, distance.min(multiplier));
    }
}

/// Keeps the larger magnitude; NaN counts as infinite.
fn note(worst: &mut f64, value: f64) {
    *worst = if value.is_nan() { f64::INFINITY } else { worst.max(value.abs()) };
}

/// The whole objective at `point`: the smooth part and the weighted penalties.
pub fn objective<const N: usize, const NX: usize, const NU: usize, const NG: usize>(
    qp: &Qp<N, NX, NU, NG>,
    point: &Solution<N, NX, NU, NG>,
) -> f64 {
    let soft = qp.defect_penalty.is_finite();
    let defects = if soft { qp.defect_penalty * qp.defect_norm(point) } else { 0.0 };
    qp.cost(point) + defects + qp.path_penalty * qp.path_violation(point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;

    type Program = Qp<2, 1, 1, 1>;
    type Point = Solution<2, 1, 1, 1>;

    /// `min u^2 / 2 + x1^2 / 2 - 3 x1`, `x1 = x0 + u`, `x0 = 0` pinned, `u <= 1`: `u = x1 = 1`.
    fn example() -> (Program, Point) {
        let mut qp = Program::ZERO;
        qp.defect_penalty = f64::INFINITY;
        qp.stages.iter_mut().for_each(|stage| stage.path_offset.fill(-1.0));
        let [first, last] = &mut qp.stages;
        first.hessian_uu.fill(1.0);
        first.a.fill(1.0);
        first.b.fill(1.0);
        first.lower_u.fill(f64::NEG_INFINITY);
        first.upper_u.fill(1.0);
        last.hessian_xx.fill(1.0);
        last.gradient_x.fill(-3.0);
        last.lower_x.fill(-9.0);
        last.upper_x.fill(f64::INFINITY);
        qp.path_penalty = 5.0;
        let mut point = Point::ZERO;
        point.x[1].fill(1.0);
        point.u[0].fill(1.0);
        point.defect_multiplier[0].fill(-2.0);
        point.bound_multiplier_u[0].fill(1.0);
        point.bound_multiplier_x[0].fill(2.0);
        (qp, point)
    }

    #[test]
    fn an_optimum_has_no_residuals_and_each_flaw_its_own() {
        let (qp, point) = example();
        assert_eq!(Kkt::of(&qp, &point), Kkt::default());
        assert_eq!(objective(&qp, &point), -2.0);
        let flawed = |change: fn(&mut Point)| {
            let mut changed = point.clone();
            change(&mut changed);
            Kkt::of(&qp, &changed)
        };
        assert_eq!(flawed(|p| p.defect_multiplier[0].fill(-2.5)).stationarity, 0.5);
        assert_eq!(flawed(|p| p.x[0].fill(0.25)).primal, 0.25);
        assert_eq!(flawed(|p| p.u[0].fill(1.125)).primal, 0.125);
        assert_eq!(flawed(|p| p.bound_multiplier_u[0].fill(-0.5)).dual, 0.5);
        assert_eq!(flawed(|p| p.path_multiplier[1].fill(6.0)).dual, 1.0);
        assert_eq!(flawed(|p| p.path_multiplier[1].fill(-2.0)).dual, 2.0);
        let pushing = flawed(|p| p.path_multiplier[1].fill(0.5));
        assert_eq!((pushing.complementarity, pushing.activity), (0.5, 0.5));
        let short = flawed(|p| p.u[0].fill(0.75));
        assert_eq!((short.complementarity, short.activity), (0.25, 0.25));
        assert_eq!(flawed(|p| p.u[1].fill(1.0)).primal, 1.0);
        let nan = SVector::from([f64::NAN]);
        for k in 0..2 {
            let mut points = vec![point.clone(); 6];
            points[0].x[k] = nan;
            points[1].u[k] = nan;
            points[2].defect_multiplier[k] = nan;
            points[3].bound_multiplier_x[k] = nan;
            points[4].bound_multiplier_u[k] = nan;
            points[5].path_multiplier[k] = nan;
            for point in points {
                assert_eq!(Kkt::of(&qp, &point).worst(), f64::INFINITY, "{point:?}");
            }
        }
    }

    #[test]
    fn slack_pays_its_weight_with_the_right_sign() {
        let (mut qp, mut point) = example();
        // The dynamics would ask for a multiplier of 2: at a weight of 1.5 slack is cheaper.
        qp.defect_penalty = 1.5;
        point.defect_multiplier[0].fill(-1.5);
        point.x[1].fill(1.5);
        point.u[0].fill(1.0);
        point.bound_multiplier_u[0].fill(0.5);
        point.bound_multiplier_x[0].fill(1.5);
        assert_eq!(Kkt::of(&qp, &point), Kkt::default());
        // Slack to the other side pays with the other sign.
        point.x[1].fill(0.5);
        assert_eq!(Kkt::of(&qp, &point).activity, 0.5);
        assert_eq!(Kkt::of(&qp, &point).complementarity, 1.5);
        point.defect_multiplier[0].fill(-1.75);
        assert_eq!(Kkt::of(&qp, &point).dual, 0.25);
    }

    #[test]
    fn violated_rows_pay_their_weight() {
        let (mut qp, mut point) = example();
        // x1 <= 0.5, worth no more than 5.
        qp.stages[1].path_jacobian.fill(1.0);
        qp.stages[1].path_offset.fill(-0.5);
        assert_eq!(Kkt::of(&qp, &point).complementarity, 2.5);
        qp.path_penalty = 0.5;
        point.path_multiplier[1].fill(0.5);
        point.defect_multiplier[0].fill(-1.5);
        point.bound_multiplier_u[0].fill(0.5);
        point.bound_multiplier_x[0].fill(1.5);
        assert_eq!(Kkt::of(&qp, &point), Kkt::default());
    }
}
