//! The servicer as a tree of rigid bodies, prepared for evaluation.

use super::State;
use crate::math::{Mat3, Scalar, Vec3, quaternion};
use crate::model::{Mission, Servicer};
use nalgebra::{Matrix3, SVector, Vector3};

/// A bus with a serial arm of `NL` joints in orbit. It borrows its mission's servicer: a copy would be
/// the largest part of what planning has on the stack.
#[derive(Clone, Copy, Debug)]
pub struct Multibody<'a, const NL: usize> {
    pub(super) servicer: &'a Servicer<NL>,
    pub(super) total_mass: f64,
    pub(super) mean_motion: f64,
}

/// One link's pose relative to the bus, in bus axes.
#[derive(Clone, Copy)]
pub(super) struct LinkPose<T> {
    /// Link axes to bus axes.
    pub rotation: Mat3<T>,
    /// Joint axis.
    pub axis: Vec3<T>,
    /// Joint, from the bus centre of mass [m].
    pub joint: Vec3<T>,
    /// Centre of mass, from the bus centre of mass [m].
    pub center: Vec3<T>,
}

impl<T: Scalar> LinkPose<T> {
    const ZERO: Self = Self {
        rotation: Mat3([Vec3::ZERO; 3]),
        axis: Vec3::ZERO,
        joint: Vec3::ZERO,
        center: Vec3::ZERO,
    };
}

/// Rate, radial direction and force in bus axes: all that the dynamics depend on besides the joints.
#[derive(Clone, Copy)]
pub(super) struct BusFrame<T> {
    /// Angular velocity relative to inertial space [rad/s].
    pub rate: Vec3<T>,
    /// Radial direction `e_R`.
    pub radial: Vec3<T>,
    /// Actuator force per unit of system mass [m/s^2].
    pub specific_force: Vec3<T>,
}

impl<'a, const NL: usize> Multibody<'a, NL> {
    /// The multibody system of a mission's servicer in its orbit.
    pub fn new(mission: &'a Mission<NL>) -> Self {
        let servicer = &mission.servicer;
        Self { servicer, total_mass: servicer.total_mass(), mean_motion: mission.mean_motion() }
    }

    /// Mass of bus and arm together [kg].
    pub fn total_mass(&self) -> f64 {
        self.total_mass
    }

    /// Angular velocity of RTN relative to inertial space, in RTN [rad/s].
    pub(super) fn frame_rate(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.mean_motion)
    }

    /// Rotation matrix of a state's attitude, and the frame in bus axes.
    pub(super) fn bus_frame(
        &self,
        state: &State<NL>,
        force: &Vector3<f64>,
    ) -> (Matrix3<f64>, BusFrame<f64>) {
        let r = quaternion::rotation_matrix(&state.attitude);
        let to_bus = |v: Vector3<f64>| Vec3(r.tr_mul(&v).into());
        let frame = BusFrame {
            rate: to_bus(state.rate + self.frame_rate()),
            radial: to_bus(Vector3::x()),
            specific_force: to_bus(force / self.total_mass),
        };
        (r, frame)
    }

    /// Poses of the links relative to the bus.
    #[inline]
    pub(super) fn link_poses<T: Scalar>(&self, joint_angle: &[T; NL]) -> [LinkPose<T>; NL] {
        self.link_poses_of(&joint_angle.map(Scalar::sin_cos))
    }

    /// Poses of the links from sines and cosines of the joint angles.
    #[inline]
    pub(super) fn link_poses_of<T: Scalar>(&self, turns: &[(T, T); NL]) -> [LinkPose<T>; NL] {
        let mut poses = [LinkPose::ZERO; NL];
        let mut rotation = Mat3::constant(&Matrix3::identity());
        let mut joint = Vec3::constant(&self.servicer.arm_base_m);
        // By index: borrowed, the array would be built here and then copied to the caller.
        for (i, (link, turn)) in self.servicer.links.iter().zip(turns).enumerate() {
            // The axis is the same in the link's axes and in those of the body before it.
            let axis = rotation.apply_constant(&link.axis);
            rotation = rotation.product(&Mat3::rotation(&link.axis, *turn));
            let center = joint + rotation.apply_constant(&link.center_of_mass_m);
            poses[i] = LinkPose { rotation, axis, joint, center };
            joint += rotation.apply_constant(&link.tip_m);
        }
        poses
    }

    /// First mass moment of the arm about the bus centre of mass, bus axes [kg m].
    pub(super) fn first_moment(&self, poses: &[LinkPose<f64>; NL]) -> Vec3<f64> {
        let mut moment = Vec3::ZERO;
        for (link, pose) in self.servicer.links.iter().zip(poses) {
            moment += pose.center * link.mass_kg;
        }
        moment
    }

    pub(super) fn angles(v: &SVector<f64, NL>) -> [f64; NL] {
        v.data.0[0]
    }
}
