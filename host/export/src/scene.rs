//! Bodies and frames as Foxglove has them.
//!
//! The frames are a tree: `rtn` holds `target` and `bus`; `target` its `port`; `bus` holds `link1`, that
//! `link2` and so on, and the last one `end_effector`. Bodies stand still each in its frame.

use crate::motion::{Bodies, Link, Moment, Motion};
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, JointState,
    JointStates, LinePrimitive, Point3, Pose, PoseInFrame, Quaternion, SceneEntity, SceneUpdate,
    Timestamp, line_primitive,
};
use nalgebra::{Vector3, Vector4};
use remora_core::advanced::math::quaternion;

/// Colours: the target black, its port orange, bus and path blue, the arm green, as in the pictures of plans.
const TARGET: Color = Color { r: 0.25, g: 0.25, b: 0.25, a: 1.0 };
const PORT: Color = Color { r: 0.90, g: 0.50, b: 0.0, a: 1.0 };
const BUS: Color = Color { r: 0.12, g: 0.40, b: 0.75, a: 1.0 };
const ARM: Color = Color { r: 0.15, g: 0.60, b: 0.30, a: 1.0 };

/// Size of the port's mark and width of the path [m].
const PORT_RADIUS: f64 = 0.05;
const PORT_HEIGHT: f64 = 0.02;
const PATH_WIDTH: f64 = 0.02;

/// No rotation.
const STILL: Vector4<f64> = quaternion::IDENTITY;

fn vector(v: &Vector3<f64>) -> foxglove::messages::Vector3 {
    foxglove::messages::Vector3 { x: v.x, y: v.y, z: v.z }
}

fn rotation(q: &Vector4<f64>) -> Quaternion {
    Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }
}

fn pose(position: &Vector3<f64>, attitude: &Vector4<f64>) -> Option<Pose> {
    Some(Pose { position: Some(vector(position)), orientation: Some(rotation(attitude)) })
}

/// Name of the frame of a link, counted from zero.
fn link_frame(index: usize) -> String {
    format!("link{}", index + 1)
}

/// Where all frames are at one instant.
pub fn transforms(bodies: &Bodies, moment: &Moment, timestamp: Timestamp) -> FrameTransforms {
    let place =
        |parent: &str, child: &str, at: &Vector3<f64>, turn: &Vector4<f64>| FrameTransform {
            timestamp: Some(timestamp),
            parent_frame_id: parent.into(),
            child_frame_id: child.into(),
            translation: Some(vector(at)),
            rotation: Some(rotation(turn)),
        };
    let outward = quaternion::between(&Vector3::z(), &bodies.port_normal);
    let mut transforms = vec![
        place("rtn", "target", &Vector3::zeros(), &moment.target_attitude),
        place("target", "port", &bodies.port, &outward),
        place("rtn", "bus", &moment.bus_position, &moment.attitude),
    ];
    let mut parent = "bus".to_string();
    for (i, (link, angle)) in bodies.links.iter().zip(&moment.joints[0]).enumerate() {
        let turn = quaternion::exp(&(link.axis * *angle));
        transforms.push(place(&parent, &link_frame(i), &link.joint, &turn));
        parent = link_frame(i);
    }
    if let Some(last) = bodies.links.last() {
        transforms.push(place(&parent, "end_effector", &last.tip, &STILL));
    }
    FrameTransforms { transforms }
}

/// The bus's pose.
pub fn bus_pose(moment: &Moment, timestamp: Timestamp) -> PoseInFrame {
    let pose = pose(&moment.bus_position, &moment.attitude);
    PoseInFrame { timestamp: Some(timestamp), frame_id: "rtn".into(), pose }
}

/// The joints.
pub fn joint_states(moment: &Moment, timestamp: Timestamp) -> JointStates {
    let [angles, rates, torques] = &moment.joints;
    let joint = |i: usize| JointState {
        name: format!("joint{}", i + 1),
        position: angles.get(i).copied(),
        velocity: rates.get(i).copied(),
        acceleration: None,
        effort: torques.get(i).copied(),
    };
    JointStates { timestamp: Some(timestamp), joints: (0..angles.len()).map(joint).collect() }
}

/// All bodies, which stay from then on, and the path of the centre of mass.
pub fn bodies(motion: &Motion, timestamp: Timestamp) -> SceneUpdate {
    let entity = |id: &str, frame: &str| SceneEntity {
        timestamp: Some(timestamp),
        frame_id: frame.into(),
        id: id.into(),
        frame_locked: true,
        ..SceneEntity::default()
    };
    let Bodies { target_half_extents, bus_half_extents, links, .. } = &motion.bodies;
    let mut entities = vec![
        SceneEntity {
            cubes: vec![cube(target_half_extents, TARGET)],
            ..entity("target", "target")
        },
        SceneEntity { cylinders: vec![port()], ..entity("port", "port") },
        SceneEntity { cubes: vec![cube(bus_half_extents, BUS)], ..entity("bus", "bus") },
        SceneEntity { lines: vec![path(motion)], ..entity("path", "rtn") },
    ];
    for (i, link) in links.iter().enumerate() {
        let id = link_frame(i);
        entities.push(SceneEntity { cylinders: vec![rod(link)], ..entity(&id, &id) });
    }
    SceneUpdate { deletions: Vec::new(), entities }
}

fn cube(half_extents: &Vector3<f64>, color: Color) -> CubePrimitive {
    let size = Some(vector(&(half_extents * 2.0)));
    CubePrimitive { pose: pose(&Vector3::zeros(), &STILL), size, color: Some(color) }
}

/// A cylinder along z.
fn cylinder(
    center: &Vector3<f64>,
    turn: &Vector4<f64>,
    (radius, length): (f64, f64),
    color: Color,
) -> CylinderPrimitive {
    CylinderPrimitive {
        pose: pose(center, turn),
        size: Some(vector(&Vector3::new(2.0 * radius, 2.0 * radius, length))),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(color),
    }
}

fn port() -> CylinderPrimitive {
    cylinder(&Vector3::zeros(), &STILL, (PORT_RADIUS, PORT_HEIGHT), PORT)
}

/// A link's capsule, from end to end.
fn rod(link: &Link) -> CylinderPrimitive {
    let [start, end] = link.capsule;
    let length = (end - start).norm();
    // A link without length has no direction either.
    let along = if length > 0.0 { (end - start) / length } else { Vector3::z() };
    let turn = quaternion::between(&Vector3::z(), &along);
    cylinder(&((start + end) * 0.5), &turn, (link.radius, length), ARM)
}

fn path(motion: &Motion) -> LinePrimitive {
    let point = |moment: &Moment| {
        let at = &moment.position;
        Point3 { x: at.x, y: at.y, z: at.z }
    };
    LinePrimitive {
        r#type: line_primitive::Type::LineStrip as i32,
        pose: pose(&Vector3::zeros(), &STILL),
        thickness: PATH_WIDTH,
        points: motion.moments.iter().map(point).collect(),
        color: Some(BUS),
        ..LinePrimitive::default()
    }
}
