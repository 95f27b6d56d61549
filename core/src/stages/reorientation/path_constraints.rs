//! Path constraints of Stage 2: pointing, and clearances about the node.

use super::{NG, Reorientation};
use crate::dynamics::State;
use crate::executor::ForkJoin;
use crate::math::quaternion;
use crate::model::hcw_acceleration;
use crate::stages::clearance::{CONSTRAINTS, Clearance, Instant};
use nalgebra::{Matrix3, SVector, Vector3};
use remora_qp::QpStage;
use remora_qp::dense::clamp;

/// Scale of the pointing constraint, in cosine.
const COSINE_SCALE: f64 = 0.1;

/// Scale of clearance constraints [m].
const CLEARANCE_SCALE: f64 = 0.1;

/// Distance beyond the margin from which bodies are left out of a subproblem [m].
const NEAR: f64 = 0.3;

/// Instants about a node at which clearances hold, in intervals: with the next node's they divide the
/// interval into thirds.
const AROUND: [f64; 3] = [0.0, -1.0 / 3.0, 1.0 / 3.0];

/// Fraction of its margin by which a constraint may be violated.
const SHARE_OF_MARGIN: f64 = 0.1;

/// A clearance constraint before scaling.
#[derive(Clone, Copy)]
struct ClearanceConstraint<const NL: usize> {
    /// Margin less distance [m].
    value: f64,
    /// Time from the node to the instant [s].
    ahead: f64,
    nearest: Clearance<NL>,
}

impl<const NL: usize> ClearanceConstraint<NL> {
    /// Whether this constraint is nearer than the other; NaN counts as nearer.
    fn is_nearer(&self, other: &Self) -> bool {
        !(self.value <= other.value)
    }
}

