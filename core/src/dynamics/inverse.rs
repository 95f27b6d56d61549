//! Inverse dynamics: the torques that given accelerations need (recursive Newton-Euler).

use super::multibody::{BusFrame, LinkPose};
use super::{Acceleration, Control, Integrator, Multibody, State};
use crate::math::{Scalar, Vec3};
use nalgebra::{SVector, Vector3};

/// Joint motion and bus angular acceleration, bus axes.
#[derive(Clone, Copy)]
pub(super) struct Motion<T, const NL: usize> {
    pub joint_rate: [T; NL],
    /// Derivative of the inertial rate, seen from inertial space [rad/s^2].
    pub bus_acceleration: Vec3<T>,
    pub joint_acceleration: [T; NL],
}

/// Moment on the bus (bus axes, about its centre of mass) and torques on the joints [N m].
#[derive(Clone, Copy)]
pub(super) struct GeneralizedForce<T, const NL: usize> {
    pub bus: Vec3<T>,
    pub joint: [T; NL],
}

impl<const NL: usize> Multibody<NL> {
    /// Bus and joint torques that produce `acceleration` in `state` under actuator force `force`
    /// (RTN, N): the inverse of [`Multibody::acceleration`].
    /// Cost: O(NL), about 250 flops a link.
    pub fn torques(
        &self,
        state: &State<NL>,
        force: &Vector3<f64>,
        acceleration: &Acceleration<NL>,
    ) -> Control<NL> {
        let (r, frame) = self.bus_frame(state, force);
        let inertial = acceleration.bus + self.frame_rate().cross(&state.rate);
        let motion = Motion {
            joint_rate: Self::angles(&state.joint_rate),
            bus_acceleration: Vec3(r.tr_mul(&inertial).into()),
            joint_acceleration: Self::angles(&acceleration.joint),
        };
        let poses = self.link_poses(&Self::angles(&state.joint_angle));
        let needed = self.generalized_force(&poses, &frame, &motion);
        Control {
            bus_torque: needed.bus.to_vector(),
            joint_torque: SVector::from(needed.joint),
        }
    }

    /// Newton-Euler over the tree, outwards for accelerations, inwards for forces.
    #[inline]
    pub(super) fn generalized_force<T: Scalar>(
        &self,
        poses: &[LinkPose<T>; NL],
        frame: &BusFrame<T>,
        motion: &Motion<T, NL>,
    ) -> GeneralizedForce<T, NL> {
        let accelerations = self.link_accelerations(poses, frame, motion);
        let n2 = self.mean_motion * self.mean_motion;
        let radial = frame.radial;

        // Centre of mass and its acceleration, relative to the bus.
        let (mut center, mut drift) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..NL {
            center += Self::scaled(poses[i].center, self.links[i].mass / self.total_mass);
            drift += Self::scaled(accelerations[i].center, self.links[i].mass / self.total_mass);
        }
        let common = frame.specific_force - drift;

        // Bus: only its own Euler equation; forces act at its centre of mass.
        let spin = frame.rate.scale_each(&self.bus_inertia);
        let mut bus = motion.bus_acceleration.scale_each(&self.bus_inertia)
            + frame.rate.cross(spin)
            - Self::scaled(radial.cross(radial.scale_each(&self.bus_inertia)), 3.0 * n2);

        let mut joint = [T::ZERO; NL];
        // Force and moment (about the bus centre of mass) that the links beyond need.
        let (mut force, mut moment) = (Vec3::ZERO, Vec3::ZERO);
        for i in (0..NL).rev() {
            let (link, pose, acceleration) = (&self.links[i], &poses[i], &accelerations[i]);
            let arm = pose.center - center;
            // -G s: the tide, moved to the side of the inertial force.
            let tide = (arm - Self::scaled(radial * radial.dot(arm), 3.0)) * T::constant(n2);
            let f = Self::scaled(acceleration.center + common + tide, link.mass);
            let spin = Self::apply_inertia(link, pose, acceleration.rate);
            let gravity_gradient = radial.cross(Self::apply_inertia(link, pose, radial));
            let m = Self::apply_inertia(link, pose, acceleration.angular)
                + acceleration.rate.cross(spin)
                - Self::scaled(gravity_gradient, 3.0 * n2);
            force += f;
            moment += m + pose.center.cross(f);
            joint[i] = pose.axis.dot(moment - pose.joint.cross(force));
        }
        bus += moment;
        GeneralizedForce { bus, joint }
    }

