//! Distances of the servicer's bodies from the target and from each other, with exact gradients:
//! the clearance rows of Stage 2.
//!
//! Bodies are boxes (target, bus) and capsules (links with a length: one without has no body). The nearest pair of each of two groups
//! counts, and the nearest of what is left, so that rows, memory and time stay bounded:
//!
//! - the last link and the end effector against the target;
//! - all else: the bus and the other links against the target, and the arm beyond its first link,
//!   which is mounted there, against the bus.
//!
//! The verifier has its own distances ([`super::verifier`]).

use crate::dynamics::{ArmPose, Multibody, State};
use crate::math::quaternion;
use crate::model::{
    Corridor, Link, Mission, SignedDistance, segment_to_box, signed_distance_to_box,
};
use nalgebra::{Matrix3, SVector, Vector3, Vector4};
use remora_qp::dense::divisor;

/// Groups of pairs of bodies.
pub(super) const GROUPS: usize = 2;

/// Rows a node: the nearest pair of each group, and the nearest of what is left.
pub(super) const CONSTRAINTS: usize = GROUPS + 1;

/// A distance and its gradient by a turn of the whole servicer about its centre of mass (RTN) and
/// by the joint angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<const NL: usize> {
    pub distance: f64,
    pub by_turn: Vector3<f64>,
    pub by_joint: SVector<f64, NL>,
}

impl<const NL: usize> Clearance<NL> {
    /// Nothing near.
    pub const FAR: Self = Self {
        distance: f64::INFINITY,
        by_turn: Vector3::new(0.0, 0.0, 0.0),
        by_joint: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };

    fn keep_nearer(&mut self, other: Self) {
        // A distance that is not a number must not be lost.
        if !(other.distance >= self.distance) {
            *self = other;
        }
    }
}

/// Where things are at one instant.
pub(super) struct Instant<'a, const NL: usize> {
    /// Attitude and arm.
    pub state: &'a State<NL>,
    /// The servicer's centre of mass, RTN [m].
    pub position: Vector3<f64>,
    /// The target's attitude, body to RTN.
    pub target: Vector4<f64>,
}

/// Geometry of servicer and target.
pub(super) struct Bodies<const NL: usize> {
    target_half: Vector3<f64>,
    bus_half: Vector3<f64>,
    radius: [f64; NL],
    /// Which links have a length, and with it a body.
    has_length: [bool; NL],
    /// The first of them, which is mounted on the bus, and the last, which ends in the end effector.
    mounted: usize,
    last: usize,
    /// Share of the last link that counts as a capsule before the target.
    last_share: f64,
    port: Vector3<f64>,
    normal: Vector3<f64>,
    corridor: Corridor,
    /// Sphere about the servicer's centre of mass that holds all of it, whatever the pose [m].
    reach: f64,
    /// Sphere about the target [m].
    target_radius: f64,
}

impl<const NL: usize> Bodies<NL> {
    pub fn new(mission: &Mission<NL>) -> Self {
        let (servicer, target) = (&mission.servicer, &mission.target);
        let norm = |v: &Vector3<f64>| libm::sqrt(v.dot(v));
        let [mounted, last] = servicer.ends_with_length();
        let length = |link: &Link| {
            let [near, far] = link.capsule(&Vector3::zeros(), &link.tip_m, |v| *v);
            norm(&(far - near))
        };
        let last_length = servicer.links.get(last).map_or(0.0, length);
        let cut = mission.corridor.end_effector_length_m;
        // The bus's centre is nowhere further from the system's than the arm's moment can put it.
        let (mut arm, mut moment, mut wide) = (norm(&servicer.arm_base_m), 0.0, 0.0);
        for link in &servicer.links {
            moment += link.mass_kg * (arm + norm(&link.center_of_mass_m));
            arm += norm(&link.tip_m);
            let off = f64::max(norm(&link.capsule_start_m), norm(&link.capsule_end_m));
            wide = f64::max(wide, link.radius_m + off);
        }
        let body = norm(&servicer.bus_half_extents_m).max(arm + wide);
        Self {
            target_half: target.half_extents_m,
            bus_half: servicer.bus_half_extents_m,
            radius: core::array::from_fn(|i| servicer.links[i].radius_m),
            has_length: core::array::from_fn(|i| servicer.links[i].has_length()),
            mounted,
            last,
            last_share: if last_length > cut { 1.0 - cut / divisor(last_length) } else { 0.0 },
            port: target.port_position_m,
            normal: target.port_normal,
            corridor: mission.corridor,
            reach: body + moment / servicer.total_mass(),
            target_radius: norm(&target.half_extents_m),
        }
    }