impl<P: ForkJoin, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Values of the path constraints of node `k`, scaled.
    pub(super) fn path_values(&self, k: usize, state: &State<NL>, out: &mut SVector<f64, NG>) {
        out[0] = self.pointing_constraint(k, state).0;
        for (g, row) in self.clearance_constraints(k, state).iter().enumerate() {
            out[1 + g] = row.value / CLEARANCE_SCALE;
        }
    }

    /// Fills the path constraints of node `k`; clearances of distant bodies stay inactive.
    // Not inlined: its frame is not below the dynamics' derivatives, where the stack is deepest.
    #[inline(never)]
    pub(super) fn fill_path_constraints(
        &self,
        k: usize,
        state: &State<NL>,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let angle = self.scale_x[0];
        let (offset, gradient) = self.pointing_constraint(k, state);
        let gradient = self.axes(k).tr_mul(&gradient) * angle;
        stage.path_offset[0] = offset;
        for i in 0..3 {
            stage.path_jacobian[(0, i)] = gradient[i];
        }
        let rate = self.scale_x[3 + NL];
        for (g, row) in self.clearance_constraints(k, state).iter().enumerate() {
            if row.value <= -NEAR {
                continue;
            }
            stage.path_offset[1 + g] = row.value / CLEARANCE_SCALE;
            for i in 0..3 {
                let by = -row.nearest.by_turn[i] / CLEARANCE_SCALE;
                stage.path_jacobian[(1 + g, i)] = by * angle;
                stage.path_jacobian[(1 + g, 3 + NL + i)] = by * row.ahead * rate;
            }
            for i in 0..NL {
                let by = -row.nearest.by_joint[i] / CLEARANCE_SCALE;
                stage.path_jacobian[(1 + g, 3 + i)] = by * angle;
                stage.path_jacobian[(1 + g, 6 + NL + i)] =
                    by * row.ahead * self.scale_x[6 + NL + i];
            }
        }
    }

    /// Scaled tolerances of the path constraints of node `k`: those of the mission, or a fraction of the
    /// planning margin where that is larger.
    pub(super) fn path_tolerances(&self, k: usize) -> SVector<f64, NG> {
        let t = &self.mission.tolerances;
        let share = self.grid.margin_share(k as f64 * self.stepping.dt);
        let clearance = self.clearance.unwrap_or(0.0) * share * SHARE_OF_MARGIN;
        let mut out = SVector::repeat(t.clearance_m.max(clearance) / CLEARANCE_SCALE);
        out[0] = t.pointing / COSINE_SCALE;
        out
    }

    /// Cosine of the field of view's half angle in planning at node `k`.
    fn cos_field_of_view(&self, k: usize) -> f64 {
        let approach = &self.mission.approach;
        let margin = if self.has_margins { self.margins.field_of_view_rad } else { 0.0 };
        let share = self.grid.margin_share(k as f64 * self.stepping.dt);
        libm::cos(approach.field_of_view_half_angle_rad - margin * share)
    }

    /// Pointing constraint `cos(fov) - sight . R b` and its gradient by the attitude step, scaled;
    /// inactive while a given start is led back.
    fn pointing_constraint(&self, k: usize, state: &State<NL>) -> (f64, Vector3<f64>) {
        if self.recovery.pointing && self.share_of_start(k).is_some() {
            return (-1.0, Vector3::zeros());
        }
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let gradient = self.sight[k].cross(&boresight);
        (
            (self.cos_field_of_view(k) - self.sight[k].dot(&boresight)) / COSINE_SCALE,
            gradient / COSINE_SCALE,
        )
    }

    /// Clearance that planning keeps between bodies at `time` [m].
    fn clearance_at(&self, margin: f64, time: f64) -> f64 {
        let left = (self.grid.duration - time) / self.stepping.dt;
        margin * self.grid.margin_share(time) + self.extra_clearance * clamp(left - 1.0, 0.0, 1.0)
    }

    /// The nearest pair of bodies of each group about node `k`, at constant rates, and the nearest of the
    /// remaining ones, usually the same group's at another instant: without it a step away from one
    /// instant's violation runs into the other's. Inactive at the ends of the horizon.
    fn clearance_constraints(
        &self,
        k: usize,
        state: &State<NL>,
    ) -> [ClearanceConstraint<NL>; CONSTRAINTS] {
        let far = ClearanceConstraint { value: -NEAR, ahead: 0.0, nearest: Clearance::FAR };
        let mut constraints = [far; CONSTRAINTS];
        let (Some(margin), true) = (self.clearance, k > 0 && k < self.last()) else {
            return constraints;
        };
        for share in AROUND {
            let ahead = share * self.stepping.dt;
            let time = k as f64 * self.stepping.dt + ahead;
            let margin = self.clearance_at(margin, time);
            let moved = State {
                attitude: quaternion::product(
                    &quaternion::exp(&(state.rate * ahead)),
                    &state.attitude,
                ),
                joint_angle: state.joint_angle + state.joint_rate * ahead,
                ..*state
            };
            let at = self.instant(k, ahead, &moved);
            let found = self.bodies.clearances(&self.body, &at, margin + NEAR);
            let [first, others, next] = &mut constraints;
            for (row, nearest) in [first, others].into_iter().zip(found) {
                let mut left =
                    ClearanceConstraint { value: margin - nearest.distance, ahead, nearest };
                if left.is_nearer(row) {
                    core::mem::swap(&mut left, row);
                }
                if left.is_nearer(next) {
                    *next = left;
                }
            }
        }
        constraints
    }

    /// Positions `ahead` seconds from node `k` (less than an interval).
    fn instant<'s>(&self, k: usize, ahead: f64, state: &'s State<NL>) -> Instant<'s, NL> {
        let path = self.translation;
        let (position, velocity) = (&path.position[k], &path.velocity[k]);
        let force = &path.force[if ahead < 0.0 { k - 1 } else { k }];
        let acceleration = hcw_acceleration(self.mission.mean_motion(), position, velocity)
            + force / self.body.total_mass();
        let target = &self.target[k];
        Instant {
            state,
            position: position + velocity * ahead + acceleration * (0.5 * ahead * ahead),
            target: quaternion::product(&quaternion::exp(&(target.rate * ahead)), &target.attitude),
        }
    }

    /// Adds the curvature of the pointing constraint.
    // Not inlined, as `fill_path_constraints`.
    #[inline(never)]
    pub(super) fn add_pointing_curvature(
        &self,
        k: usize,
        state: &State<NL>,
        multiplier: f64,
        stage: &mut QpStage<NX, NU, NG>,
    ) {
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let outer = self.sight[k] * boresight.transpose();
        let second =
            Matrix3::identity() * self.sight[k].dot(&boresight) - (outer + outer.transpose()) * 0.5;
        let axes = self.axes(k);
        let angle = self.scale_x[0];
        let block = axes.tr_mul(&(second * axes)) * (multiplier * angle * angle / COSINE_SCALE);
        for i in 0..3 {
            for j in 0..3 {
                stage.hessian_xx[(i, j)] += block[(i, j)];
            }
        }
    }
}
