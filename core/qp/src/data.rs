//! Data and solution of the stage-structured QP.

use crate::dense::zeros;
use nalgebra::{ArrayStorage, SMatrix, SVector};

/// One stage of the QP: its cost, bounds and path constraints, and the dynamics to the next stage. At
/// the last stage everything about `u` and the dynamics is ignored.
#[derive(Clone, Copy, Debug)]
pub struct QpStage<const NX: usize, const NU: usize, const NG: usize> {
    /// Hessian block of the state `Q`, symmetric.
    pub hessian_xx: SMatrix<f64, NX, NX>,
    /// Cross block of the Hessian `S`, rows of the control.
    pub hessian_ux: SMatrix<f64, NU, NX>,
    /// Hessian block of the control `R`, symmetric.
    pub hessian_uu: SMatrix<f64, NU, NU>,
    /// Linear cost of the state `q`.
    pub gradient_x: SVector<f64, NX>,
    /// Linear cost of the control `r`.
    pub gradient_u: SVector<f64, NU>,
    /// `A`: derivative of the next state by the state.
    pub a: SMatrix<f64, NX, NX>,
    /// `B`: derivative of the next state by the control.
    pub b: SMatrix<f64, NX, NU>,
    /// `c`: next state at `x = 0`, `u = 0`.
    pub c: SVector<f64, NX>,
    /// Lower bounds of the state; `-inf` where there is none.
    pub lower_x: SVector<f64, NX>,
    /// Upper bounds of the state; `inf` where there is none.
    pub upper_x: SVector<f64, NX>,
    /// Lower bounds of the control; `-inf` where there is none.
    pub lower_u: SVector<f64, NU>,
    /// Upper bounds of the control; `inf` where there is none.
    pub upper_u: SVector<f64, NU>,
    /// `C`: derivatives of the soft path constraints by the state. A row of zeros with a negative
    /// offset is never active.
    pub path_jacobian: SMatrix<f64, NG, NX>,
    /// `d`: values of the soft path constraints at `x = 0`.
    pub path_offset: SVector<f64, NG>,
}

impl<const NX: usize, const NU: usize, const NG: usize> QpStage<NX, NU, NG> {
    /// All zero, path constraints inactive.
    pub const ZERO: Self = Self {
        hessian_xx: zeros(),
        hessian_ux: zeros(),
        hessian_uu: zeros(),
        gradient_x: zeros(),
        gradient_u: zeros(),
        a: zeros(),
        b: zeros(),
        c: zeros(),
        lower_x: zeros(),
        upper_x: zeros(),
        lower_u: zeros(),
        upper_u: zeros(),
        path_jacobian: zeros(),
        path_offset: SVector::from_array_storage(ArrayStorage([[-1.0; NG]; 1])),
    };
}

/// A QP of up to `N` stages with `NX` states, `NU` controls and `NG` soft path constraints each.
///
/// Memory: `8 N (2 NX^2 + 2 NX NU + NU^2 + 4 NX + 3 NU + NG (NX + 1))` bytes.
#[derive(Clone, Debug)]
pub struct Qp<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// The stages in order, of which [`Qp::unused`] at the end are storage alone.
    pub stages: [QpStage<NX, NU, NG>; N],
    /// How many stages at the end are no part of the QP: what they hold has no meaning.
    pub unused: usize,
    /// Constant part of the objective.
    pub constant: f64,
    /// L1 penalty parameter of the dynamics' slack; infinite where the dynamics are hard.
    pub defect_penalty: f64,
    /// L1 penalty parameter of the path constraints' violation; finite.
    pub path_penalty: f64,
    /// Largest complementarity `s z` that is good enough for whoever asks, in the QP's scaled units. Solvers
    /// need not look at it; the embedded one asks for no less than its settings do, and takes no more than 1e-4
    /// for good enough.
    pub complementarity: f64,
}

