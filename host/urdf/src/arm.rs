//! A serial arm in parallel frames.

use crate::body::Body;
use crate::hull::{Bounds, Capsule};
use crate::note::Note;
use crate::options::Limits;
use crate::pose::Pose;
use nalgebra::Vector3;

/// A serial arm of revolute joints on a bus.
///
/// The bus frame is the root link's, or has it at the pose that the options name as mount. At zero
/// joint angles the frames of all links are parallel to it, whatever rotations the file has.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The robot's name.
    pub name: String,
    /// The root link and all that is fixed to it; none if that has no mass.
    pub base: Option<Base>,
    /// First joint, from the origin of the bus frame [m].
    pub arm_base: Vector3<f64>,
    /// One to seven, from the bus outwards.
    pub joints: Vec<Joint>,
    /// The end effector's frame in the last link's.
    pub end_effector: Pose,
    /// Notes on what was assumed, merged or left out.
    pub notes: Vec<Note>,
}

/// The body that carries the arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// The root link.
    pub link: String,
    /// Mass properties in the bus frame.
    pub body: Body,
    /// The box along the bus axes that holds the collision shapes, if there are any.
    pub bounds: Option<Bounds>,
}

/// A revolute joint and the link that it moves. The link's frame sits at the joint; at zero angle it
/// is parallel to the bus frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The joint's name.
    pub name: String,
    /// The name of the link that it moves.
    pub link: String,
    /// Unit axis, in link axes and in those of the body before it.
    pub axis: Vector3<f64>,
    /// From this joint to the next one, from the last to the end effector, in link axes [m].
    pub tip: Vector3<f64>,
    /// The link and all that is fixed to it, in link axes from the joint.
    pub body: Body,
    /// Angles, rate and torque.
    pub limits: Limits,
    /// Inertia of rotor and gear about the axis [kg m^2]. URDF has no word for it: 0.
    pub armature: f64,
    /// The capsule that holds the link, in link axes from the joint: from joint to tip, or where its shapes are.
    pub capsule: Capsule,
}

/// A link of the file, as it is written there: a row of the explanation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LinkRow {
    pub name: String,
    /// Name of the body that it is part of.
    pub part_of: String,
    /// In the link's own axes.
    pub body: Body,
    /// Diagonal of the box about its collision shapes, or else the distance to the farthest joint
    /// that it carries [m].
    pub extent: f64,
    /// Whether collision shapes are known.
    pub has_shapes: bool,
}