    /// The nearest pair of each group; groups with nothing within `horizon` [m] are left far.
    ///
    /// Cost: about a microsecond near the target; two sines a link where it is far.
    // Its memory is on the stack only while it runs.
    #[inline(never)]
    pub fn clearances(
        &self,
        body: &Multibody<'_, NL>,
        at: &Instant<NL>,
        horizon: f64,
    ) -> [Clearance<NL>; GROUPS] {
        let mut nearest = [Clearance::FAR; GROUPS];
        let arm = body.arm_pose(&at.state.joint_angle);
        let rotation = quaternion::rotation_matrix(&at.state.attitude);
        nearest[1] = self.own(&arm);
        let apart = libm::sqrt(at.position.dot(&at.position)) - self.target_radius - self.reach;
        if apart > horizon {
            return nearest;
        }
        let target = quaternion::rotation_matrix(&at.target);
        let frame = Frame { arm: &arm, rotation, position: at.position, target };
        nearest[0] = self.end_effector(&frame);
        self.others(&frame, horizon, &mut nearest[1]);
        nearest
    }

    /// The arm, end effector included, against its own bus: a matter of the joint angles alone.
    fn own(&self, arm: &ArmPose<NL>) -> Clearance<NL> {
        let mut nearest = Clearance::FAR;
        for i in 0..NL {
            if i <= self.mounted || !self.has_length[i] {
                continue;
            }
            let [start, end] = &arm.capsule[i];
            let near = segment_to_box(&self.bus_half, start, end);
            if !(near.value - self.radius[i] >= nearest.distance) {
                nearest = Clearance {
                    distance: near.value - self.radius[i],
                    by_turn: Vector3::zeros(),
                    by_joint: arm.point_by_joint(Some(i), &near.point).tr_mul(&near.gradient),
                };
            }
        }
        nearest
    }

    /// Ends of a link's capsule before the target, bus axes.
    fn capsule(&self, arm: &ArmPose<NL>, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let share = if i == self.last { self.last_share } else { 1.0 };
        let [start, end] = arm.capsule[i];
        (start, start + (end - start) * share)
    }

    /// The last link and the end effector against the target.
    fn end_effector(&self, frame: &Frame<NL>) -> Clearance<NL> {
        let last = self.last;
        if last >= NL {
            return Clearance::FAR;
        }
        let mut nearest = self.link(frame, last);
        let tip = frame.arm.tip(last);
        let local = frame.to_target(&tip);
        let free = signed_distance_to_box(&self.target_half, &local);
        let free = SignedDistance { value: free.value - self.radius[last], ..free };
        let inside = self.corridor(&local);
        // Clear of the target, or in the corridor: the better of the two.
        let better = if inside.value > free.value { inside } else { free };
        nearest.keep_nearer(frame.clearance(Some(last), &tip, better));
        nearest
    }

    /// How far a point (target axes) is within the corridor: from the cone's side, or above the
    /// port's plane.
    fn corridor(&self, point: &Vector3<f64>) -> SignedDistance {
        let (sin, cos) = libm::sincos(self.corridor.half_angle_rad);
        let from_port = point - self.port;
        let height = self.normal.dot(&from_port);
        let across = from_port - self.normal * height;
        let radius = libm::sqrt(across.dot(&across));
        let outward = if radius > 0.0 { across / divisor(radius) } else { Vector3::zeros() };
        let apex = self.corridor.mouth_radius_m * cos / sin;
        let side = (height + apex) * sin - radius * cos;
        if side < height {
            SignedDistance { value: side, gradient: self.normal * sin - outward * cos }
        } else {
            SignedDistance { value: height, gradient: self.normal }
        }
    }

    /// The other links and the bus against the target.
    fn others(&self, frame: &Frame<NL>, horizon: f64, nearest: &mut Clearance<NL>) {
        for i in 0..NL {
            if i < self.last && self.has_length[i] {
                nearest.keep_nearer(self.link(frame, i));
            }
        }
        let bus = frame.to_target(&Vector3::zeros());
        let half = libm::sqrt(self.bus_half.dot(&self.bus_half));
        let apart = signed_distance_to_box(&self.target_half, &bus).value - half;
        if !(apart > horizon.min(nearest.distance)) {
            self.bus(frame, nearest);
        }
    }

