//! Actuators: from what is commanded to what acts.

use crate::dispersion::Dispersion;
use crate::errors::{Faults, Thrusters};
use crate::joints::{JointDrive, JointMode};
use crate::random::{Source, Stream};
use crate::servicer::{Axes, Held};
use crate::ticker::Ticker;
use crate::vehicle::Vehicle;
use nalgebra::{Matrix3, Vector3};

/// Command that holds until guidance gives another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<const NL: usize> {
    /// Force at the vehicle's force point [N], in `axes`.
    pub force: Vector3<f64>,
    /// Axes in which the force stays constant.
    pub axes: Axes,
    /// Torque on the bus, bus axes [N m].
    pub bus_torque: Vector3<f64>,
    /// Command of the joints.
    pub joints: JointCommand<NL>,
}

/// Command of the joints: torques, or references for their inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointCommand<const NL: usize> {
    /// Torques [N m], each on its outer body.
    Torque([f64; NL]),
    /// References for the joints' inner loops, which read the encoders.
    Servo {
        /// Angles at the instant of the command [rad].
        angle: [f64; NL],
        /// Rates at which they go on [rad/s].
        rate: [f64; NL],
        /// Feed-forward [N m].
        torque: [f64; NL],
    },
}

impl<const NL: usize> Default for Command<NL> {
    /// Nothing.
    fn default() -> Self {
        let zero = Vector3::zeros();
        let joints = JointCommand::Torque([0.0; NL]);
        Self { force: zero, axes: Axes::Rtn, bus_torque: zero, joints }
    }
}

/// The actuators with their errors, faults and memory.
#[derive(Clone, Debug)]
pub(crate) struct Actuators<const NL: usize> {
    pub thrusters: ThrusterState,
    pub wheels: WheelState,
    pub joints: JointState<NL>,
    pub faults: Faults,
    /// Acceleration by drag and moment on the bus.
    pub drag: f64,
    pub disturbance: Vector3<f64>,
}

/// Thrusters: errors that stay, and the period under way.
#[derive(Clone, Debug)]
pub(crate) struct ThrusterState {
    /// From asked to given force, bus axes; a column an axis.
    pub gain: Matrix3<f64>,
    pub errors: Thrusters,
    noise: Stream,
    pub ticker: Ticker,
    /// This period's force over the force asked, less noise of axes.
    factors: Vector3<f64>,
    /// With an impulse bit: this period's force [N] and the impulse still owed [N s], bus axes.
    force: Vector3<f64>,
    owed: Vector3<f64>,
}

/// Wheels: errors that stay, and the noise now.
#[derive(Clone, Debug)]
pub(crate) struct WheelState {
    pub scale: [f64; 3],
    pub bias: [f64; 3],
    deviation: f64,
    noise: Stream,
    pub ticker: Ticker,
    now: [f64; 3],
}

/// Joints: errors that stay.
#[derive(Clone, Debug)]
pub(crate) struct JointState<const NL: usize> {
    pub gain: [f64; NL],
    pub bias: [f64; NL],
    pub friction: [f64; NL],
    pub friction_rate: f64,
    pub encoder_bias: [f64; NL],
}

impl ThrusterState {
    fn new(dispersion: &Dispersion) -> Self {
        let e = &dispersion.errors.thrusters;
        let scale = dispersion.stream(Source::ThrusterScale).normals::<3>(e.scale);
        let turn = dispersion.stream(Source::ThrusterDirection).normals::<6>(e.direction_rad);
        let gain = Matrix3::from_fn(|row, axis| {
            let direction = match (row + 3 - axis) % 3 {
                0 => 1.0,
                1 => turn[2 * axis],
                _ => turn[2 * axis + 1],
            };
            direction * (1.0 + scale[axis])
        });
        let fires = e.impulse_bit_n_s > 0.0 || e.noise > 0.0;
        Self {
            gain,
            errors: e.clone(),
            noise: dispersion.stream(Source::ThrusterNoise),
            ticker: Ticker::new(if fires { 1.0 / e.period_s } else { 0.0 }),
            factors: Vector3::from_element(1.0),
            force: Vector3::zeros(),
            owed: Vector3::zeros(),
        }
    }

    /// Begins a period: how much is fired in it. What rounding leaves is owed to the next ones.
    fn fire(&mut self, asked: &Vector3<f64>) {
        let (bit, period) = (self.errors.impulse_bit_n_s, self.errors.period_s);
        self.factors = Vector3::from_element(1.0) + self.noise.vector(self.errors.noise);
        if bit > 0.0 {
            let wanted = asked * period + self.owed;
            let impulse = wanted.map(|impulse| libm::rint(impulse / bit) * bit);
            self.owed = wanted - impulse;
            self.force = impulse / period;
        }
    }
}

impl WheelState {
    fn new(dispersion: &Dispersion) -> Self {
        let e = &dispersion.errors.wheels;
        let scale = dispersion.stream(Source::WheelScale).normals::<3>(e.scale);
        let noisy = e.noise_n_m > 0.0;
        Self {
            scale: scale.map(|error| 1.0 + error),
            bias: dispersion.stream(Source::WheelBias).normals(e.bias_n_m),
            deviation: e.noise_n_m,
            noise: dispersion.stream(Source::WheelNoise),
            ticker: Ticker::new(if noisy { 1.0 / e.noise_period_s } else { 0.0 }),
            now: [0.0; 3],
        }
    }

