//! What differs from one approach to the next.

use crate::math::quaternion;
use nalgebra::{Matrix3, Vector3, Vector4};

/// One approach: the target's tumble and where the servicer starts (section 8).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario {
    /// Target attitude at t = 0, body to RTN, `(x, y, z, w)`.
    pub target_attitude: Vector4<f64>,
    /// Target angular velocity at t = 0, relative to RTN, in target **body** axes [rad/s].
    pub target_rate: Vector3<f64>,
    /// System centre of mass at t = 0, RTN [m].
    pub position: Vector3<f64>,
    /// Velocity of the system centre of mass at t = 0, relative to RTN, in RTN [m/s].
    pub velocity: Vector3<f64>,
}

/// The bus attitude a scenario starts with, body to RTN: +z from the system centre of mass
/// (`position`, RTN) to the target's centre, +x the projection of the along-track axis normal to
/// it (of the orbit normal where those nearly coincide).
pub fn initial_bus_attitude(position: &Vector3<f64>) -> Vector4<f64> {
    let z = -position / libm::sqrt(position.dot(position));
    let reference = if z.y.abs() > 0.99 { Vector3::z() } else { Vector3::y() };
    let across = reference - z * z.dot(&reference);
    let x = across / libm::sqrt(across.dot(&across));
    quaternion::from_rotation_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z]))
}
