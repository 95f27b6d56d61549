//! Position and rotation of a frame in another.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// A frame seen from another: `v_other = position + rotation v_frame`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The frame's origin [m].
    pub position: Vector3<f64>,
    /// The frame's axes as columns.
    pub rotation: Matrix3<f64>,
}

impl Pose {
    /// Pose of a frame in itself.
    pub fn identity() -> Self {
        Self { position: Vector3::zeros(), rotation: Matrix3::identity() }
    }

    /// From a position [m] and the angles of URDF [rad]: roll about x, then pitch about y, then yaw
    /// about z, all of them fixed axes.
    pub fn from_xyz_rpy(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        let rotation = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]).into_inner();
        Self { position: Vector3::from(xyz), rotation }
    }

    /// A turn by `angle` [rad] about the unit vector `axis`.
    pub(crate) fn turn(axis: &Vector3<f64>, angle: f64) -> Self {
        let rotation = Rotation3::from_axis_angle(&Unit::new_unchecked(*axis), angle).into_inner();
        Self { position: Vector3::zeros(), rotation }
    }

    /// A shift without a turn [m].
    pub(crate) fn shift(position: Vector3<f64>) -> Self {
        Self { position, rotation: Matrix3::identity() }
    }

    /// Where a frame is that has pose `inner` in this one.
    pub(crate) fn then(&self, inner: &Self) -> Self {
        Self { position: self.point(&inner.position), rotation: self.rotation * inner.rotation }
    }

    /// A point of this frame, seen from the other.
    pub(crate) fn point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.rotation * point
    }
}