    /// A link against the target.
    fn link(&self, frame: &Frame<NL>, i: usize) -> Clearance<NL> {
        let (start, end) = self.capsule(frame.arm, i);
        let near =
            segment_to_box(&self.target_half, &frame.to_target(&start), &frame.to_target(&end));
        let distance =
            SignedDistance { value: near.value - self.radius[i], gradient: near.gradient };
        frame.clearance(Some(i), &frame.in_bus(&near.point), distance)
    }

    /// The bus against the target: two boxes are nearest at an edge of one of them.
    fn bus(&self, frame: &Frame<NL>, nearest: &mut Clearance<NL>) {
        for (start, end) in edges(&self.bus_half) {
            let near =
                segment_to_box(&self.target_half, &frame.to_target(&start), &frame.to_target(&end));
            if !(near.value >= nearest.distance) {
                let distance = SignedDistance { value: near.value, gradient: near.gradient };
                *nearest = frame.clearance(None, &frame.in_bus(&near.point), distance);
            }
        }
        for (start, end) in edges(&self.target_half) {
            let near = segment_to_box(&self.bus_half, &frame.in_bus(&start), &frame.in_bus(&end));
            if !(near.value >= nearest.distance) {
                // The bus moves, not the target: the gradient is that of the bus's surface, reversed.
                let distance = SignedDistance {
                    value: near.value,
                    gradient: -frame.direction_to_target(&near.gradient),
                };
                *nearest = frame.clearance(None, &near.point, distance);
            }
        }
    }
}

/// The twelve edges of a box.
fn edges(half: &Vector3<f64>) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + use<> {
    let half = *half;
    (0..12).map(move |k| {
        let (axis, corner) = (k / 4, k % 4);
        let sign = |bit: usize| if corner & bit == 0 { -1.0 } else { 1.0 };
        let mut start = half;
        start[axis] = -half[axis];
        start[(axis + 1) % 3] *= sign(1);
        start[(axis + 2) % 3] *= sign(2);
        let mut end = start;
        end[axis] = half[axis];
        (start, end)
    })
}

/// The servicer before the target.
struct Frame<'a, const NL: usize> {
    arm: &'a ArmPose<NL>,
    /// Bus axes to RTN.
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
    /// Target axes to RTN.
    target: Matrix3<f64>,
}

