//! Scenarios: the data that differ from one approach to the next.

use crate::math::quaternion;
use nalgebra::{Matrix3, SVector, Vector3, Vector4};
use remora_qp::dense::divisor;

/// One approach: the target's tumble, where the servicer starts, and how long it has (section 8).
///
/// A servicer that is already moving gives its [`Start`]:
///
/// ```
/// use remora_core::prelude::*;
///
/// let start = Start {
///     bus_rate: Vector3::new(0.0, 2.0e-4, 0.0),
///     joint_angle: Some([-0.3, 0.6, 0.1].into()),
///     ..Start::default()
/// };
/// let scenario: Scenario = Scenario {
///     target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
///     position: Vector3::new(0.0, 0.0, 5.0),
///     start,
///     duration: Some(900.0),
///     ..Scenario::default()
/// };
/// assert!(scenario.validated().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario<const NL: usize = 3> {
    /// Target attitude at t = 0, body to RTN, `(x, y, z, w)`.
    pub target_attitude: Vector4<f64>,
    /// Target angular velocity at t = 0, relative to RTN, in target **body** axes [rad/s].
    pub target_rate: Vector3<f64>,
    /// System centre of mass at t = 0, RTN [m].
    pub position: Vector3<f64>,
    /// Velocity of the system centre of mass at t = 0, relative to RTN, in RTN [m/s].
    pub velocity: Vector3<f64>,
    /// Bus and arm at t = 0.
    pub start: Start<NL>,
    /// Time from t = 0 to capture [s]; `None`: the mission's.
    pub duration: Option<f64>,
    /// Nodes of the plan; `None`: the mission's.
    pub nodes: Option<usize>,
}

impl<const NL: usize> Default for Scenario<NL> {
    /// A target at rest, aligned with RTN, and the servicer at rest 5 m in front of its +z face.
    fn default() -> Self {
        Self {
            target_attitude: quaternion::IDENTITY,
            target_rate: Vector3::zeros(),
            position: Vector3::new(0.0, 0.0, 5.0),
            velocity: Vector3::zeros(),
            start: Start::default(),
            duration: None,
            nodes: None,
        }
    }
}

/// Bus and arm at t = 0. The default is a bus that looks at the target and the arm in the mission's
/// initial configuration, all at rest relative to RTN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start<const NL: usize = 3> {
    /// Bus attitude, body to RTN, `(x, y, z, w)`; `None`: [`initial_bus_attitude`].
    pub bus_attitude: Option<Vector4<f64>>,
    /// Bus rate relative to RTN, in RTN [rad/s].
    pub bus_rate: Vector3<f64>,
    /// Joint angles [rad]; `None`: the servicer's `initial_joint_angle`.
    pub joint_angle: Option<SVector<f64, NL>>,
    /// Joint rates [rad/s].
    pub joint_rate: SVector<f64, NL>,
}

impl<const NL: usize> Default for Start<NL> {
    fn default() -> Self {
        Self {
            bus_attitude: None,
            bus_rate: Vector3::zeros(),
            joint_angle: None,
            joint_rate: SVector::zeros(),
        }
    }
}

impl<const NL: usize> Start<NL> {
    /// Whether anything is given: limits that such a start violates are recovered
    /// ([`Approach::recovery_time`](super::Approach)) instead of refused.
    pub fn is_given(&self) -> bool {
        *self != Self::default()
    }
}

/// The bus attitude a scenario starts with, body to RTN: +z from the system centre of mass
/// (`position`, RTN) to the target's centre, +x the projection of the along-track axis normal to
/// it (of the orbit normal where those nearly coincide).
pub fn initial_bus_attitude(position: &Vector3<f64>) -> Vector4<f64> {
    let z = -position / divisor(libm::sqrt(position.dot(position)));
    let reference = if z.y.abs() > 0.99 { Vector3::z() } else { Vector3::y() };
    let across = reference - z * z.dot(&reference);
    let x = across / libm::sqrt(across.dot(&across));
    quaternion::from_rotation_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z]))
}
