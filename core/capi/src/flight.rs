//! What guidance is told and what it answers, as C has it.
#![allow(unsafe_code, reason = "says what a structure begins with")]

use crate::RemoraStatus;
use crate::abi::REMORA_JOINTS;
use crate::mission::flag;
use crate::pointers::Sized32;
use remora_core::advanced::dynamics::State;
use remora_core::advanced::guidance::{AbortErrors, Closing};
use remora_core::advanced::model::TargetState;
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::prelude::{Command, Estimate, GuidanceSettings, Limits, Triggers};

/// Settings of guidance; remora_defaults fills in those that the flights of docs/flights.md were made with.
/// What each means is told in docs/guidance.md. INFINITY is never.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraGuidance {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Bandwidths: centre of mass, attitude, joints [rad/s].
    pub bandwidth: [f64; 3],
    /// Largest product of a bandwidth and the time between steps [rad].
    pub most_per_step: f64,
    /// Integral feedback, over the bandwidth's third power.
    pub integral: f64,
    /// Largest error that an integral stands for [m], [rad].
    pub integral_limit: [f64; 2],
    /// Times over which a new plan's command and the turn to the estimated target are faded in [s].
    pub fade: [f64; 2],
    /// Bandwidth of the offset that the wrist camera measures [rad/s].
    pub camera: f64,
    /// The last way: distances that are added, each taken back by itself [m].
    pub closing_distances: [f64; 2],
    /// When they begin to come in and are there, before capture [s].
    pub closing_out: [f64; 2],
    /// When each begins to go and is gone, before capture [s].
    pub closing_back: [[f64; 2]; 2],
    /// When the plan's own motion ends, before capture [s].
    pub closing_settle: f64,
    /// When another plan is wanted: age of the plan in force [s].
    pub replan_age: f64,
    /// Error of the centre of mass [m].
    pub replan_position: f64,
    /// Error of the bus attitude [rad].
    pub replan_attitude: f64,
    /// Error of the target's attitude from what the plan expects [rad].
    pub replan_target: f64,
    /// Time before capture from which none is wanted any more [s].
    pub replan_last: f64,
    /// When the approach is given up at first: position [m], attitude, joint [rad].
    pub abort_settling: [f64; 3],
    /// Likewise afterwards.
    pub abort_settled: [f64; 3],
    /// Time from the first step to then [s].
    pub abort_settles: f64,
    /// Likewise near the target.
    pub abort_near: [f64; 3],
    /// Time before capture from which these hold, and until which that of the position does [s].
    pub abort_near_times: [f64; 2],
    /// Most that the end effector may be seen beside the port in the end; twice that is how far across the
    /// port's normal it may be going to be off before [m].
    pub abort_port: f64,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraGuidance {}

impl RemoraGuidance {
    /// What C is told of settings.
    pub(crate) fn of(settings: &GuidanceSettings) -> Self {
        let GuidanceSettings { translation, attitude, joint, most_per_step, integral, .. } =
            *settings;
        let GuidanceSettings { integral_limit, fade, camera, closing, triggers, abort, .. } =
            *settings;
        Self {
            size: size_of::<Self>() as u32,
            reserved: 0,
            bandwidth: [translation, attitude, joint],
            most_per_step,
            integral,
            integral_limit,
            fade,
            camera,
            closing_distances: closing.distances,
            closing_out: closing.out,
            closing_back: closing.back,
            closing_settle: closing.settle,
            replan_age: triggers.age,
            replan_position: triggers.position,
            replan_attitude: triggers.attitude,
            replan_target: triggers.target,
            replan_last: triggers.last,
            abort_settling: abort.settling,
            abort_settled: abort.settled,
            abort_settles: abort.settles,
            abort_near: abort.near,
            abort_near_times: abort.near_times,
            abort_port: abort.port,
        }
    }

    /// The settings that C tells of, where every number is in its range.
    pub(crate) fn validated(&self) -> Result<Valid<GuidanceSettings>, RemoraStatus> {
        let [translation, attitude, joint] = self.bandwidth;
        let settings = GuidanceSettings {
            translation,
            attitude,
            joint,
            most_per_step: self.most_per_step,
            integral: self.integral,
            integral_limit: self.integral_limit,
            fade: self.fade,
            camera: self.camera,
            closing: Closing {
                distances: self.closing_distances,
                out: self.closing_out,
                back: self.closing_back,
                settle: self.closing_settle,
            },
            triggers: Triggers {
                age: self.replan_age,
                position: self.replan_position,
                attitude: self.replan_attitude,
                target: self.replan_target,
                last: self.replan_last,
            },
            abort: AbortErrors {
                settling: self.abort_settling,
                settled: self.abort_settled,
                settles: self.abort_settles,
                near: self.abort_near,
                near_times: self.abort_near_times,
                port: self.abort_port,
            },
        };
        settings.validated().map_err(|_| RemoraStatus::InvalidSetting)
    }
}