impl<const NL: usize> Frame<'_, NL> {
    /// A point from the bus's centre (bus axes) in target axes.
    fn to_target(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let rtn = self.position + self.rotation * (point - self.arm.center);
        self.target.tr_mul(&rtn)
    }

    /// The inverse of [`Frame::to_target`].
    fn in_bus(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let rtn = self.target * point - self.position;
        self.rotation.tr_mul(&rtn) + self.arm.center
    }

    /// A direction in bus axes in target axes.
    fn direction_to_target(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        self.target.tr_mul(&(self.rotation * direction))
    }

    /// The clearance of a point (bus axes) of a link, or of the bus, whose distance has this
    /// gradient in target axes.
    fn clearance(
        &self,
        link: Option<usize>,
        point: &Vector3<f64>,
        distance: SignedDistance,
    ) -> Clearance<NL> {
        let normal = self.target * distance.gradient;
        let lever = self.rotation * (point - self.arm.center);
        let in_bus = self.rotation.tr_mul(&normal);
        Clearance {
            distance: distance.value,
            // Turned about the centre of mass the point moves by `turn x lever`.
            by_turn: lever.cross(&normal),
            by_joint: (self.arm.point_by_joint(link, point) - self.arm.center_by_joint)
                .tr_mul(&in_bus),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::TargetState;
    use crate::stages::clearances_at;
    use proptest::prelude::*;

    type Body<'a> = (Bodies<3>, Multibody<'a, 3>);

    fn body(mission: &Mission<3>) -> Body<'_> {
        (Bodies::new(mission), Multibody::new(mission))
    }

    fn state(q: [f64; 4], angle: [f64; 3]) -> State<3> {
        State {
            attitude: quaternion::normalized(&Vector4::from(q)),
            joint_angle: SVector::from(angle),
            ..State::ZERO
        }
    }

    /// At capture the gripper touches the port within the corridor, and nothing else is near.
    #[test]
    fn at_capture_only_the_end_effector_is_near() {
        let mission = Mission::default();
        let (bodies, body) = body(&mission);
        let geometry = mission.servicer.capture_geometry();
        let turn = quaternion::between(&geometry.direction, &-Vector3::z());
        let mut state = State { attitude: turn, ..State::ZERO };
        state.joint_angle = mission.servicer.capture_joint_angle_rad;
        let position = Vector3::new(0.0, 0.0, 0.2 + geometry.reach);
        let at = Instant { state: &state, position, target: quaternion::IDENTITY };
        let [effector, others] = bodies.clearances(&body, &at, 1.0);
        assert!(effector.distance.abs() < 1e-9, "{}", effector.distance);
        assert!(others.distance > 0.1);
    }

    /// Planner and verifier find a capsule beside its joints where it is.
    #[test]
    fn a_capsule_beside_its_joints_is_where_the_link_says() {
        let mut mission = Mission::default();
        let link = &mut mission.servicer.links[1];
        (link.capsule_start_m, link.capsule_end_m) =
            (Vector3::new(0.6, 0.0, -0.5), Vector3::new(0.6, 0.0, 0.0));
        let (bodies, body) = body(&mission);
        let (state, target) = (State::ZERO, TargetState::ZERO);
        let position = Vector3::new(0.0, 0.0, -50.0);
        let at = Instant { state: &state, position, target: target.attitude };
        let [_, others] = bodies.clearances(&body, &at, 1.0);
        // The joint is 0.866 m above the bus's centre: 0.366 m is within its height, and 0.1 m beside it.
        assert!((others.distance - 0.05).abs() < 1e-12, "{}", others.distance);
        let found = clearances_at(&mission, 0.0, &target, &position, &state);
        assert!((found.own.distance - 0.05).abs() < 1e-12, "{}", found.own.distance);
    }

    fn directional(
        (bodies, body): &Body,
        state: &State<3>,
        at: (&Vector3<f64>, &Vector4<f64>),
        turn: &Vector3<f64>,
        bend: &SVector<f64, 3>,
    ) -> [f64; GROUPS] {
        let mut moved = *state;
        moved.attitude = quaternion::product(&quaternion::exp(turn), &state.attitude);
        moved.joint_angle += bend;
        let at = Instant { state: &moved, position: *at.0, target: *at.1 };
        bodies.clearances(body, &at, f64::INFINITY).map(|c| c.distance)
    }

    proptest! {
        #[test]
        fn gradients_are_those_of_differences(
            q in prop::array::uniform4(-1.0..1.0f64).prop_filter("zero", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.1),
            p in prop::array::uniform4(-1.0..1.0f64).prop_filter("zero", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.1),
            angle in prop::array::uniform3(-1.5..1.5f64),
            r in prop::array::uniform3(-2.0..2.0f64),
            turn in prop::array::uniform3(-1.0..1.0f64),
            bend in prop::array::uniform3(-1.0..1.0f64),
            ends in prop::array::uniform6(-0.3..0.3f64),
        ) {
            let mut mission = Mission::default();
            let [a, b, c, d, e, f] = ends;
            for link in &mut mission.servicer.links[1..] {
                (link.capsule_start_m, link.capsule_end_m) =
                    (Vector3::new(a, b, c), Vector3::new(d, e, f));
            }
            let b = body(&mission);
            let state = state(q, angle);
            let target = quaternion::normalized(&Vector4::from(p));
            let position = Vector3::from(r);
            let (turn, bend) = (Vector3::from(turn), SVector::from(bend));
            let at = Instant { state: &state, position, target };
            let exact = b.0.clearances(&b.1, &at, f64::INFINITY);
            let h = 1e-6;
            let value = |s: f64| directional(&b, &state, (&position, &target), &(turn * s), &(bend * s));
            let (minus, plus) = (value(-h), value(h));
            for g in 0..GROUPS {
                let slope = exact[g].by_turn.dot(&turn) + exact[g].by_joint.dot(&bend);
                let (up, down) = ((plus[g] - exact[g].distance) / h, (exact[g].distance - minus[g]) / h);
                // Kinks apart, where one pair gives way to another.
                if (up - down).abs() < 1e-3 {
                    prop_assert!((slope - 0.5 * (up + down)).abs() < 1e-3, "{g}: {slope} {up} {down}");
                }
            }
        }
    }
}
