//! Setup of a flight: the world as the planner believes it to be.

use crate::gravity::Environment;
use crate::multibody::{Multibody, Rates};
use crate::orbit::Orbit;
use crate::rotation::Quaternion;
use crate::target::Target;
use crate::vehicle::Vehicle;
use nalgebra::Vector3;

/// The nominal world and the true state of the servicer at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup<const NL: usize> {
    /// The servicer.
    pub vehicle: Vehicle<NL>,
    /// The target.
    pub target: Target,
    /// The target's orbit.
    pub orbit: Orbit,
    /// Environment of both.
    pub environment: Environment,
    /// Where the servicer starts.
    pub start: Start<NL>,
    /// The tip reaches the port's plane where it passes within this distance of the port [m];
    /// elsewhere the plane is only a plane.
    pub contact_radius: f64,
}

/// State of the servicer at time zero. Inertial axes are the orbit's: x to the node, z to the pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start<const NL: usize> {
    /// Origin of the bus's frame from the target's centre of mass, inertial axes [m].
    pub position: Vector3<f64>,
    /// Its velocity relative to the target's centre of mass, non-rotating axes [m/s].
    pub velocity: Vector3<f64>,
    /// Bus to inertial axes.
    pub attitude: Quaternion,
    /// Inertial rate of the bus, inertial axes [rad/s].
    pub rate: Vector3<f64>,
    /// Joint angles [rad].
    pub joint_angle: [f64; NL],
    /// Joint rates [rad/s].
    pub joint_rate: [f64; NL],
    /// Momentum of the wheels, bus axes [N m s].
    pub wheel_momentum: Vector3<f64>,
}

impl<const NL: usize> Start<NL> {
    /// Moves the start's `position` and `velocity` from the system's centre of mass, of this vehicle,
    /// to the origin of the bus's frame. Planners give the former.
    #[must_use]
    pub fn from_center_of_mass(mut self, vehicle: &Vehicle<NL>) -> Self {
        let body = Multibody::new(*vehicle);
        let pose = body.pose(&self.attitude, &self.joint_angle);
        let rates = Rates { bus: self.rate, joints: self.joint_rate };
        self.position += pose.bus_origin;
        self.velocity += body.velocities(&pose, &rates).bus_origin;
        self
    }
}
