//! How near bus and arm come to the target, and the arm to its own bus.

use super::Instant;
use super::distance::{Placed, box_to_box, point_to_box, segment_to_box};
use super::posture::Posture;
use super::residuals::{ArmClearances, Clearances, Closest, Residuals, Verification};
use crate::math::quaternion;
use crate::model::{Link, Mission};
use crate::stages::worse;
use nalgebra::Vector3;
use remora_qp::dense::divisor;

/// The bodies, and how near they were so far.
///
/// Target and bus are boxes. Links with a length are capsules, the last one before the target without the end
/// effector's length at its end: there the end effector is a point with the corridor to the port as
/// its way.
pub(super) struct Bodies<'a, const NL: usize> {
    pub mission: &'a Mission<NL>,
    pub found: Clearances,
    pub arm: ArmClearances,
}

impl<'a, const NL: usize> Bodies<'a, NL> {
    /// Initial value, before any pair was checked.
    pub fn new(mission: &'a Mission<NL>) -> Self {
        Self { mission, found: Clearances::NONE, arm: ArmClearances::NONE }
    }

    /// Result, with the residuals.
    pub fn with(&self, residuals: Residuals) -> Verification {
        Verification { residuals, clearances: self.found, arm: self.arm }
    }

    /// Looks at one instant. Cost: one point a pair that is further apart than the nearest so far
    /// (and the bus and the target at that, which then are one pair), up to 40 points for each of
    /// the others; two boxes are 30 pairs.
    pub fn look(&mut self, at: &Instant<'_, NL>) {
        let (servicer, target) = (&self.mission.servicer, &self.mission.target);
        let posture = Posture::new(servicer, &at.state.joint_angle);
        let to_target = quaternion::rotation_matrix(&at.target.attitude).transpose();
        let rotation = to_target * quaternion::rotation_matrix(&at.state.attitude);
        let center = to_target * at.position - rotation * posture.center;
        let placed = |p: &Vector3<f64>| center + rotation * p;

        let bus = Placed { half: &servicer.bus_half_extents_m, rotation, center };
        let distance = box_to_box(&target.half_extents_m, &bus, self.found.bus.distance);
        let closest = |distance, body| Closest { distance, time_s: at.time_s, body };
        self.found.bus = self.found.bus.or(closest(distance, 0));

        let (mut body, mut last, mut is_mounted) = (0, 0, true);
        let of = |found: Option<usize>| found.map_or(NL, |i| i + 1);
        let gripping = of(servicer.links.iter().rposition(has_length));
        let mut radius = 0.0;
        for (link, [start, end]) in servicer.links.iter().zip(&posture.capsules) {
            body += 1;
            if !has_length(link) {
                continue;
            }
            (last, radius) = (body, link.radius_m);
            let is_last = body as usize == gripping;
            let gripper = if is_last { self.mission.corridor.end_effector_length_m } else { 0.0 };
            let short = shortened(start, end, gripper);
            let cutoff = self.arm.links.distance + link.radius_m;
            let (a, b) = (placed(start), placed(&short));
            let distance = segment_to_box(&target.half_extents_m, &a, &b, cutoff) - link.radius_m;
            self.arm.links = self.arm.links.or(closest(distance, body));
            self.found.arm = self.found.arm.or(closest(distance, body));
            // The first link that reaches anywhere is mounted on the bus.
            if !is_mounted {
                let cutoff = self.found.own.distance + link.radius_m;
                let half = &servicer.bus_half_extents_m;
                let distance = segment_to_box(half, start, end, cutoff) - link.radius_m;
                self.found.own = self.found.own.or(closest(distance, body));
            }
            is_mounted = false;
        }
        let distance = self.end_effector(&placed(&posture.tip), radius);
        self.arm.end_effector = self.arm.end_effector.or(closest(distance, last));
        self.found.arm = self.found.arm.or(closest(distance, last));
    }

    /// Distance of the end effector at `tip` (target axes) from where it must not be [m]: anywhere
    /// it may be as far from the box as a link of `radius`; in the corridor, in front of the port.
    pub(super) fn end_effector(&self, tip: &Vector3<f64>, radius: f64) -> f64 {
        let (target, corridor) = (&self.mission.target, &self.mission.corridor);
        let (free, _) = point_to_box(&target.half_extents_m, tip, tip);
        let normal = &target.port_normal;
        let (sin, cos) = libm::sincos(corridor.half_angle_rad);
        let apex = target.port_position_m - normal * (corridor.mouth_radius_m * cos / sin);
        let from_apex = tip - apex;
        let along = from_apex.dot(normal);
        let across = from_apex - normal * along;
        let cone = along * sin - libm::sqrt(across.dot(&across)) * cos;
        let height = (tip - target.port_position_m).dot(normal);
        let before = height + self.mission.tolerances.ee_position_m;
        let inside = -worse(-cone, -before);
        worse(free - radius, inside)
    }
}

/// Whether a link reaches from its joint to another point: one that does not has no body.
fn has_length(link: &Link) -> bool {
    link.tip_m.amax() > 0.0
}

/// The end of a link less `gripper` of its length, its joint where it is no longer than that.
fn shortened(joint: &Vector3<f64>, end: &Vector3<f64>, gripper: f64) -> Vector3<f64> {
    let link = end - joint;
    let length = libm::sqrt(link.dot(&link));
    if gripper < length || length.is_nan() {
        end - link * (gripper / divisor(length))
    } else {
        *joint
    }
}
