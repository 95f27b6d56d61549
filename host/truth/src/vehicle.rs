//! The servicer's data: bus, joints, end effector, limits.

use nalgebra::{Matrix3, Vector3};

/// A rigid body, in the frame it is given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass [m].
    pub center: Vector3<f64>,
    /// Inertia about the centre of mass [kg m^2]: a symmetric tensor.
    pub inertia: Matrix3<f64>,
}

/// A revolute joint and the link that it turns. The link's frame has its origin at the joint and is
/// parallel to the frame of the body before it at zero angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Where the joint is in the frame of the body before it [m].
    pub pivot: Vector3<f64>,
    /// Unit axis, in the axes of the link or of the body before it: the same.
    pub axis: Vector3<f64>,
    /// The link, in its own frame.
    pub link: Body,
    /// Rotor inertia seen through the gear [kg m^2].
    pub armature: f64,
}

/// A bus with an arm of `NL` revolute joints. The bus's frame has its origin at a point of reference
/// that navigation speaks of, near its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle<const NL: usize> {
    /// The bus, in its own frame.
    pub bus: Body,
    /// Where the thrusters' force acts, in the bus's frame [m].
    pub force_point: Vector3<f64>,
    /// From the bus outwards.
    pub joints: [Joint; NL],
    /// End effector in the last link's frame [m].
    pub tip: Vector3<f64>,
    /// Unit approach axis in the last link's axes.
    pub approach: Vector3<f64>,
    /// Limits of the actuators.
    pub limits: Limits<NL>,
    /// The joints' inner loops.
    pub servo: [Servo; NL],
}

/// Limits of actuators, each for plus and minus. Infinite where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const NL: usize> {
    /// Force on each bus axis [N].
    pub force: [f64; 3],
    /// Torque of the wheels about each bus axis [N m].
    pub bus_torque: [f64; 3],
    /// Momentum of the wheels about each bus axis [N m s].
    pub wheel_momentum: [f64; 3],
    /// Torque of each joint [N m].
    pub joint_torque: [f64; NL],
}

impl<const NL: usize> Limits<NL> {
    /// None.
    pub const NONE: Self = Self {
        force: [f64::INFINITY; 3],
        bus_torque: [f64::INFINITY; 3],
        wheel_momentum: [f64::INFINITY; 3],
        joint_torque: [f64::INFINITY; NL],
    };
}

/// A joint's inner loop: a mass on a spring and damper about its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Servo {
    /// Natural frequency [rad/s].
    pub bandwidth: f64,
    /// Damping ratio.
    pub damping: f64,
}

impl Servo {
    /// 1 rad/s, damping 1 (assumed).
    pub const DEFAULT: Self = Self { bandwidth: 1.0, damping: 1.0 };
}

impl<const NL: usize> Vehicle<NL> {
    /// Mass of all bodies [kg].
    pub fn mass(&self) -> f64 {
        self.joints.iter().fold(self.bus.mass, |sum, joint| sum + joint.link.mass)
    }

    /// The body `index`: 0 is the bus, `i` the link of joint `i - 1`.
    pub fn body(&self, index: usize) -> &Body {
        if index == 0 { &self.bus } else { &self.joints[index - 1].link }
    }
}
