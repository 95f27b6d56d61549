//! Errors of the world against what the planner believes, by class. One standard deviation each,
//! unless said; all of it data, in files `*.errors.toml`.
//!
//! The typical values are engineering guesses in the range of the literature on rendezvous and
//! capture. None is measured on a spacecraft: each is *assumed*.

mod faults;
mod sensors;
mod values;

pub use faults::{Faults, JointStuck, TargetRateChange, ThrusterLost};
pub use sensors::{Sampling, Sensors};
pub use values::ErrorsFault;

use serde::{Deserialize, Serialize};

/// All errors of a flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Errors {
    /// Errors of navigation.
    pub navigation: Navigation,
    /// Thrusters.
    pub thrusters: Thrusters,
    /// Reaction wheels.
    pub wheels: Wheels,
    /// Motors and encoders of the joints.
    pub joints: Joints,
    /// Masses of the servicer.
    pub mass: Mass,
    /// Errors in the knowledge of the target's motion.
    pub tumble: Tumble,
    /// Errors in the knowledge of places on both spacecraft.
    pub geometry: Geometry,
    /// Orbit and disturbances.
    pub orbit: OrbitErrors,
    /// Rates and delays of the sensors.
    pub sensors: Sensors,
    /// Faults with their times; none where left out.
    #[serde(default)]
    pub faults: Faults,
}

/// Errors of navigation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Navigation {
    /// Bias and drift of the relative position, an axis [m]; a Gauss-Markov process.
    pub position_drift_m: f64,
    /// Its time constant [s].
    pub position_drift_time_s: f64,
    /// Beyond this range [m] bias and drift grow in proportion to the range.
    pub position_drift_range_m: f64,
    /// Noise of the relative position, a sample and axis [m].
    pub position_noise_m: f64,
    /// Noise of the relative velocity, a sample and axis [m/s].
    pub velocity_noise_m_s: f64,
    /// Bias and drift of the servicer's attitude, an axis [rad]; a Gauss-Markov process.
    pub attitude_drift_rad: f64,
    /// Its time constant [s].
    pub attitude_drift_time_s: f64,
    /// Bias and drift of the target's attitude, an axis [rad]; a Gauss-Markov process.
    pub target_attitude_drift_rad: f64,
    /// Its time constant [s].
    pub target_attitude_drift_time_s: f64,
    /// Noise of the bus's rate, a sample and axis [rad/s].
    pub bus_rate_noise_rad_s: f64,
    /// Noise of the target's rate, a sample and axis [rad/s].
    pub target_rate_noise_rad_s: f64,
    /// Noise of the wrist camera, a sample and axis [m].
    pub wrist_camera_noise_m: f64,
}

/// Thrusters, along the bus's axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thrusters {
    /// Relative error of the force of each axis.
    pub scale: f64,
    /// Error of each axis's direction, about each of the other two axes [rad].
    pub direction_rad: f64,
    /// Relative error of each period's impulse of each axis.
    pub noise: f64,
    /// Impulse bit [N s], not a deviation: impulses are multiples of it; zero: any impulse.
    pub impulse_bit_n_s: f64,
    /// Period of firing [s], not a deviation.
    pub period_s: f64,
}

/// Reaction wheels, one a bus axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheels {
    /// Relative error of each axis's torque.
    pub scale: f64,
    /// Torque of each axis where none is asked [N m].
    pub bias_n_m: f64,
    /// Noise of each axis's torque, constant for a noise period [N m].
    pub noise_n_m: f64,
    /// Noise period [s], not a deviation.
    pub noise_period_s: f64,
}

/// Motors and encoders of the joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joints {
    /// Relative error of each motor's torque.
    pub scale: f64,
    /// Torque of each motor where none is asked [N m].
    pub bias_n_m: f64,
    /// Coulomb friction of each joint [N m]: the magnitude of a normal number of this deviation.
    pub friction_n_m: f64,
    /// Joint rate below which friction goes down to zero [rad/s], not a deviation: makes friction
    /// smooth enough to be integrated.
    pub friction_rate_rad_s: f64,
    /// Bias of each encoder [rad].
    pub angle_bias_rad: f64,
    /// Noise of each encoder, a sample [rad].
    pub angle_noise_rad: f64,
    /// Noise of each joint's rate, a sample [rad/s].
    pub rate_noise_rad_s: f64,
}

/// Masses of the servicer's bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mass {
    /// Relative error of each body's mass, as the logarithm; its inertia goes with it.
    pub mass: f64,
    /// Relative error of moments of inertia. What is scaled, by a lognormal number a body axis, is
    /// the second moment of mass, so that any draw is the inertia of some body: moments of a cube
    /// differ by this much, those of a thin link up to the root of two more.
    pub inertia: f64,
    /// Error of the axes of each body's inertia, about each axis [rad].
    pub inertia_axes_rad: f64,
    /// Error of the bus's centre of mass, an axis [m].
    pub bus_center_m: f64,
    /// Error of each link's centre of mass, an axis [m].
    pub link_center_m: f64,
}

/// Errors in the knowledge of the target's motion at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tumble {
    /// Relative error of the rate's magnitude.
    pub rate: f64,
    /// Error of the rate's direction, about each axis [rad].
    pub rate_direction_rad: f64,
    /// Error of the attitude, about each axis [rad].
    pub attitude_rad: f64,
    /// Relative error of each principal moment of inertia, as the logarithm.
    pub inertia_ratio: f64,
}

/// Errors in the knowledge of places on both spacecraft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// Place of the port on the target, an axis [m].
    pub port_m: f64,
    /// Place of the arm's base on the bus, an axis [m].
    pub arm_base_m: f64,
    /// Bias of the wrist camera, an axis [m].
    pub wrist_camera_m: f64,
}

/// Orbit and disturbances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrbitErrors {
    /// Error of the eccentricity vector, along each of its two components.
    pub eccentricity: f64,
    /// Differential drag [m/s^2]: acceleration of the servicer along track.
    pub drag_m_s2: f64,
    /// Moment on the servicer's bus, constant in its axes, an axis [N m].
    pub disturbance_n_m: f64,
    /// Moment on the target, constant in its axes, an axis [N m].
    pub target_disturbance_n_m: f64,
}

/// Classes of errors that can be scaled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// [`Navigation`].
    Navigation,
    /// [`Thrusters`].
    Thrusters,
    /// [`Wheels`] and [`Joints`].
    Torques,
    /// [`Mass`].
    Mass,
    /// [`Tumble`].
    Tumble,
    /// [`Geometry`].
    Geometry,
    /// [`OrbitErrors`].
    Orbit,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Navigation,
        Self::Thrusters,
        Self::Torques,
        Self::Mass,
        Self::Tumble,
        Self::Geometry,
        Self::Orbit,
    ];
}
