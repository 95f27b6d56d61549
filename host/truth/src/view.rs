//! The true state, in terms of what is seen, measured and judged.

use crate::multibody::Multibody;
use crate::rotation::{Quaternion, matrix, normalized};
use crate::servicer::ServicerState;
use crate::target::{Target, TargetState};
use nalgebra::{Matrix3, Vector3};

/// The true state at one instant. Positions [m] are from the target's centre of mass, velocities
/// [m/s] relative to it; all in inertial axes, which do not rotate.
#[derive(Clone, Copy, Debug)]
pub struct View<const NL: usize> {
    /// When [s].
    pub time: f64,
    /// The servicer's centre of mass.
    pub center: Vector3<f64>,
    /// Its velocity.
    pub center_velocity: Vector3<f64>,
    /// Origin of the bus's frame.
    pub bus_position: Vector3<f64>,
    /// Its velocity.
    pub bus_velocity: Vector3<f64>,
    /// Bus to inertial axes.
    pub attitude: Quaternion,
    /// Inertial rate of the bus [rad/s].
    pub bus_rate: Vector3<f64>,
    /// Joint angles [rad].
    pub joint_angle: [f64; NL],
    /// Joint rates [rad/s].
    pub joint_rate: [f64; NL],
    /// Momentum of the wheels, bus axes [N m s].
    pub wheel_momentum: Vector3<f64>,
    /// End effector.
    pub tip: Vector3<f64>,
    /// Its velocity.
    pub tip_velocity: Vector3<f64>,
    /// Unit approach axis.
    pub approach: Vector3<f64>,
    /// Last link to inertial axes (the bus where there is no joint).
    pub last_link: Matrix3<f64>,
    /// The target.
    pub target: TargetState,
    /// Its port.
    pub port: Vector3<f64>,
    /// Velocity of the port.
    pub port_velocity: Vector3<f64>,
    /// Outward unit normal of the port.
    pub port_normal: Vector3<f64>,
}

impl<const NL: usize> View<NL> {
    pub(crate) fn new(
        time: f64,
        body: &Multibody<NL>,
        state: &ServicerState<NL>,
        locked: &[bool; NL],
        (target, motion): (&Target, TargetState),
    ) -> Self {
        let now = body.instant(state, locked);
        let velocities = body.velocities(&now.pose, &now.rates);
        let (center, center_velocity) = (state.position(), state.velocity());
        // The last link: its rate, and a point on it with its velocity.
        let last = velocities.links.last();
        let (rate, from, velocity) = last
            .map_or((now.rates.bus, now.pose.bus_origin, velocities.bus_origin), |link| {
                (link.rate, now.pose.pivots[NL - 1], link.pivot)
            });
        let axes = matrix(&motion.attitude);
        let port = axes * target.port;
        Self {
            time,
            center,
            center_velocity,
            bus_position: center + now.pose.bus_origin,
            bus_velocity: center_velocity + velocities.bus_origin,
            attitude: normalized(&state.attitude()),
            bus_rate: now.rates.bus,
            joint_angle: *state.angles(),
            joint_rate: now.rates.joints,
            wheel_momentum: state.wheels(),
            tip: center + now.pose.tip,
            tip_velocity: center_velocity + velocity + rate.cross(&(now.pose.tip - from)),
            approach: now.pose.approach,
            last_link: *now.pose.rotations.last().unwrap_or(&now.pose.bus_rotation),
            target: motion,
            port,
            port_velocity: (axes * motion.rate).cross(&port),
            port_normal: axes * target.normal,
        }
    }

    /// Height of the tip above the port's plane [m]: negative once it is through.
    pub fn height(&self) -> f64 {
        self.port_normal.dot(&(self.tip - self.port))
    }

    /// Distance of the tip from the port's axis [m].
    pub fn offset(&self) -> f64 {
        let apart = self.tip - self.port;
        let along = self.port_normal * self.port_normal.dot(&apart);
        crate::rotation::length(&(apart - along))
    }

    /// Distance of tip and port [m].
    pub fn miss(&self) -> f64 {
        crate::rotation::length(&(self.tip - self.port))
    }

    /// Angle between the approach axis and the port's inward normal [rad].
    pub fn angle(&self) -> f64 {
        let (sine, cosine) = (
            crate::rotation::length(&self.approach.cross(&self.port_normal)),
            -self.approach.dot(&self.port_normal),
        );
        libm::atan2(sine, cosine)
    }

    /// Speed of the tip relative to the port [m/s].
    pub fn relative_speed(&self) -> f64 {
        crate::rotation::length(&(self.tip_velocity - self.port_velocity))
    }
}
