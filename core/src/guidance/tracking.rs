//! The feedback: computed torque about the turned plan, with integrals that stop at limits.

use super::{Estimate, GuidanceSettings, Limits, Reference, TrackingError};
use crate::dynamics::{Acceleration, Control, Multibody, State};
use crate::math::quaternion;
use crate::model::hcw_acceleration;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::clamp;

/// Time over which position and velocity are extrapolated [s].
pub(super) const SOON: f64 = 30.0;

/// Errors of the servicer from what is asked for, and their integrals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors<const NL: usize> {
    pub position: Vector3<f64>,
    pub attitude: Vector3<f64>,
    pub joint: SVector<f64, NL>,
}

impl<const NL: usize> Errors<NL> {
    pub const ZERO: Self = Self {
        position: Vector3::new(0.0, 0.0, 0.0),
        attitude: Vector3::new(0.0, 0.0, 0.0),
        joint: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; NL]])),
    };

    /// Their sizes.
    pub fn sizes(&self) -> TrackingError {
        let size = |v: &Vector3<f64>| libm::sqrt(v.dot(v));
        TrackingError {
            position: size(&self.position),
            attitude: size(&self.attitude),
            joint: self.joint.amax(),
            target: 0.0,
        }
    }
}

/// One step of the feedback.
pub(super) struct Tracking<'a, const NL: usize> {
    pub body: Multibody<'a, NL>,
    pub mean_motion: f64,
    pub settings: &'a GuidanceSettings,
    pub limits: &'a Limits<NL>,
    /// Time since the step before [s].
    pub since: f64,
}

/// Effort of the actuators in one step, and the errors that it answers.
pub(super) struct Effort<const NL: usize> {
    pub force: Vector3<f64>,
    pub control: Control<NL>,
    /// Shares of the feedback that the limits leave: of the force, and of the torques.
    pub share: [f64; 2],
    pub error: TrackingError,
    /// Error of the position some time from now, if nothing is done [m].
    pub soon: Vector3<f64>,
    /// Near the end, that of the end effector across the port's normal, with bus and joints as far off as
    /// now [m]; zero before.
    pub beside: Vector3<f64>,
}

impl<const NL: usize> Effort<NL> {
    /// None at all.
    pub const NONE: Self = Self {
        force: Vector3::new(0.0, 0.0, 0.0),
        control: Control::ZERO,
        share: [0.0; 2],
        error: TrackingError { position: 0.0, attitude: 0.0, joint: 0.0, target: 0.0 },
        soon: Vector3::new(0.0, 0.0, 0.0),
        beside: Vector3::new(0.0, 0.0, 0.0),
    };
}

impl<const NL: usize> Tracking<'_, NL> {
    /// A bandwidth that the time between steps allows [rad/s].
    pub fn bandwidth(&self, wanted: f64) -> f64 {
        wanted.min(self.settings.most_per_step / self.since.max(1e-3))
    }

    /// Force and torques that lead `estimate` to `wanted`. The integrals go on where their limits leave
    /// them all of the feedback.
    ///
    /// Accelerations are `a + w^2 e + 2 w e' + c w^3 int e`; torques are those of the inverse dynamics
    /// at the estimated state with the whole force, so that its moment is compensated.
    pub fn effort(
        &self,
        wanted: &Reference<NL>,
        estimate: &Estimate<NL>,
        integrals: &mut Errors<NL>,
    ) -> Effort<NL> {
        let (center, drift) = self.body.center_of_mass(&estimate.state);
        let position = estimate.position + center;
        let velocity = estimate.velocity + drift;
        let turned = quaternion::conjugate(&wanted.state.attitude);
        let turned = quaternion::product(&estimate.state.attitude, &turned);
        let errors = Errors {
            position: position - wanted.position,
            attitude: quaternion::log(&turned),
            joint: estimate.state.joint_angle - wanted.state.joint_angle,
        };
        let settings = self.settings;
        let integral = settings.integral;
        let w = self.bandwidth(settings.translation);
        let pull = (errors.position * w + (velocity - wanted.velocity) * 2.0) * w
            + integrals.position * (integral * w * w * w);
        let mass = self.body.total_mass();
        let free = hcw_acceleration(self.mean_motion, &wanted.position, &wanted.velocity);
        let planned = (wanted.acceleration - free) * mass;
        let (force, force_share) = self.limits.force(&planned, &(pull * -mass));

        let w = self.bandwidth(settings.attitude);
        let rate = estimate.state.rate - wanted.state.rate;
        let bus =
            (errors.attitude * w + rate * 2.0) * w + integrals.attitude * (integral * w * w * w);
        let w = self.bandwidth(settings.joint);
        let rate = estimate.state.joint_rate - wanted.state.joint_rate;
        let joint = (errors.joint * w + rate * 2.0) * w + integrals.joint * (integral * w * w * w);
        let acceleration = Acceleration {
            bus: wanted.state_acceleration.bus - bus,
            joint: wanted.state_acceleration.joint - joint,
        };
        let needed = self.body.torques(&estimate.state, &force, &acceleration);
        let feedback = Control {
            bus_torque: needed.bus_torque - wanted.control.bus_torque,
            joint_torque: needed.joint_torque - wanted.control.joint_torque,
        };
        let (control, torque_share) = self.limits.torques(&wanted.control, &feedback);
        self.integrate(integrals, &errors, [force_share, torque_share]);
        let soon = errors.position + (velocity - wanted.velocity) * SOON;
        let share = [force_share, torque_share];
        Effort { force, control, share, error: errors.sizes(), soon, ..Effort::NONE }
    }

    /// How far the end effector will be from where it is wanted, across a unit vector, where the centre of
    /// mass will be `soon` off.
    // Separate function: its kinematics are not on the feedback's stack.
    #[inline(never)]
    pub fn beside(
        &self,
        normal: &Vector3<f64>,
        wanted: &State<NL>,
        now: &State<NL>,
        soon: &Vector3<f64>,
    ) -> Vector3<f64> {
        let [wanted, now] = [wanted, now].map(|state| self.body.end_effector(state).position);
        let off = now - wanted + soon;
        off - normal * normal.dot(&off)
    }

    /// Integrals go on only where no limit is reached, each up to its own bound.
    fn integrate(&self, integrals: &mut Errors<NL>, errors: &Errors<NL>, share: [f64; 2]) {
        let settings = self.settings;
        let [far, angle] = settings.integral_limit;
        let go_on = |sum: f64, error: f64, most: f64| clamp(sum + error * self.since, -most, most);
        if share[0] >= 1.0 {
            let most = far / self.bandwidth(settings.translation);
            integrals.position =
                integrals.position.zip_map(&errors.position, |sum, e| go_on(sum, e, most));
        }
        if share[1] >= 1.0 {
            let most = angle / self.bandwidth(settings.attitude);
            integrals.attitude =
                integrals.attitude.zip_map(&errors.attitude, |sum, e| go_on(sum, e, most));
            let most = angle / self.bandwidth(settings.joint);
            integrals.joint = integrals.joint.zip_map(&errors.joint, |sum, e| go_on(sum, e, most));
        }
    }
}