/// Most that is taken for good enough: what is larger is damaged.
const COARSEST: f64 = 1e-4;

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Qp<N, NX, NU, NG> {
    /// Storage, to be filled: all bits zero.
    pub const ZERO: Self = Self {
        stages: [QpStage { path_offset: zeros(), ..QpStage::ZERO }; N],
        unused: 0,
        constant: 0.0,
        defect_penalty: 0.0,
        path_penalty: 0.0,
        complementarity: 0.0,
    };

    /// Number of stages of the QP.
    pub fn nodes(&self) -> usize {
        N - self.unused.min(N)
    }

    /// The stages of the QP.
    pub fn used(&self) -> &[QpStage<NX, NU, NG>] {
        &self.stages[..self.nodes()]
    }

    /// The complementarity that is good enough; NaN counts as none.
    // `clamp` would keep it.
    #[allow(clippy::manual_clamp)]
    pub(crate) fn good_enough(&self) -> f64 {
        self.complementarity.max(0.0).min(COARSEST)
    }

    /// The stages of the QP, to be filled.
    pub fn used_mut(&mut self) -> &mut [QpStage<NX, NU, NG>] {
        let nodes = self.nodes();
        &mut self.stages[..nodes]
    }

    /// Smooth part of the objective at `point`.
    pub fn cost(&self, point: &Solution<N, NX, NU, NG>) -> f64 {
        let mut sum = self.constant;
        let each = self.used().iter().zip(&point.x).zip(&point.u).enumerate();
        for (k, ((stage, x), u)) in each {
            sum += 0.5 * x.dot(&(stage.hessian_xx * x)) + stage.gradient_x.dot(x);
            if k + 1 < self.nodes() {
                sum += 0.5 * u.dot(&(stage.hessian_uu * u))
                    + u.dot(&(stage.hessian_ux * x))
                    + stage.gradient_u.dot(u);
            }
        }
        sum
    }

    /// Derivative of the smooth part at the origin along `point`.
    pub fn slope(&self, point: &Solution<N, NX, NU, NG>) -> f64 {
        let term = |(k, stage): (usize, &QpStage<NX, NU, NG>)| {
            stage.gradient_x.dot(&point.x[k]) + stage.gradient_u.dot(&point.u[k])
        };
        self.used().iter().enumerate().map(term).sum()
    }

    /// L1 norm of the dynamics' slack at `point`.
    pub fn defect_norm(&self, point: &Solution<N, NX, NU, NG>) -> f64 {
        (1..self.nodes()).map(|k| self.slack(point, k - 1).abs().sum()).sum()
    }

    /// L1 norm of the path constraints' violation at `point`.
    pub fn path_violation(&self, point: &Solution<N, NX, NU, NG>) -> f64 {
        let violation = |(k, stage): (usize, &QpStage<NX, NU, NG>)| {
            (stage.path_jacobian * point.x[k] + stage.path_offset)
                .iter()
                .map(|v| v.max(0.0))
                .sum::<f64>()
        };
        self.used().iter().enumerate().map(violation).sum()
    }

    /// Slack of the dynamics from stage `k` to the next: `x_{k+1} - A x_k - B u_k - c`; zero
    /// beyond the horizon.
    pub fn slack(&self, point: &Solution<N, NX, NU, NG>, k: usize) -> SVector<f64, NX> {
        let (Some(stage), Some(x), Some(u), Some(next)) =
            (self.used().get(k), point.x.get(k), point.u.get(k), point.x.get(k + 1))
        else {
            return zeros();
        };
        if k + 1 == self.nodes() {
            return zeros();
        }
        next - stage.a * x - stage.b * u - stage.c
    }
}

/// A primal-dual point of the QP; zero beyond its stages.
#[derive(Clone, Debug)]
pub struct Solution<const N: usize, const NX: usize, const NU: usize, const NG: usize> {
    /// States.
    pub x: [SVector<f64, NX>; N],
    /// Controls; the last is zero.
    pub u: [SVector<f64, NU>; N],
    /// Multipliers of the dynamics `A x + B u + c + xi - x+ = 0`; the last is zero.
    pub defect_multiplier: [SVector<f64, NX>; N],
    /// Multipliers of the states' bounds: positive at an upper, negative at a lower one, either for a
    /// fixed variable.
    pub bound_multiplier_x: [SVector<f64, NX>; N],
    /// Multipliers of the controls' bounds; the last is zero.
    pub bound_multiplier_u: [SVector<f64, NU>; N],
    /// Multipliers of the path constraints, from zero to `path_penalty`.
    pub path_multiplier: [SVector<f64, NG>; N],
}

impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Solution<N, NX, NU, NG> {
    /// The origin with zero multipliers.
    pub const ZERO: Self = Self {
        x: [zeros(); N],
        u: [zeros(); N],
        defect_multiplier: [zeros(); N],
        bound_multiplier_x: [zeros(); N],
        bound_multiplier_u: [zeros(); N],
        path_multiplier: [zeros(); N],
    };

    /// Sets everything from stage `first` on to zero: what no QP of fewer stages determines.
    pub fn clear_from(&mut self, first: usize) {
        self.x.iter_mut().skip(first).for_each(|x| *x = zeros());
        self.u.iter_mut().skip(first).for_each(|u| *u = zeros());
        self.defect_multiplier.iter_mut().skip(first).for_each(|m| *m = zeros());
        self.bound_multiplier_x.iter_mut().skip(first).for_each(|m| *m = zeros());
        self.bound_multiplier_u.iter_mut().skip(first).for_each(|m| *m = zeros());
        self.path_multiplier.iter_mut().skip(first).for_each(|m| *m = zeros());
    }

    /// Sets all multipliers to zero.
    pub fn clear_multipliers(&mut self) {
        self.defect_multiplier = [zeros(); N];
        self.bound_multiplier_x = [zeros(); N];
        self.bound_multiplier_u = [zeros(); N];
        self.path_multiplier = [zeros(); N];
    }

    /// Whether the multipliers of dynamics and path constraints are at most `most`; those of a
    /// solution never exceed the penalty parameters. NaN counts as larger.
    pub fn multipliers_are_within(&self, most: f64) -> bool {
        let within = |values: &[f64]| values.iter().all(|v| v.abs() <= most);
        self.defect_multiplier.iter().all(|v| within(v.as_slice()))
            && self.path_multiplier.iter().all(|v| within(v.as_slice()))
    }

    /// Whether every number of the point is finite.
    pub fn is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        self.x.iter().all(|v| finite(v.as_slice()))
            && self.u.iter().all(|v| finite(v.as_slice()))
            && self.defect_multiplier.iter().all(|v| finite(v.as_slice()))
            && self.bound_multiplier_x.iter().all(|v| finite(v.as_slice()))
            && self.bound_multiplier_u.iter().all(|v| finite(v.as_slice()))
            && self.path_multiplier.iter().all(|v| finite(v.as_slice()))
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Qp<N, NX, NU, NG> {
    /// Overwrites every number with `value`.
    pub fn fill(&mut self, value: f64) {
        for stage in &mut self.stages {
            stage.hessian_xx.fill(value);
            stage.hessian_ux.fill(value);
            stage.hessian_uu.fill(value);
            stage.a.fill(value);
            stage.b.fill(value);
            stage.path_jacobian.fill(value);
            for vector in
                [&mut stage.gradient_x, &mut stage.c, &mut stage.lower_x, &mut stage.upper_x]
            {
                vector.fill(value);
            }
            for vector in [&mut stage.gradient_u, &mut stage.lower_u, &mut stage.upper_u] {
                vector.fill(value);
            }
            stage.path_offset.fill(value);
        }
        (self.constant, self.complementarity) = (value, value);
        (self.defect_penalty, self.path_penalty) = (value, value);
    }
}

#[cfg(any(test, feature = "testing"))]
impl<const N: usize, const NX: usize, const NU: usize, const NG: usize> Solution<N, NX, NU, NG> {
    /// Overwrites every number with `value`.
    pub fn fill(&mut self, value: f64) {
        for states in [&mut self.x, &mut self.defect_multiplier, &mut self.bound_multiplier_x] {
            states.iter_mut().for_each(|vector| vector.fill(value));
        }
        for controls in [&mut self.u, &mut self.bound_multiplier_u] {
            controls.iter_mut().for_each(|vector| vector.fill(value));
        }
        self.path_multiplier.iter_mut().for_each(|vector| vector.fill(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multipliers_beyond_their_bounds_are_seen() {
        let sound = Solution::<3, 2, 1, 1> {
            defect_multiplier: [SVector::from([-4.0, 4.0]); 3],
            path_multiplier: [SVector::from([4.0]); 3],
            // Steps and bounds' multipliers have no such bounds.
            x: [SVector::from([1e9, 0.0]); 3],
            bound_multiplier_x: [SVector::from([f64::NAN, 1e9]); 3],
            ..Solution::ZERO
        };
        assert!(sound.multipliers_are_within(4.0));
        assert!(!sound.multipliers_are_within(3.9));
        for value in [f64::NAN, f64::INFINITY, -1e300] {
            let mut damaged = sound.clone();
            damaged.defect_multiplier[2][1] = value;
            assert!(!damaged.multipliers_are_within(4.0), "{value}");
            let mut damaged = sound.clone();
            damaged.path_multiplier[0][0] = value;
            assert!(!damaged.multipliers_are_within(4.0), "{value}");
        }
    }

    #[test]
    fn what_is_good_enough_lies_in_a_range() {
        let good_enough = |complementarity: f64| {
            let qp = Qp::<1, 1, 1, 1> { complementarity, ..Qp::ZERO };
            qp.good_enough()
        };
        assert_eq!(
            [0.0, 1e-9, 1e-4, 1.1e-4, f64::INFINITY].map(good_enough),
            [0.0, 1e-9, 1e-4, 1e-4, 1e-4]
        );
        assert_eq!([f64::NAN, -1e-9, f64::NEG_INFINITY].map(good_enough), [0.0; 3]);
    }
}
