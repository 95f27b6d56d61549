//! The bodies of a plan in space, and the plane in which they are drawn.

use crate::formats::{JointVector, Mission, PlanFile};
use nalgebra::{Matrix3, Vector3, Vector4};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::Grid;

/// Most poses of the servicer that are drawn.
const MOST_POSES: f64 = 7.0;

/// A plan with what it was made for.
pub(super) struct Scene<'a> {
    pub plan: &'a PlanFile,
    pub mission: &'a Mission,
    pub grid: Grid,
}

/// A box.
pub(super) struct Cuboid {
    pub center: Vector3<f64>,
    turn: Matrix3<f64>,
    half_extents: Vector3<f64>,
}

/// The servicer at one node.
pub(super) struct Pose {
    pub time_s: f64,
    pub bus: Cuboid,
    /// The links, from the bus outwards; those without a length have no body.
    pub links: Vec<Link>,
    /// The servicer's centre of mass.
    pub center_of_mass: Vector3<f64>,
}

/// A link: its joint, and the capsule that holds it.
pub(super) struct Link {
    pub joint: Vector3<f64>,
    pub ends: [Vector3<f64>; 2],
    pub radius: f64,
}

impl Cuboid {
    /// Outward normal and corners of each face.
    pub fn faces(&self) -> impl Iterator<Item = (Vector3<f64>, [Vector3<f64>; 4])> {
        let axis = |i: usize| self.turn.column(i % 3) * self.half_extents[i % 3];
        (0..6).map(move |face| {
            let outward = axis(face) * if face < 3 { 1.0 } else { -1.0 };
            let corner =
                |a: f64, b: f64| self.center + outward + axis(face + 1) * a + axis(face + 2) * b;
            let corners = [corner(1., 1.), corner(-1., 1.), corner(-1., -1.), corner(1., -1.)];
            (outward, corners)
        })
    }

    /// Half its diagonal [m].
    pub fn radius(&self) -> f64 {
        self.half_extents.norm()
    }
}

impl Scene<'_> {
    /// Attitude of the target as a rotation matrix.
    pub fn target_turn(&self, node: usize) -> Matrix3<f64> {
        quaternion::rotation_matrix(&Vector4::from(self.plan.target.attitude[node]))
    }

    /// Attitude of the bus as a rotation matrix.
    pub fn bus_turn(&self, node: usize) -> Matrix3<f64> {
        quaternion::rotation_matrix(&Vector4::from(self.plan.stage2.attitude[node]))
    }

    /// The servicer's centre of mass.
    pub fn position(&self, node: usize) -> Vector3<f64> {
        Vector3::from(self.plan.stage1.position[node])
    }

    /// The target's box at capture.
    pub fn target(&self) -> Cuboid {
        let turn = self.target_turn(self.grid.last());
        let half_extents = self.mission.target.half_extents_m;
        Cuboid { center: Vector3::zeros(), turn, half_extents }
    }

    /// The port at capture, and a point before it.
    pub fn port(&self) -> [Vector3<f64>; 2] {
        let target = &self.mission.target;
        let before = target.port_position_m + 0.4 * target.port_normal;
        [target.port_position_m, before].map(|point| self.target_turn(self.grid.last()) * point)
    }

    /// The drawing's axes, to the right, up and towards the eye: the plane holds start and target, and the port's
    /// normal at capture points up.
    pub fn axes(&self) -> [Vector3<f64>; 3] {
        let right = self.position(0).normalize();
        let port = self.target_turn(self.grid.last()) * self.mission.target.port_normal;
        let up = port - right * right.dot(&port);
        let up = match up.norm() > 1e-3 {
            true => up.normalize(),
            false => quaternion::any_normal(&right),
        };
        [right, up, right.cross(&up)]
    }

    /// Bus and arm at a node.
    pub fn pose(&self, node: usize) -> Pose {
        let servicer = &self.mission.servicer;
        let given = &self.plan.stage2.joint_angle[node];
        let angles = JointVector::from_fn(|i, _| given.get(i).copied().unwrap_or(0.0));
        let offset = servicer.center_of_mass_and_end_effector(&angles).0;
        let (mut turn, center) = (self.bus_turn(node), self.position(node));
        let place = |point: Vector3<f64>| center + turn * (point - offset);
        let half_extents = servicer.bus_half_extents_m;
        let bus = Cuboid { center: place(Vector3::zeros()), turn, half_extents };
        let mut tip = place(servicer.arm_base_m);
        let mut links = Vec::new();
        for (link, angle) in servicer.links.iter().zip(given) {
            turn *= quaternion::rotation_matrix(&quaternion::exp(&(link.axis * *angle)));
            let joint = tip;
            tip += turn * link.tip_m;
            if link.has_length() {
                let ends = link.capsule(&joint, &tip, |v| turn * v);
                links.push(Link { joint, ends, radius: link.radius_m });
            }
        }
        Pose { time_s: self.grid.time(node), bus, links, center_of_mass: center }
    }

    /// First and last pose, and between them those that are far enough from each other to be told apart.
    pub fn poses(&self) -> Vec<Pose> {
        let last = self.grid.last();
        let [right, up, _] = self.axes();
        let flat = |node: usize| {
            let at = self.position(node);
            (right.dot(&at), up.dot(&at))
        };
        let apart = |a: usize, b: usize| {
            let (a, b) = (flat(a), flat(b));
            f64::hypot(a.0 - b.0, a.1 - b.1)
        };
        let way: f64 = (0..last).map(|k| apart(k, k + 1)).sum();
        let least =
            f64::max(way / MOST_POSES, 1.2 * self.mission.servicer.bus_half_extents_m.norm());
        let mut shown = vec![last];
        for node in (1..last).rev() {
            if shown.iter().chain(&[0]).all(|other| apart(node, *other) > least) {
                shown.push(node);
            }
        }
        shown.push(0);
        shown.into_iter().rev().map(|node| self.pose(node)).collect()
    }
}
