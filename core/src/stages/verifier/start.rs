//! The start: section 8 a second time, and which limits a given start violates.

use super::distance::point_to_box;
use super::posture::initial_bus_attitude;
use super::residuals::{beyond_stops, excess};
use crate::dynamics::State;
use crate::math::quaternion;
use crate::model::{Grid, Mission, Scenario, TargetState};
use nalgebra::{Matrix3, Vector3, Vector4};
use remora_qp::dense::divisor;

/// The state that Stage 2 begins with.
pub(super) fn initial_state<const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
) -> State<NL> {
    let start = &scenario.start;
    State {
        attitude: start.bus_attitude.unwrap_or_else(|| initial_bus_attitude(&scenario.position)),
        joint_angle: start.joint_angle.unwrap_or(mission.servicer.initial_joint_angle_rad),
        rate: start.bus_rate,
        joint_rate: start.joint_rate,
    }
}

/// Limits that a given start violates by more than their tolerance. Until recovery is over they are
/// not in force.
pub(super) struct Beyond<const NL: usize> {
    pub joint: [bool; NL],
    pub joint_rate: [bool; NL],
    pub pointing: bool,
    pub keep_out: bool,
}

impl<const NL: usize> Beyond<NL> {
    /// With the limits that node 1 violates under Euler, whose pose there follows from the start's rates:
    /// `position` and `target` are those of node 1, `dt` after the start [s].
    pub fn and_euler_pose(
        mut self,
        mission: &Mission<NL>,
        scenario: &Scenario<NL>,
        dt: f64,
        position: &Vector3<f64>,
        target: &TargetState,
    ) -> Self {
        let (s, t) = (&mission.servicer, &mission.tolerances);
        let x = initial_state(mission, scenario);
        for i in 0..NL {
            let angle = x.joint_angle[i] + dt * x.joint_rate[i];
            let (lower, upper) = (s.min_joint_angle_rad[i], s.max_joint_angle_rad[i]);
            self.joint[i] |= beyond_stops(angle, lower, upper) > t.joint_rad;
        }
        // A chord of the quaternion's circle, back on it: less than the rate's own turn.
        let speed = libm::sqrt(x.rate.dot(&x.rate));
        let turn = 2.0 * libm::atan(0.5 * dt * speed);
        let axis = if speed > 0.0 { x.rate / divisor(speed) } else { Vector3::z() };
        let turned = quaternion::rotation_matrix(&quaternion::exp(&(axis * turn)))
            * quaternion::rotation_matrix(&x.attitude);
        let seen = seen(mission, &target.attitude, position, &turned);
        let cosine = libm::cos(mission.approach.field_of_view_half_angle_rad);
        self.pointing |= cosine - seen > t.pointing;
        self
    }

    pub fn of(mission: &Mission<NL>, scenario: &Scenario<NL>, grid: &Grid) -> Self {
        let is_given = scenario.start.is_given();
        let (s, t) = (&mission.servicer, &mission.tolerances);
        let x = initial_state(mission, scenario);
        let target = quaternion::rotation_matrix(&scenario.target_attitude);
        let local = target.transpose() * scenario.position;
        let (distance, _) = point_to_box(&mission.target.half_extents_m, &local, &local);
        let bus = quaternion::rotation_matrix(&x.attitude);
        let seen = seen(mission, &scenario.target_attitude, &scenario.position, &bus);
        let cosine = libm::cos(mission.approach.field_of_view_half_angle_rad);
        Self {
            joint: core::array::from_fn(|i| {
                let (lower, upper) = (s.min_joint_angle_rad[i], s.max_joint_angle_rad[i]);
                is_given && beyond_stops(x.joint_angle[i], lower, upper) > t.joint_rad
            }),
            joint_rate: core::array::from_fn(|i| {
                is_given
                    && excess(&[x.joint_rate[i]], &[s.joint_rate_limit_rad_s[i]]) > t.joint_rate
            }),
            pointing: is_given && cosine - seen > t.pointing,
            keep_out: is_given && grid.keep_out(0) - distance > t.keep_out_m,
        }
    }
}

/// Cosine between boresight and line of sight to the port, from a bus of this rotation at `position`.
fn seen<const NL: usize>(
    mission: &Mission<NL>,
    target: &Vector4<f64>,
    position: &Vector3<f64>,
    bus: &Matrix3<f64>,
) -> f64 {
    let sight = quaternion::rotation_matrix(target) * mission.target.port_position_m - position;
    sight.dot(&(bus * mission.servicer.boresight)) / divisor(libm::sqrt(sight.dot(&sight)))
}
