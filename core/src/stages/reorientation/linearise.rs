//! Linearisation and curvature of Stage 2.

use super::{ANGLE_SCALE, COSINE_SCALE, NR, Reorientation, ReorientationTrajectory};
use crate::dynamics::{Acceleration, Integrator, State, StepJacobian, TorqueCurvature};
use crate::math::quaternion;
use crate::pair::Pair;
use crate::qp::{Solution, Stage};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Curvature given to a component held at a limit, for each unit of its multiplier, and at most.
/// It plays the part of the barrier of an interior-point method: enough to keep the program convex
/// where a limit, not the cost, makes the minimum; little where the limit is about to be left.
const HOLD: f64 = 10.0;
const MAX_HOLD: f64 = 100.0;

/// Distance from a limit, relative, within which a component counts as standing at it.
const AT_LIMIT: f64 = 1e-5;

/// Value of the scaled pointing row above which it counts as active.
const ROW_ACTIVE: f64 = -1e-3;

impl<P: Pair, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Fills dynamics and offset of one interval, attitude rows in RTN.
    pub(super) fn linearise_interval(
        &self,
        k: usize,
        z: &ReorientationTrajectory<N, NL>,
        stage: &mut Stage<NX, NU, NR>,
    ) -> State<NL> {
        let (next, by): (State<NL>, StepJacobian<NX, NU>) = self.body.step_jacobian(
            self.integrator,
            self.dt,
            &z.states[k],
            &z.controls[k],
            &self.translation.force[k],
        );
        for i in 0..NX {
            for j in 0..NX {
                stage.a[(i, j)] = by.state[(i, j)] * self.scale_x[j] / self.scale_x[i];
            }
            for j in 0..NU {
                stage.b[(i, j)] = by.control[(i, j)] * self.scale_u[j] / self.scale_x[i];
            }
        }
        stage.c = self.defect(k, &next, &z.states[k + 1]);
        next
    }

    /// Takes the attitude rows to the chart and the axes of the next node, in which the defect is
    /// measured: where the defect is not small, the chart's derivative is not the identity.
    pub(super) fn apply_chart(
        &self,
        k: usize,
        next: &State<NL>,
        at: &State<NL>,
        stage: &mut Stage<NX, NU, NR>,
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
    pub(super) fn add_curvature(
        &self,
        k: usize,
        z: &ReorientationTrajectory<N, NL>,
        next: &State<NL>,
        multiplier: &SVector<f64, NX>,
        stage: &mut Stage<NX, NU, NR>,
    ) {
        let (state, control) = (&z.states[k], Self::stacked_control(&z.controls[k]));
        let mu = SVector::<f64, NU>::from_fn(|i, _| {
            let max = Self::max_torque(self.mission, i);
            2.0 * self.weight(i) * control[i] / (max * max)
        });
        let mean = Acceleration {
            bus: (next.rate - state.rate) / self.dt,
            joint: (next.joint_rate - state.joint_rate) / self.dt,
        };
        let force = &self.translation.force[k];
        let at = match self.integrator {
            Integrator::Euler => *state,
            Integrator::Rk4 { .. } => state.midway(next),
        };
        let curvature: TorqueCurvature<NX, NU> = self.body.torque_curvature(&at, force, &mean, &mu);
        // By scaled steps; the acceleration in units of scaled rates over a step.
        let s = SMatrix::<f64, NX, NX>::from_fn(|i, j| {
            curvature.state_state[(i, j)] * self.scale_x[i] * self.scale_x[j]
        });
        let c = SMatrix::<f64, NU, NX>::from_fn(|i, j| {
            let rate = self.scale_x[NX - NU + i] / self.dt;
            curvature.acceleration_state[(i, j)] * rate * self.scale_x[j]
        });
        let mut ax = stage.a.fixed_rows::<NU>(NX - NU).into_owned();
        for i in 0..NU {
            ax[(i, NX - NU + i)] -= 1.0;
        }
        let au = stage.b.fixed_rows::<NU>(NX - NU).into_owned();
        match self.integrator {
            Integrator::Euler => {
                let cross = ax.tr_mul(&c);
                stage.hessian_xx += s + cross + cross.transpose();
                stage.hessian_ux += au.tr_mul(&c);
            }
            Integrator::Rk4 { .. } => {
                let px = (SMatrix::identity() + stage.a) * 0.5;
                let pu = stage.b * 0.5;
                let (sx, cx, cu) = (s * px, c * px, c * pu);
                let cross = ax.tr_mul(&cx);
                stage.hessian_xx += px.tr_mul(&sx) + cross + cross.transpose();
                stage.hessian_ux += pu.tr_mul(&sx) + au.tr_mul(&cx) + cu.tr_mul(&ax);
                let cross = au.tr_mul(&cu);
                stage.hessian_uu += pu.tr_mul(&(s * pu)) + cross + cross.transpose();
            }
        }
        // Attitude: rotations do not add up, dtheta+ = ... + dt/2 drate x dtheta.
        let scaled = Vector3::new(multiplier[0], multiplier[1], multiplier[2]);
        let lambda = self.axes(k + 1) * scaled / self.scale_x[0];
        let factor = -0.5 * self.dt * self.scale_x[0] * self.scale_x[3 + NL];
        let block = lambda.cross_matrix() * factor;
        for i in 0..3 {
            for j in 0..3 {
                stage.hessian_xx[(3 + NL + i, j)] += block[(i, j)];
                stage.hessian_xx[(j, 3 + NL + i)] += block[(i, j)];
            }
        }
    }

    /// Adds curvature to what stands at a limit and is held there by a multiplier.
    pub(super) fn stiffen(
        &self,
        k: usize,
        state: &State<NL>,
        last: &Solution<N, NX, NU, NR>,
        stage: &mut Stage<NX, NU, NR>,
    ) {
        let servicer = &self.mission.servicer;
        let held = |multiplier: f64| (HOLD * multiplier.abs()).min(MAX_HOLD);
        let bounds = &last.bound_multiplier_x[k];
        for i in 0..NL {
            let limit = servicer.max_joint_angle[i];
            if state.joint_angle[i].abs() > limit * (1.0 - AT_LIMIT) {
                stage.hessian_xx[(3 + i, 3 + i)] += held(bounds[3 + i]);
            }
            let limit = servicer.max_joint_rate;
            if state.joint_rate[i].abs() > limit * (1.0 - AT_LIMIT) {
                stage.hessian_xx[(6 + NL + i, 6 + NL + i)] += held(bounds[6 + NL + i]);
            }
        }
        if stage.row_offset[0] > ROW_ACTIVE {
            let g = stage.row_x.transpose();
            let gg = g * g.transpose();
            stage.hessian_xx += gg * (held(last.row_multiplier[k][0]) / gg.trace());
        }
    }

    /// Adds the curvature of the pointing row.
    pub(super) fn add_pointing_curvature(
        &self,
        k: usize,
        state: &State<NL>,
        multiplier: f64,
        stage: &mut Stage<NX, NU, NR>,
    ) {
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let outer = self.sight[k] * boresight.transpose();
        let second =
            Matrix3::identity() * self.sight[k].dot(&boresight) - (outer + outer.transpose()) * 0.5;
        let axes = self.axes(k);
        let block =
            axes.tr_mul(&(second * axes)) * (multiplier * ANGLE_SCALE * ANGLE_SCALE / COSINE_SCALE);
        for i in 0..3 {
            for j in 0..3 {
                stage.hessian_xx[(i, j)] += block[(i, j)];
            }
        }
    }
}