    /// Torque on the bus [N m]: none that would drive a full wheel fuller.
    fn torque(&self, asked: &Vector3<f64>, full: &[f64; 3], wheels: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let torque = asked[i] * self.scale[i] + self.bias[i] + self.now[i];
            let saturated = wheels[i].abs() >= full[i] && torque * wheels[i] < 0.0;
            if saturated { 0.0 } else { torque }
        })
    }
}

impl<const NL: usize> JointState<NL> {
    fn new(dispersion: &Dispersion) -> Self {
        let e = &dispersion.errors.joints;
        let scale = dispersion.stream(Source::JointScale).normals::<NL>(e.scale);
        let friction = dispersion.stream(Source::JointFriction).normals::<NL>(e.friction_n_m);
        Self {
            gain: scale.map(|error| 1.0 + error),
            bias: dispersion.stream(Source::JointBias).normals(e.bias_n_m),
            friction: friction.map(f64::abs),
            friction_rate: e.friction_rate_rad_s,
            encoder_bias: dispersion.stream(Source::EncoderBias).normals(e.angle_bias_rad),
        }
    }
}

/// Time, momentum and inertia at an instant, for the actuators.
pub(crate) struct Moment<'a, const NL: usize> {
    pub time: f64,
    /// When the command came.
    pub commanded: f64,
    /// Commanded force in bus axes, limited [N].
    pub force: Vector3<f64>,
    /// Momentum of the wheels, bus axes.
    pub wheels: Vector3<f64>,
    /// Inertia each joint moves; needed in servo mode.
    pub felt: &'a [f64; NL],
}

impl<const NL: usize> Actuators<NL> {
    pub fn new(dispersion: &Dispersion) -> Self {
        let o = &dispersion.errors.orbit;
        let [drag] = dispersion.stream(Source::Drag).normals::<1>(o.drag_m_s2);
        Self {
            thrusters: ThrusterState::new(dispersion),
            wheels: WheelState::new(dispersion),
            joints: JointState::new(dispersion),
            faults: dispersion.faults(),
            drag,
            disturbance: dispersion.stream(Source::Disturbance).vector(o.disturbance_n_m),
        }
    }

    /// The next instant after `now` at which what acts may change by itself [s].
    pub fn next(&self) -> f64 {
        self.thrusters.ticker.next().min(self.wheels.ticker.next())
    }

    /// Computes the forces and torques that act from now on.
    pub fn hold(
        &mut self,
        vehicle: &Vehicle<NL>,
        command: &Command<NL>,
        moment: &Moment<NL>,
    ) -> Held<NL> {
        if self.thrusters.ticker.strikes(moment.time) {
            self.thrusters.fire(&moment.force);
        }
        if self.wheels.ticker.strikes(moment.time) {
            self.wheels.now = self.wheels.noise.normals(self.wheels.deviation);
        }
        let mut factors = self.thrusters.factors;
        if let Some(lost) = self.faults.thruster_lost
            && moment.time + crate::ticker::SAME >= lost.time_s
        {
            factors[lost.axis] = 0.0;
        }
        let pulsed = self.thrusters.errors.impulse_bit_n_s > 0.0;
        let (force, axes) = if pulsed {
            (self.thrusters.force, Axes::Bus)
        } else {
            (limited(&command.force, &vehicle.limits.force), command.axes)
        };
        let asked = limited(&command.bus_torque, &vehicle.limits.bus_torque);
        let full = &vehicle.limits.wheel_momentum;
        Held {
            force,
            axes,
            thrusters: self.thrusters.gain * Matrix3::from_diagonal(&factors),
            bus_torque: self.wheels.torque(&asked, full, &moment.wheels),
            disturbance: self.disturbance,
            drag: self.drag,
            joints: core::array::from_fn(|j| self.drive(vehicle, command, moment, j)),
            locked: self.locked(moment.time),
        }
    }

    /// Finds the joints that are held by their brakes.
    pub fn locked(&self, time: f64) -> [bool; NL] {
        let stuck = self.faults.joint_stuck;
        core::array::from_fn(|j| {
            stuck.is_some_and(|s| s.joint == j && time + crate::ticker::SAME >= s.time_s)
        })
    }

    fn drive(
        &self,
        vehicle: &Vehicle<NL>,
        command: &Command<NL>,
        moment: &Moment<NL>,
        j: usize,
    ) -> JointDrive {
        let mode = match &command.joints {
            JointCommand::Torque(torque) => JointMode::Torque(torque[j]),
            JointCommand::Servo { angle, rate, torque } => {
                let (servo, inertia) = (&vehicle.servo[j], moment.felt[j]);
                JointMode::Servo {
                    time: moment.commanded,
                    // The loop holds what the encoder reads at the reference.
                    angle: angle[j] - self.joints.encoder_bias[j],
                    rate: rate[j],
                    torque: torque[j],
                    stiffness: inertia * servo.bandwidth * servo.bandwidth,
                    damping: 2.0 * inertia * servo.damping * servo.bandwidth,
                }
            }
        };
        JointDrive {
            mode,
            limit: vehicle.limits.joint_torque[j],
            gain: self.joints.gain[j],
            bias: self.joints.bias[j],
            friction: self.joints.friction[j],
            friction_rate: self.joints.friction_rate,
        }
    }
}

/// Each component within its limit.
pub(crate) fn limited(v: &Vector3<f64>, limits: &[f64; 3]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| v[i].clamp(-limits[i], limits[i]))
}
