//! Linearisation and curvature of Stage 2.

use super::{NG, Reorientation};
use crate::dynamics::{Acceleration, Control, Integrator, State, StepJacobian, TorqueCurvature};
use crate::executor::ForkJoin;
use crate::math::quaternion;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use remora_qp::{QpStage, Solution};

/// Active-set Hessian regularisation: curvature of a component at a limit for each unit of its
/// multiplier, and its maximum. Like an interior-point barrier it keeps the QP convex where a limit,
/// not the cost, determines the minimum, and is small where the limit is about to become inactive.
const ACTIVE_SET_CURVATURE: f64 = 10.0;
const MAX_ACTIVE_SET_CURVATURE: f64 = 100.0;

/// Relative distance from a limit within which it counts as active.
const AT_LIMIT: f64 = 1e-5;

/// Scaled value above which a path constraint counts as active.
const CONSTRAINT_ACTIVE: f64 = -1e-3;

/// State at the start of an interval, with control and force over it.
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a, const NL: usize> {
    pub state: &'a State<NL>,
    pub control: &'a Control<NL>,
    pub force: &'a Vector3<f64>,
}

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Fills `A`, `B` and `c` of the interval after node `k`, attitude rows in RTN: from `inputs` to `at`. Returns the state that the dynamics lead to.
    // Not inlined: its frame is released before curvature is computed.
    #[inline(never)]
    pub(super) fn linearise_interval(
        &self,
        k: usize,
        inputs: Inputs<'_, NL>,
        at: &State<NL>,
        stage: &mut QpStage<NX, NU, NG>,
    ) -> State<NL> {
        let Inputs { state, control, force } = inputs;
        // Not destructured: that would copy it.
        let step: (State<NL>, StepJacobian<NX, NU>) =
            self.body.step_jacobian(&self.stepping, state, control, force);
        let (next, by) = (&step.0, &step.1);
        for i in 0..NX {
            for j in 0..NX {
                stage.a[(i, j)] = by.state[(i, j)] * self.scale_x[j] / self.scale_x[i];
            }
            for j in 0..NU {
                stage.b[(i, j)] = by.control[(i, j)] * self.scale_u[j] / self.scale_x[i];
            }
        }
        stage.c = self.defect(k, next, at);
        *next
    }

    /// Transforms the attitude rows to the chart and axes of the next node, in which the defect is
    /// measured. The chart's derivative is the identity only for small defects.
    pub(super) fn apply_chart(
        &self,
        k: usize,
        next: &State<NL>,
        at: &State<NL>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let error = quaternion::product(&next.attitude, &quaternion::conjugate(&at.attitude));
        let error = if error.w < 0.0 { -error } else { error };
        let vector = Vector3::new(error.x, error.y, error.z);
        let chart = Matrix3::identity() * error.w - vector.cross_matrix();
        let to_axes = self.axes(k + 1).transpose() * chart;
        let rows = to_axes * stage.a.fixed_rows::<3>(0);
        stage.a.fixed_rows_mut::<3>(0).copy_from(&rows);
        let rows = to_axes * stage.b.fixed_rows::<3>(0);
        stage.b.fixed_rows_mut::<3>(0).copy_from(&rows);
    }

    /// Adds the curvature of the cost along the retraction and of the attitude kinematics.
    ///
    /// The retraction recomputes torques by inverse dynamics, `u = torques(x, a)` with the mean
    /// acceleration `a` linear in the step: the cost's gradient times the torques' second
    /// derivative is what the diagonal cost misses.
    // Not inlined: its frame is released before the next interval is linearised.
    #[inline(never)]
    pub(super) fn add_curvature(
        &self,
        k: usize,
        inputs: Inputs<'_, NL>,
        next: &State<NL>,
        multiplier: &SVector<f64, NX>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let Inputs { state, control, force } = inputs;
        let control = Self::stacked_control(control);
        let mu = SVector::<f64, NU>::from_fn(|i, _| self.marginal_cost(i, control[i]));
        let mean = Acceleration {
            bus: (next.rate - state.rate) / self.stepping.dt,
            joint: (next.joint_rate - state.joint_rate) / self.stepping.dt,
        };
        let at = match self.stepping.integrator {
            Integrator::Euler => *state,
            Integrator::Rk4 { .. } => state.midpoint(next),
        };
        let mut curvature = self.body.torque_curvature(&at, force, &mean, &mu);
        self.scale(&mut curvature);
        match self.stepping.integrator {
            Integrator::Euler => Self::add_curvature_at_start(&curvature, stage),
            Integrator::Rk4 { .. } => Self::add_curvature_at_midpoint(&curvature, stage),
        }
        // Attitude: rotations do not add up, dtheta+ = ... + dt/2 drate x dtheta.
        let scaled = Vector3::new(multiplier[0], multiplier[1], multiplier[2]);
        let lambda = self.axes(k + 1) * scaled / self.scale_x[0];
        let factor = -0.5 * self.stepping.dt * self.scale_x[0] * self.scale_x[3 + NL];
        let block = lambda.cross_matrix() * factor;
        for i in 0..3 {
            for j in 0..3 {
                stage.hessian_xx[(3 + NL + i, j)] += block[(i, j)];
                stage.hessian_xx[(j, 3 + NL + i)] += block[(i, j)];
            }
        }
    }

    /// Scales the torques' curvature to scaled steps, the acceleration to scaled rates over a step.
    fn scale(&self, curvature: &mut TorqueCurvature<NX, NU>) {
        for j in 0..NX {
            for i in 0..NX {
                let value = &mut curvature.state_state[(i, j)];
                *value = *value * self.scale_x[i] * self.scale_x[j];
            }
            for i in 0..NU {
                let value = &mut curvature.acceleration_state[(i, j)];
                *value = *value * (self.scale_x[NX - NU + i] / self.stepping.dt) * self.scale_x[j];
            }
        }
    }

    /// Adds `block + cross + cross^T`.
    fn add_with_cross<const D: usize>(
        hessian: &mut SMatrix<f64, D, D>,
        block: &SMatrix<f64, D, D>,
        cross: &SMatrix<f64, D, D>,
    ) {
        for j in 0..D {
            for i in 0..D {
                hessian[(i, j)] += block[(i, j)] + cross[(i, j)] + cross[(j, i)];
            }
        }
    }

    /// Derivatives of the rates' change over the interval by state and control.
    fn rate_change(stage: &QpStage<NX, NU, NG>) -> (SMatrix<f64, NU, NX>, SMatrix<f64, NU, NU>) {
        let mut by_state = stage.a.fixed_rows::<NU>(NX - NU).into_owned();
        for i in 0..NU {
            by_state[(i, NX - NU + i)] -= 1.0;
        }
        (by_state, stage.b.fixed_rows::<NU>(NX - NU).into_owned())
    }

    /// Adds the torques' curvature, evaluated at the interval's start (Euler).
    // Separate functions: together their frames set the peak stack.
    #[inline(never)]
    fn add_curvature_at_start(
        curvature: &TorqueCurvature<NX, NU>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let TorqueCurvature { state_state: s, acceleration_state: c } = curvature;
        let (ax, au) = Self::rate_change(stage);
        Self::add_with_cross(&mut stage.hessian_xx, s, &ax.tr_mul(c));
        stage.hessian_ux += au.tr_mul(c);
    }

    /// Adds the torques' curvature, evaluated at the interval's midpoint (RK4).
    #[inline(never)]
    fn add_curvature_at_midpoint(
        curvature: &TorqueCurvature<NX, NU>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let TorqueCurvature { state_state: s, acceleration_state: c } = curvature;
        let (ax, au) = Self::rate_change(stage);
        let px = (SMatrix::identity() + stage.a) * 0.5;
        let pu = stage.b * 0.5;
        let (sx, cx, cu) = (s * px, c * px, c * pu);
        Self::add_with_cross(&mut stage.hessian_xx, &px.tr_mul(&sx), &ax.tr_mul(&cx));
        stage.hessian_ux += pu.tr_mul(&sx) + au.tr_mul(&cx) + cu.tr_mul(&ax);
        Self::add_with_cross(&mut stage.hessian_uu, &pu.tr_mul(&(s * pu)), &au.tr_mul(&cu));
    }

    /// Active-set Hessian regularisation: adds curvature to components at an active limit.
    // Not inlined: its frame is not below the dynamics' derivatives, where the stack is deepest.
    #[inline(never)]
    pub(super) fn regularise_active_set(
        &self,
        k: usize,
        state: &State<NL>,
        last: &Solution<N, NX, NU, NG>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let held = |multiplier: f64| {
            (ACTIVE_SET_CURVATURE * multiplier.abs()).min(MAX_ACTIVE_SET_CURVATURE)
        };
        let bounds = &last.bound_multiplier_x[k];
        for i in 0..NL {
            let (lower, upper) = self.joint_limits(k, i);
            let (angle, near) = (state.joint_angle[i], AT_LIMIT * 0.5 * (upper - lower));
            if angle > upper - near || angle < lower + near {
                stage.hessian_xx[(3 + i, 3 + i)] += held(bounds[3 + i]);
            }
            let limit = self.joint_rate_limit(k, i);
            if state.joint_rate[i].abs() > limit * (1.0 - AT_LIMIT) {
                stage.hessian_xx[(6 + NL + i, 6 + NL + i)] += held(bounds[6 + NL + i]);
            }
        }
        for row in 0..NG {
            if stage.path_offset[row] > CONSTRAINT_ACTIVE {
                let g = stage.path_jacobian.row(row).transpose();
                let gg = g * g.transpose();
                stage.hessian_xx += gg * (held(last.path_multiplier[k][row]) / gg.trace());
            }
        }
    }
}