    /// Inertial rates and accelerations of the links, positions relative to the bus.
    #[inline]
    fn link_accelerations<T: Scalar>(
        &self,
        poses: &[LinkPose<T>; NL],
        frame: &BusFrame<T>,
        motion: &Motion<T, NL>,
    ) -> [LinkAcceleration<T>; NL] {
        let mut out = [LinkAcceleration::ZERO; NL];
        let (mut rate, mut angular) = (frame.rate, motion.bus_acceleration);
        // Acceleration of the joint before, and where it is.
        let (mut at, mut linear) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..NL {
            let pose = &poses[i];
            let lever = pose.joint - at;
            linear += angular.cross(lever) + rate.cross(rate.cross(lever));
            at = pose.joint;
            let spin = pose.axis * motion.joint_rate[i];
            angular += pose.axis * motion.joint_acceleration[i] + rate.cross(spin);
            rate += spin;
            let lever = pose.center - pose.joint;
            let center = linear + angular.cross(lever) + rate.cross(rate.cross(lever));
            out[i] = LinkAcceleration { rate, angular, center };
        }
        out
    }

    #[inline]
    fn scaled<T: Scalar>(v: Vec3<T>, factor: f64) -> Vec3<T> {
        Vec3(v.0.map(|x| x * factor))
    }
}

#[derive(Clone, Copy)]
struct LinkAcceleration<T> {
    /// Inertial angular velocity.
    rate: Vec3<T>,
    /// Inertial angular acceleration.
    angular: Vec3<T>,
    /// Inertial acceleration of the centre of mass relative to the bus.
    center: Vec3<T>,
}

impl<T: Scalar> LinkAcceleration<T> {
    const ZERO: Self = Self { rate: Vec3::ZERO, angular: Vec3::ZERO, center: Vec3::ZERO };
}

impl<const NL: usize> Multibody<NL> {
    /// The control, near `guess`, that moves the rates of `state` to `goal` (bus rate and joint
    /// rates) over one step of `integrator`.
    ///
    /// Exact for Euler; for RK4 the error of the guess is divided by a factor that is small
    /// like the change of the arm's geometry over the step. Cost: one inverse dynamics (Euler), or
    /// one step and two (RK4).
    pub fn steer(
        &self,
        integrator: Integrator,
        dt: f64,
        state: &State<NL>,
        goal: (&Vector3<f64>, &SVector<f64, NL>),
        guess: &Control<NL>,
        force: &Vector3<f64>,
    ) -> Control<NL> {
        let mean = |rate: &Vector3<f64>, joint_rate: &SVector<f64, NL>| Acceleration {
            bus: (rate - state.rate) / dt,
            joint: (joint_rate - state.joint_rate) / dt,
        };
        match integrator {
            Integrator::Euler => self.torques(state, force, &mean(goal.0, goal.1)),
            Integrator::Rk4 { .. } => {
                let reached = self.step(integrator, dt, state, guess, force);
                let middle = State {
                    attitude: reached.attitude,
                    joint_angle: (state.joint_angle + reached.joint_angle) * 0.5,
                    rate: (state.rate + reached.rate) * 0.5,
                    joint_rate: (state.joint_rate + reached.joint_rate) * 0.5,
                };
                let wanted = self.torques(&middle, force, &mean(goal.0, goal.1));
                let got =
                    self.torques(&middle, force, &mean(&reached.rate, &reached.joint_rate));
                Control {
                    bus_torque: guess.bus_torque + wanted.bus_torque - got.bus_torque,
                    joint_torque: guess.joint_torque + wanted.joint_torque - got.joint_torque,
                }
            }
        }
    }
}