/// What navigation knows at one instant. Numbers that are none are no misuse: guidance then answers what is
/// planned and says so.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraEstimate {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Whether `wrist` is given.
    pub has_wrist: u32,
    /// Time on the clock that plans are dated by [s].
    pub time: f64,
    /// Centre of mass of the bus relative to the target's, RTN [m].
    pub position: [f64; 3],
    /// Its velocity relative to RTN, in RTN [m/s].
    pub velocity: [f64; 3],
    /// Attitude of the bus, (x, y, z, w), body to RTN.
    pub attitude: [f64; 4],
    /// Its angular velocity relative to RTN, in RTN [rad/s].
    pub rate: [f64; 3],
    /// Joint angles [rad].
    pub joint_angle: [f64; REMORA_JOINTS],
    /// Joint rates [rad/s].
    pub joint_rate: [f64; REMORA_JOINTS],
    /// Attitude of the target.
    pub target_attitude: [f64; 4],
    /// Its angular velocity relative to RTN, in RTN [rad/s].
    pub target_rate: [f64; 3],
    /// End effector from the port, RTN axes [m], where a camera at the wrist sees it.
    pub wrist: [f64; 3],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraEstimate {}

impl RemoraEstimate {
    /// What C is told of an estimate.
    pub(crate) fn of(estimate: &Estimate) -> Self {
        let Estimate { time, position, velocity, state, target, wrist } = *estimate;
        Self {
            size: size_of::<Self>() as u32,
            has_wrist: u32::from(wrist.is_some()),
            time,
            position: position.into(),
            velocity: velocity.into(),
            attitude: state.attitude.into(),
            rate: state.rate.into(),
            joint_angle: state.joint_angle.into(),
            joint_rate: state.joint_rate.into(),
            target_attitude: target.attitude.into(),
            target_rate: target.rate.into(),
            wrist: wrist.unwrap_or_default().into(),
        }
    }

    /// The estimate that C tells of.
    pub(crate) fn estimate(&self) -> Result<Estimate, RemoraStatus> {
        let has_wrist = flag(self.has_wrist, RemoraStatus::InvalidOption)?;
        Ok(Estimate {
            time: self.time,
            position: self.position.into(),
            velocity: self.velocity.into(),
            state: State {
                attitude: self.attitude.into(),
                joint_angle: self.joint_angle.into(),
                rate: self.rate.into(),
                joint_rate: self.joint_rate.into(),
            },
            target: TargetState {
                attitude: self.target_attitude.into(),
                rate: self.target_rate.into(),
            },
            wrist: has_wrist.then(|| self.wrist.into()),
        })
    }
}

/// What the actuators can do now.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraLimits {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Largest force along each axis, RTN [N].
    pub force: [f64; 3],
    /// Largest bus torque about each axis, bus axes [N m].
    pub bus_torque: [f64; 3],
    /// Largest joint torques [N m].
    pub joint_torque: [f64; REMORA_JOINTS],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraLimits {}

impl RemoraLimits {
    /// The limits that C tells of, where they are some.
    pub(crate) fn limits(&self) -> Result<Limits, RemoraStatus> {
        let all = self.force.iter().chain(&self.bus_torque).chain(&self.joint_torque);
        if !all.into_iter().all(|limit| (0.0..f64::INFINITY).contains(limit)) {
            return Err(RemoraStatus::InvalidSetting);
        }
        Ok(Limits {
            force: self.force.into(),
            bus_torque: self.bus_torque.into(),
            joint_torque: self.joint_torque.into(),
        })
    }
}

/// What the actuators are to do until the next step.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraCommand {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// 0 tracks, 1 tracks and wants another plan, 2 the estimate is no number, 3 leaves the target, 4 done.
    pub mode: u32,
    /// Why another plan is wanted: 0 it is not, 1 time, 2 error, 3 tumble, 4 the caller asked.
    pub wanted: u32,
    /// Nothing; zero.
    pub reserved: u32,
    /// Force on the bus at its centre of mass, RTN [N].
    pub force: [f64; 3],
    /// Torque on the bus, bus axes [N m].
    pub bus_torque: [f64; 3],
    /// Joint torques; the feed-forward of joints that follow the references below [N m].
    pub joint_torque: [f64; REMORA_JOINTS],
    /// Angles for joints with servos of their own [rad].
    pub joint_angle: [f64; REMORA_JOINTS],
    /// Their rates [rad/s].
    pub joint_rate: [f64; REMORA_JOINTS],
    /// Errors from what is asked for: centre of mass [m], attitude, the joint farthest off, target [rad].
    pub error: [f64; 4],
    /// Shares of the feedback that the limits leave: of the force, of the torques.
    pub share: [f64; 2],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraCommand {}

impl RemoraCommand {
    /// What C is told of a command.
    pub(crate) fn of(command: &Command) -> Self {
        let Command { mode, wanted, force, control, joint_angle, joint_rate, error, share } =
            *command;
        Self {
            size: size_of::<Self>() as u32,
            mode: mode as u32,
            wanted: wanted.map_or(0, |reason| reason as u32),
            reserved: 0,
            force: force.into(),
            bus_torque: control.bus_torque.into(),
            joint_torque: control.joint_torque.into(),
            joint_angle: joint_angle.into(),
            joint_rate: joint_rate.into(),
            error: [error.position, error.attitude, error.joint, error.target],
            share,
        }
    }
}
