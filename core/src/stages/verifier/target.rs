//! The target's motion, integrated a second time.
//!
//! Attitude and angular momentum in inertial axes, by the pair of Dormand and Prince of orders 5
//! and 4 with a step that its error chooses; the planner integrates body rates in the rotating
//! frame by classical RK4 in equal steps. Momentum changes by the gravity gradient alone: without
//! it, it is kept exactly.

use super::PARTS;
use super::residuals::worst;
use crate::math::quaternion;
use crate::model::{Integrator, Mission, Scenario, Target, TargetState};
use nalgebra::{SVector, Vector3, Vector4};

/// Attitude (body to inertial axes, which are those of RTN at t = 0), then angular momentum.
type Motion = SVector<f64, 7>;

/// Error of a step in attitude, and in momentum over its scale.
const STEP_ERROR: f64 = 1e-14;

/// Most steps a part of an interval, rejected ones counted. A target for which they are too few is
/// nowhere: its state is not a number.
pub(crate) const MAX_TARGET_STEPS: usize = 500;

const STAGES: usize = 7;

/// When the stages stand, as a share of the step.
const TIME: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];

/// How each stage follows from those before it; the last row is the step itself, of order 5.
const STAGE: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// Weights of order 5 less those of order 4.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// The target on its way through the horizon.
pub(super) struct Tumbling<'a> {
    target: &'a Target,
    has_gradient: bool,
    n: f64,
    time: f64,
    motion: Motion,
    /// Momentum that counts as one [kg m^2/s].
    scale: f64,
    /// Step to try next [s].
    step: f64,
}

impl<'a> Tumbling<'a> {
    /// At t = 0.
    pub fn new<const NL: usize>(
        mission: &'a Mission<NL>,
        scenario: &Scenario<NL>,
        integrator: Integrator,
    ) -> Self {
        let (target, n) = (&mission.target, mission.mean_motion());
        let rotation = quaternion::rotation_matrix(&scenario.target_attitude);
        let inertial = scenario.target_rate + rotation.transpose() * Vector3::new(0.0, 0.0, n);
        let momentum = rotation * target.inertia_kg_m2.component_mul(&inertial);
        let mut motion = Motion::zeros();
        motion.fixed_rows_mut::<4>(0).copy_from(&scenario.target_attitude);
        motion.fixed_rows_mut::<3>(4).copy_from(&momentum);
        let scale = n * worst(target.inertia_kg_m2.as_slice()) + worst(momentum.as_slice());
        let has_gradient = target.gravity_gradient.is_on(integrator);
        Self { target, has_gradient, n, time: 0.0, motion, scale, step: f64::INFINITY }
    }

    /// The states at the ends of the parts of interval `k` of length `dt`.
    pub fn along(&mut self, k: usize, dt: f64) -> [TargetState; PARTS + 1] {
        core::array::from_fn(|part| {
            self.advance((k as f64 + part as f64 / PARTS as f64) * dt);
            self.state()
        })
    }

    /// Attitude and rate relative to RTN, now.
    pub fn state(&self) -> TargetState {
        let (sin, cos) = libm::sincos(0.5 * self.n * self.time);
        let back = Vector4::new(0.0, 0.0, -sin, cos);
        let (attitude, momentum) = taken_apart(&self.motion);
        let inertial = self.rate(&attitude, &momentum);
        let rate = quaternion::rotation_matrix(&back) * inertial - Vector3::new(0.0, 0.0, self.n);
        TargetState { attitude: quaternion::product(&back, &attitude), rate }
    }

    /// On to time `to` [s].
    fn advance(&mut self, to: f64) {
        // Bound: target_steps.
        for _ in 0..MAX_TARGET_STEPS {
            let left = to - self.time;
            if !(left > 0.0) {
                return;
            }
            let h = if self.step < left { self.step } else { left };
            let (next, error) = self.trial(h);
            if error <= STEP_ERROR {
                let (attitude, _) = taken_apart(&next);
                self.motion = next;
                self.motion.fixed_rows_mut::<4>(0).copy_from(&quaternion::normalized(&attitude));
                self.time = if h < left { self.time + h } else { to };
                if error <= STEP_ERROR / 64.0 && h >= self.step {
                    self.step = 2.0 * h;
                }
            } else if error.is_nan() {
                break;
            } else {
                self.step = 0.5 * h;
            }
        }
        if !(self.time >= to) {
            self.motion = Motion::repeat(f64::NAN);
            self.time = to;
        }
    }

    /// One step of `h`, not normalised, and its error.
    fn trial(&self, h: f64) -> (Motion, f64) {
        let mut rates = [Motion::zeros(); STAGES];
        let mut at = self.motion;
        for i in 0..STAGES {
            at = self.motion;
            for (rate, weight) in rates.iter().zip(&STAGE[i]).take(i) {
                at += rate * (weight * h);
            }
            rates[i] = self.rates(self.time + TIME[i] * h, &at);
        }
        let mut error = Motion::zeros();
        for i in 0..STAGES {
            error += rates[i] * (ERROR[i] * h);
        }
        let (attitude, momentum) = taken_apart(&error);
        let momentum = momentum / self.scale;
        let worst_of_both = worst(&[worst(attitude.as_slice()), worst(momentum.as_slice())]);
        (at, worst_of_both)
    }

    fn rates(&self, time: f64, motion: &Motion) -> Motion {
        let (attitude, momentum) = taken_apart(motion);
        let rate = self.rate(&attitude, &momentum);
        let mut out = Motion::zeros();
        out.fixed_rows_mut::<4>(0).copy_from(&quaternion::derivative(&attitude, &rate));
        if self.has_gradient {
            let (sin, cos) = libm::sincos(self.n * time);
            let radial = Vector3::new(cos, sin, 0.0);
            let rotation = quaternion::rotation_matrix(&attitude);
            let weighted =
                self.target.inertia_kg_m2.component_mul(&(rotation.transpose() * radial));
            let torque = radial.cross(&(rotation * weighted)) * (3.0 * self.n * self.n);
            out.fixed_rows_mut::<3>(4).copy_from(&torque);
        }
        out
    }

    /// Angular velocity, inertial axes [rad/s].
    fn rate(&self, attitude: &Vector4<f64>, momentum: &Vector3<f64>) -> Vector3<f64> {
        let rotation = quaternion::rotation_matrix(attitude);
        rotation * (rotation.transpose() * momentum).component_div(&self.target.inertia_kg_m2)
    }
}

fn taken_apart(motion: &Motion) -> (Vector4<f64>, Vector3<f64>) {
    (motion.fixed_rows::<4>(0).into_owned(), motion.fixed_rows::<3>(4).into_owned())
}
