//! Soft rows of Stage 2: pointing, and clearances about the node.

use super::{NG, Reorientation};
use crate::dynamics::State;
use crate::math::quaternion;
use crate::model::hcw_acceleration;
use crate::pair::Pair;
use crate::stages::clearance::{Clearance, Instant, ROWS};
use nalgebra::{Matrix3, SVector, Vector3};
use remora_qp::QpStage;
use remora_qp::dense::clamp;

/// What the pointing row is divided by, in cosine.
const COSINE_SCALE: f64 = 0.1;

/// What clearance rows are divided by [m].
const CLEARANCE_SCALE: f64 = 0.1;

/// Distance beyond the margin from which on bodies do not matter to a subproblem [m].
const NEAR: f64 = 0.3;

/// Instants about a node at which clearances are looked at, in intervals: with those of the next
/// node they divide the interval into thirds.
const AROUND: [f64; 3] = [0.0, -1.0 / 3.0, 1.0 / 3.0];

/// Share of its margin by which a row may be violated: margins are there for more than that.
const SHARE_OF_MARGIN: f64 = 0.1;

/// A clearance row before it is scaled.
#[derive(Clone, Copy)]
struct ClearanceRow<const NL: usize> {
    /// Margin less distance [m].
    value: f64,
    /// Time from the node at which it is so [s].
    ahead: f64,
    nearest: Clearance<NL>,
}

impl<const NL: usize> ClearanceRow<NL> {
    /// Whether this row counts rather than the other; one that is not a number does.
    fn is_nearer(&self, other: &Self) -> bool {
        !(self.value <= other.value)
    }
}

impl<P: Pair, const N: usize, const NL: usize, const NX: usize, const NU: usize>
    Reorientation<'_, P, N, NL, NX, NU>
{
    /// Values of the rows of node `k`, scaled.
    pub(super) fn row_values(&self, k: usize, state: &State<NL>, out: &mut SVector<f64, NG>) {
        out[0] = self.pointing_row(k, state).0;
        for (g, row) in self.clearance_rows(k, state).iter().enumerate() {
            out[1 + g] = row.value / CLEARANCE_SCALE;
        }
    }

    /// Fills the rows of node `k`; those with nothing near stay inactive.
    // Its frame is not below the dynamics' derivatives, where the stack is deepest.
    #[inline(never)]
    pub(super) fn fill_rows(&self, k: usize, state: &State<NL>, stage: &mut QpStage<NX, NU, NG>) {
        let angle = self.typical.angle;
        let (offset, gradient) = self.pointing_row(k, state);
        let gradient = self.axes(k).tr_mul(&gradient) * angle;
        stage.path_offset[0] = offset;
        for i in 0..3 {
            stage.path_jacobian[(0, i)] = gradient[i];
        }
        let (rate, joint_rate) = (self.typical.rate, self.typical.joint_rate);
        for (g, row) in self.clearance_rows(k, state).iter().enumerate() {
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
                stage.path_jacobian[(1 + g, 6 + NL + i)] = by * row.ahead * joint_rate;
            }
        }
    }

    /// Scaled values up to which the rows of node `k` count as met: their tolerance, or a share of
    /// the margin that planning keeps.
    pub(super) fn row_tolerances(&self, k: usize) -> SVector<f64, NG> {
        let t = &self.mission.tolerances;
        let share = self.mission.approach.margin_share(k as f64 * self.stepping.dt, N);
        let clearance = self.clearance.unwrap_or(0.0) * share * SHARE_OF_MARGIN;
        let mut out = SVector::repeat(t.clearance.max(clearance) / CLEARANCE_SCALE);
        out[0] = t.pointing / COSINE_SCALE;
        out
    }

    /// Cosine of the field of view in planning at node `k`.
    fn cos_field_of_view(&self, k: usize) -> f64 {
        let approach = &self.mission.approach;
        let margin = if self.has_margins { self.margins.field_of_view } else { 0.0 };
        let share = approach.margin_share(k as f64 * self.stepping.dt, N);
        libm::cos(approach.field_of_view_half_angle - margin * share)
    }

    /// Pointing row `cos(fov) - sight . R b` and its gradient by the attitude step.
    fn pointing_row(&self, k: usize, state: &State<NL>) -> (f64, Vector3<f64>) {
        let boresight =
            quaternion::rotation_matrix(&state.attitude) * self.mission.servicer.boresight;
        let gradient = self.sight[k].cross(&boresight);
        (
            (self.cos_field_of_view(k) - self.sight[k].dot(&boresight)) / COSINE_SCALE,
            gradient / COSINE_SCALE,
        )
    }

    /// What planning keeps between bodies at `time` [m].
    fn clearance_at(&self, margin: f64, time: f64) -> f64 {
        let left = (self.mission.approach.duration - time) / self.stepping.dt;
        margin * self.mission.approach.margin_share(time, N)
            + self.extra_clearance * clamp(left - 1.0, 0.0, 1.0)
    }

    /// The nearest pair of each group about node `k`, at rates held, and the nearest of what is
    /// left: the same group's at another instant, mostly. Without it a step away from the one runs
    /// into the other. None at the ends of the horizon, where all is given.
    fn clearance_rows(&self, k: usize, state: &State<NL>) -> [ClearanceRow<NL>; ROWS] {
        let far = ClearanceRow { value: -NEAR, ahead: 0.0, nearest: Clearance::FAR };
        let mut rows = [far; ROWS];
        let (Some(margin), true) = (self.clearance, k > 0 && k + 1 < N) else { return rows };
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
            let [first, others, next] = &mut rows;
            for (row, nearest) in [first, others].into_iter().zip(found) {
                let mut left = ClearanceRow { value: margin - nearest.distance, ahead, nearest };
                if left.is_nearer(row) {
                    core::mem::swap(&mut left, row);
                }
                if left.is_nearer(next) {
                    *next = left;
                }
            }
        }
        rows
    }

    /// Where things are `ahead` seconds from node `k` (less than an interval).
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

    /// Adds the curvature of the pointing row.
    // Likewise.
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
        let angle = self.typical.angle;
        let block = axes.tr_mul(&(second * axes)) * (multiplier * angle * angle / COSINE_SCALE);
        for i in 0..3 {
            for j in 0..3 {
                stage.hessian_xx[(i, j)] += block[(i, j)];
            }
        }
    }
}
