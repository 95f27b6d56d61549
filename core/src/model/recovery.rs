//! A start beyond a limit: what of it is led back, and until when.

use super::{Mission, Scenario, initial_bus_attitude, signed_distance_to_box};
use crate::math::quaternion;
use nalgebra::{SVector, Vector3, Vector4};
use remora_qp::dense::divisor;

/// The limits that a given start violates. They hold from
/// [`Grid::recovery_node`](super::Grid::recovery_node) on; a plan may leave them so long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recovery<const NL: usize> {
    /// Stop, joint by joint.
    pub joint: [bool; NL],
    /// Joint rate limit, joint by joint.
    pub joint_rate: [bool; NL],
    /// Field of view.
    pub pointing: bool,
    /// Keep-out distance.
    pub keep_out: bool,
}

impl<const NL: usize> Recovery<NL> {
    /// Nothing to recover.
    pub const NONE: Self =
        Self { joint: [false; NL], joint_rate: [false; NL], pointing: false, keep_out: false };

    /// With the limits that a pose violates, too: joint angles [rad], and the cosine between boresight and
    /// line of sight.
    pub(crate) fn and_pose(
        mut self,
        mission: &Mission<NL>,
        joint_angle: &SVector<f64, NL>,
        seen: f64,
    ) -> Self {
        let (s, t) = (&mission.servicer, &mission.tolerances);
        for (i, is_beyond) in self.joint.iter_mut().enumerate() {
            *is_beyond |= s.beyond_stop(i, joint_angle[i]) > t.joint_rad;
        }
        let cosine = libm::cos(mission.approach.field_of_view_half_angle_rad);
        self.pointing |= seen < cosine - t.pointing;
        self
    }

    /// Which limits, a bit each, in the order of [`RECOVERY_NAMES`].
    pub fn code(&self) -> u32 {
        let any = |joints: &[bool]| joints.iter().any(|is_beyond| *is_beyond);
        let limits = [any(&self.joint), any(&self.joint_rate), self.pointing, self.keep_out];
        limits
            .iter()
            .enumerate()
            .fold(0, |code, (bit, is_beyond)| code | u32::from(*is_beyond) << bit)
    }
}

/// Names of the limits, in the order of their bits: those of the residuals.
pub const RECOVERY_NAMES: [&str; 4] = ["joint", "joint_rate", "pointing", "keep_out"];

impl<const NL: usize> Mission<NL> {
    /// Bus attitude of a scenario at t = 0, body to RTN.
    pub fn bus_attitude_at_start(&self, scenario: &Scenario<NL>) -> Vector4<f64> {
        let given = scenario.start.bus_attitude;
        given.unwrap_or_else(|| initial_bus_attitude(&scenario.position))
    }

    /// Joint angles of a scenario at t = 0 [rad].
    pub fn joint_angle_at_start(&self, scenario: &Scenario<NL>) -> SVector<f64, NL> {
        scenario.start.joint_angle.unwrap_or(self.servicer.initial_joint_angle_rad)
    }

    /// Signed distance of the centre of mass from the target's box at t = 0 [m].
    pub fn distance_at_start(&self, scenario: &Scenario<NL>) -> f64 {
        let rotation = quaternion::rotation_matrix(&scenario.target_attitude);
        let local = rotation.transpose() * scenario.position;
        signed_distance_to_box(&self.target.half_extents_m, &local).value
    }

    /// Cosine of the angle between boresight and port at t = 0.
    pub fn pointing_at_start(&self, scenario: &Scenario<NL>) -> f64 {
        let rotation = quaternion::rotation_matrix(&scenario.target_attitude);
        let sight: Vector3<f64> = rotation * self.target.port_position_m - scenario.position;
        let bus = quaternion::rotation_matrix(&self.bus_attitude_at_start(scenario));
        sight.dot(&(bus * self.servicer.boresight)) / divisor(libm::sqrt(sight.dot(&sight)))
    }

    /// The limits that a given start violates, by more than the verifier's tolerance; none of the
    /// default start, which is refused instead ([`Mission::check`]).
    pub fn recovery(&self, scenario: &Scenario<NL>, keep_out: f64) -> Recovery<NL> {
        let Scenario { start, .. } = scenario;
        if !start.is_given() {
            return Recovery::NONE;
        }
        let (s, t) = (&self.servicer, &self.tolerances);
        let start_only = Recovery {
            joint: [false; NL],
            joint_rate: core::array::from_fn(|i| {
                start.joint_rate[i].abs() > s.joint_rate_limit_rad_s[i] * (1.0 + t.joint_rate)
            }),
            pointing: false,
            keep_out: self.distance_at_start(scenario) < keep_out - t.keep_out_m,
        };
        let seen = self.pointing_at_start(scenario);
        start_only.and_pose(self, &self.joint_angle_at_start(scenario), seen)
    }
}
