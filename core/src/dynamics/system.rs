//! The whole servicer: position of the bus besides the motion about the centre of mass.

use super::{Control, Multibody, State};
use crate::math::quaternion;
use crate::model::hcw_acceleration;
use nalgebra::{Matrix3, SVector, Vector3};

/// Full state `[r, q, alpha, v, w, alpha']`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemState<const NL: usize> {
    /// Bus centre of mass, RTN [m].
    pub position: Vector3<f64>,
    /// Velocity of the bus centre of mass relative to RTN, in RTN [m/s].
    pub velocity: Vector3<f64>,
    /// Attitude and arm.
    pub internal: State<NL>,
}

/// Accelerations of the full state, RTN components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystemRates<const NL: usize> {
    /// Second derivative of the bus position [m/s^2].
    pub bus: Vector3<f64>,
    /// Second derivative of the system's centre of mass [m/s^2]: HCW plus force over mass.
    pub center_of_mass: Vector3<f64>,
    /// Derivative of the bus rate [rad/s^2].
    pub rate: Vector3<f64>,
    /// Joint accelerations [rad/s^2].
    pub joint_rate: SVector<f64, NL>,
}

/// Pose of the end effector in RTN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndEffectorPose {
    /// Position relative to the reference point the caller chose, RTN axes [m].
    pub position: Vector3<f64>,
    /// Last link's axes to RTN.
    pub rotation: Matrix3<f64>,
}

impl<const NL: usize> Multibody<'_, NL> {
    /// System centre of mass relative to the bus centre of mass, and its velocity, in RTN
    /// [m, m/s].
    pub fn center_of_mass(&self, state: &State<NL>) -> (Vector3<f64>, Vector3<f64>) {
        let r = quaternion::rotation_matrix(&state.attitude);
        let poses = self.link_poses(&Self::angles(&state.joint_angle));
        let center = self.first_moment(&poses).to_vector() / self.total_mass;
        // Joint by joint: the links beyond a joint turn about it.
        let mut drift = Vector3::zeros();
        for (j, pose) in poses.iter().enumerate() {
            let axis = pose.axis.to_vector() * state.joint_rate[j];
            for (link, subtree) in self.servicer.links.iter().zip(&poses).skip(j) {
                let lever = (subtree.center - pose.joint).to_vector();
                drift += axis.cross(&lever) * (link.mass_kg / self.total_mass);
            }
        }
        (r * center, state.rate.cross(&(r * center)) + r * drift)
    }

    /// End effector relative to the system's centre of mass, in RTN.
    pub fn end_effector(&self, state: &State<NL>) -> EndEffectorPose {
        let r = quaternion::rotation_matrix(&state.attitude);
        let poses = self.link_poses(&Self::angles(&state.joint_angle));
        let center = self.first_moment(&poses).to_vector() / self.total_mass;
        let mut tip = self.servicer.arm_base_m;
        let mut rotation = Matrix3::identity();
        for (link, pose) in self.servicer.links.iter().zip(&poses) {
            rotation = Matrix3::from_columns(&pose.rotation.0.map(|c| c.to_vector()));
            tip = pose.joint.to_vector() + rotation * link.tip_m;
        }
        EndEffectorPose { position: r * (tip - center), rotation: r * rotation }
    }

    /// Accelerations of the full state under `control` and force `force` (RTN, N).
    pub fn system_rates(
        &self,
        state: &SystemState<NL>,
        control: &Control<NL>,
        force: &Vector3<f64>,
    ) -> SystemRates<NL> {
        let internal = &state.internal;
        let (offset, offset_rate) = self.center_of_mass(internal);
        let center = state.position + offset;
        let center_rate = state.velocity + offset_rate;
        let center_of_mass =
            hcw_acceleration(self.mean_motion, &center, &center_rate) + force / self.total_mass;
        let acceleration = self.acceleration(internal, control, force);
        let bus = center_of_mass - self.offset_acceleration(internal, &acceleration);
        SystemRates { bus, center_of_mass, rate: acceleration.bus, joint_rate: acceleration.joint }
    }

    /// Second RTN derivative of the vector from the bus to the system's centre of mass [m/s^2].
    fn offset_acceleration(
        &self,
        state: &State<NL>,
        acceleration: &super::Acceleration<NL>,
    ) -> Vector3<f64> {
        let r = quaternion::rotation_matrix(&state.attitude);
        let poses = self.link_poses(&Self::angles(&state.joint_angle));
        // Link by link in RTN, rates relative to RTN: the tree's own kinematics, no orbit.
        let (mut rate, mut angular) = (state.rate, acceleration.bus);
        let (mut at, mut linear) = (Vector3::zeros(), Vector3::zeros());
        let mut sum = Vector3::zeros();
        for (k, pose) in poses.iter().enumerate() {
            let joint = r * pose.joint.to_vector();
            let lever = joint - at;
            linear += angular.cross(&lever) + rate.cross(&rate.cross(&lever));
            at = joint;
            let axis = r * pose.axis.to_vector();
            angular += axis * acceleration.joint[k] + rate.cross(&axis) * state.joint_rate[k];
            rate += axis * state.joint_rate[k];
            let lever = r * (pose.center - pose.joint).to_vector();
            let center = linear + angular.cross(&lever) + rate.cross(&rate.cross(&lever));
            sum += center * self.servicer.links[k].mass_kg;
        }
        sum / self.total_mass
    }
}
