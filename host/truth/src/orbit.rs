//! The target's orbit: elements to position and velocity, and the RTN axes.

use crate::rotation::{about, length, unit};
use nalgebra::{Matrix3, Vector3};

/// Keplerian elements at the start. SI units, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Semi-major axis [m].
    pub semi_major_axis: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination [rad].
    pub inclination: f64,
    /// Argument of latitude, from the ascending node to the spacecraft [rad]. The node lies on x.
    pub argument_of_latitude: f64,
    /// Argument of perigee, from the ascending node [rad].
    pub argument_of_perigee: f64,
}

impl Orbit {
    /// Position [m] and velocity [m/s] in inertial axes (x to the node, z to the pole).
    pub fn state(&self, mu: f64) -> (Vector3<f64>, Vector3<f64>) {
        let e = self.eccentricity;
        let anomaly = self.argument_of_latitude - self.argument_of_perigee;
        let parameter = self.semi_major_axis * (1.0 - e * e);
        let (sine, cosine) = (libm::sin(anomaly), libm::cos(anomaly));
        let distance = parameter / (1.0 + e * cosine);
        let speed = libm::sqrt(mu / parameter);
        let (radial, along) = (speed * e * sine, speed * (1.0 + e * cosine));
        let axes = about(&Vector3::x(), self.inclination)
            * about(&Vector3::z(), self.argument_of_latitude);
        (axes * Vector3::new(distance, 0.0, 0.0), axes * Vector3::new(radial, along, 0.0))
    }
}

/// The eccentricity vector: towards perigee, as long as the eccentricity.
pub fn eccentricity(position: &Vector3<f64>, velocity: &Vector3<f64>, mu: f64) -> Vector3<f64> {
    velocity.cross(&position.cross(velocity)) / mu - unit(position)
}

/// The RTN frame of a place on an orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rtn {
    /// Columns R, T, N in inertial axes: maps RTN to inertial components.
    pub axes: Matrix3<f64>,
    /// Its angular velocity [rad/s], about N.
    pub rate: f64,
}

impl Rtn {
    /// From position [m] and velocity [m/s] of the orbit.
    pub fn of(position: &Vector3<f64>, velocity: &Vector3<f64>) -> Self {
        let momentum = position.cross(velocity);
        let (radial, normal) = (unit(position), unit(&momentum));
        let axes = Matrix3::from_columns(&[radial, normal.cross(&radial), normal]);
        Self { axes, rate: length(&momentum) / position.dot(position) }
    }
}
