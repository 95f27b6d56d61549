//! Input and output of guidance, as C has them.
#![allow(unsafe_code, reason = "says what a structure begins with")]

use crate::RemoraStatus;
use crate::abi::REMORA_JOINTS;
use crate::codes::{RemoraFlightModeCode, RemoraReason, RemoraReasonCode};
use crate::mission::flag;
use crate::pointers::Sized32;
use remora_core::advanced::dynamics::State;
use remora_core::advanced::guidance::{AbortErrors, Closing};
use remora_core::advanced::model::TargetState;
use remora_core::advanced::qp::dense::is_usable;
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::prelude::{Command, Estimate, GuidanceSettings, Limits, Triggers};

/// Settings of guidance; remora_defaults fills in those that the flights of docs/guides/simulate.md were made with.
/// docs/concepts/guidance.md explains each setting. Numbers are finite. Bandwidths and fade times are above zero.
/// Replan and abort errors are above zero too, and INFINITY turns one off. Others are at least zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraGuidance {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Not read.
    pub reserved: u32,
    /// Bandwidth of the centre of mass [rad/s].
    pub com_bandwidth_rad_s: f64,
    /// Bandwidth of the bus attitude [rad/s].
    pub bus_bandwidth_rad_s: f64,
    /// Bandwidth of the joints [rad/s].
    pub joint_bandwidth_rad_s: f64,
    /// Largest product of a bandwidth and the time between steps [rad].
    pub most_per_step_rad: f64,
    /// Integral feedback, over the bandwidth's third power.
    pub integral: f64,
    /// Largest error of the centre of mass that an integral stands for [m].
    pub integral_limit_com_m: f64,
    /// Largest error of an angle that an integral stands for [rad].
    pub integral_limit_angle_rad: f64,
    /// Time over which a new plan's command is faded in [s].
    pub fade_plan_s: f64,
    /// Time over which the turn to the estimated target is faded in [s].
    pub fade_turn_s: f64,
    /// Bandwidth of the offset that the wrist camera measures [rad/s].
    pub camera_bandwidth_rad_s: f64,
    /// The last way: distances that are added, each taken back by itself [m].
    pub closing_distances_m: [f64; 2],
    /// Begin and end of the time in which the distances are added, before capture [s]; falling.
    pub closing_out_s: [f64; 2],
    /// Begin and end of the time in which each distance is taken back, before capture [s]; falling.
    pub closing_back_s: [[f64; 2]; 2],
    /// When the plan's own motion ends, before capture [s].
    pub closing_settle_s: f64,
    /// When another plan is wanted: age of the plan in force [s].
    pub replan_age_s: f64,
    /// Error of the centre of mass [m].
    pub replan_com_m: f64,
    /// Error of the bus attitude [rad].
    pub replan_bus_rad: f64,
    /// Error of the target's attitude from what the plan expects [rad].
    pub replan_target_rad: f64,
    /// Time before capture from which none is wanted any more [s].
    pub replan_last_s: f64,
    /// Abort error of the centre of mass at first [m].
    pub abort_settling_com_m: f64,
    /// Abort error of the bus attitude at first [rad].
    pub abort_settling_bus_rad: f64,
    /// Abort error of a joint at first [rad].
    pub abort_settling_joint_rad: f64,
    /// Abort error of the centre of mass after `abort_settles_s` [m].
    pub abort_settled_com_m: f64,
    /// Abort error of the bus attitude after `abort_settles_s` [rad].
    pub abort_settled_bus_rad: f64,
    /// Abort error of a joint after `abort_settles_s` [rad].
    pub abort_settled_joint_rad: f64,
    /// Time after the first step at which `abort_settled_...` begin to hold [s].
    pub abort_settles_s: f64,
    /// Abort error of the centre of mass near the target [m].
    pub abort_near_com_m: f64,
    /// Abort error of the bus attitude near the target [rad].
    pub abort_near_bus_rad: f64,
    /// Abort error of a joint near the target [rad].
    pub abort_near_joint_rad: f64,
    /// Times before capture: `abort_near_...` hold from the first, that of the centre of mass to the second [s].
    pub abort_near_times_s: [f64; 2],
    /// Most that the end effector may be seen beside the port in the end; twice that is how far across the
    /// port's normal it may be going to be off before [m].
    pub abort_port_m: f64,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraGuidance {}

impl RemoraGuidance {
    /// Converts settings for C.
    pub(crate) fn of(settings: &GuidanceSettings) -> Self {
        let GuidanceSettings { translation, attitude, joint, most_per_step, integral, .. } =
            *settings;
        let GuidanceSettings { integral_limit, fade, camera, closing, triggers, abort, .. } =
            *settings;
        let [integral_limit_com_m, integral_limit_angle_rad] = integral_limit;
        let [fade_plan_s, fade_turn_s] = fade;
        let [abort_settling_com_m, abort_settling_bus_rad, abort_settling_joint_rad] =
            abort.settling;
        let [abort_settled_com_m, abort_settled_bus_rad, abort_settled_joint_rad] = abort.settled;
        let [abort_near_com_m, abort_near_bus_rad, abort_near_joint_rad] = abort.near;
        Self {
            size: size_of::<Self>() as u32,
            reserved: 0,
            com_bandwidth_rad_s: translation,
            bus_bandwidth_rad_s: attitude,
            joint_bandwidth_rad_s: joint,
            most_per_step_rad: most_per_step,
            integral,
            integral_limit_com_m,
            integral_limit_angle_rad,
            fade_plan_s,
            fade_turn_s,
            camera_bandwidth_rad_s: camera,
            closing_distances_m: closing.distances,
            closing_out_s: closing.out,
            closing_back_s: closing.back,
            closing_settle_s: closing.settle,
            replan_age_s: triggers.age,
            replan_com_m: triggers.position,
            replan_bus_rad: triggers.attitude,
            replan_target_rad: triggers.target,
            replan_last_s: triggers.last,
            abort_settling_com_m,
            abort_settling_bus_rad,
            abort_settling_joint_rad,
            abort_settled_com_m,
            abort_settled_bus_rad,
            abort_settled_joint_rad,
            abort_settles_s: abort.settles,
            abort_near_com_m,
            abort_near_bus_rad,
            abort_near_joint_rad,
            abort_near_times_s: abort.near_times,
            abort_port_m: abort.port,
        }
    }

    /// The settings that C tells of, where every number is in its range.
    pub(crate) fn validated(&self) -> Result<Valid<GuidanceSettings>, RemoraStatus> {
        let settings = GuidanceSettings {
            translation: self.com_bandwidth_rad_s,
            attitude: self.bus_bandwidth_rad_s,
            joint: self.joint_bandwidth_rad_s,
            most_per_step: self.most_per_step_rad,
            integral: self.integral,
            integral_limit: [self.integral_limit_com_m, self.integral_limit_angle_rad],
            fade: [self.fade_plan_s, self.fade_turn_s],
            camera: self.camera_bandwidth_rad_s,
            closing: Closing {
                distances: self.closing_distances_m,
                out: self.closing_out_s,
                back: self.closing_back_s,
                settle: self.closing_settle_s,
            },
            triggers: Triggers {
                age: self.replan_age_s,
                position: self.replan_com_m,
                attitude: self.replan_bus_rad,
                target: self.replan_target_rad,
                last: self.replan_last_s,
            },
            abort: self.abort_errors(),
        };
        settings.validated().map_err(|_| RemoraStatus::InvalidSetting)
    }

    fn abort_errors(&self) -> AbortErrors {
        AbortErrors {
            settling: [
                self.abort_settling_com_m,
                self.abort_settling_bus_rad,
                self.abort_settling_joint_rad,
            ],
            settled: [
                self.abort_settled_com_m,
                self.abort_settled_bus_rad,
                self.abort_settled_joint_rad,
            ],
            settles: self.abort_settles_s,
            near: [self.abort_near_com_m, self.abort_near_bus_rad, self.abort_near_joint_rad],
            near_times: self.abort_near_times_s,
            port: self.abort_port_m,
        }
    }
}

/// Largest distance from 1 of the norm of an estimated attitude.
const UNIT: f64 = 1e-3;

/// State that navigation estimates at one instant. NaN and infinity are no misuse: guidance then answers the
/// planned command with REMORA_FLIGHT_MODE_DEGRADED. Attitudes are (x, y, z, w), of norm 1 within 1e-3.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraEstimate {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Whether `ee_from_port_rtn_m` is given; otherwise it is not read.
    pub has_ee_from_port: u32,
    /// Time on the clock that plans are dated by [s].
    pub time_s: f64,
    /// Centre of mass of the bus alone from the target's, RTN [m]; the scenario's is that of bus and arm.
    pub bus_position_rtn_m: [f64; 3],
    /// Its velocity relative to RTN, in RTN [m/s].
    pub bus_velocity_rtn_m_s: [f64; 3],
    /// Attitude of the bus.
    pub bus_attitude_body_to_rtn: [f64; 4],
    /// Its angular velocity relative to RTN, in RTN [rad/s].
    pub bus_rate_rtn_rad_s: [f64; 3],
    /// Joint angles [rad].
    pub joint_angle_rad: [f64; REMORA_JOINTS],
    /// Joint rates [rad/s].
    pub joint_rate_rad_s: [f64; REMORA_JOINTS],
    /// Attitude of the target.
    pub target_attitude_body_to_rtn: [f64; 4],
    /// Angular velocity of the target relative to RTN, in RTN [rad/s]; the scenario's is in target axes.
    pub target_rate_rtn_rad_s: [f64; 3],
    /// End effector from the port, RTN axes [m], where a camera at the wrist sees it.
    pub ee_from_port_rtn_m: [f64; 3],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraEstimate {}

impl RemoraEstimate {
    /// Converts an estimate for C.
    pub(crate) fn of(estimate: &Estimate) -> Self {
        let Estimate { time, position, velocity, state, target, wrist } = *estimate;
        Self {
            size: size_of::<Self>() as u32,
            has_ee_from_port: u32::from(wrist.is_some()),
            time_s: time,
            bus_position_rtn_m: position.into(),
            bus_velocity_rtn_m_s: velocity.into(),
            bus_attitude_body_to_rtn: state.attitude.into(),
            bus_rate_rtn_rad_s: state.rate.into(),
            joint_angle_rad: state.joint_angle.into(),
            joint_rate_rad_s: state.joint_rate.into(),
            target_attitude_body_to_rtn: target.attitude.into(),
            target_rate_rtn_rad_s: target.rate.into(),
            ee_from_port_rtn_m: wrist.unwrap_or_default().into(),
        }
    }

    /// The estimate that C tells of.
    pub(crate) fn estimate(&self) -> Result<Estimate, RemoraStatus> {
        let invalid = RemoraStatus::InvalidEstimate;
        let has_wrist = flag(self.has_ee_from_port, invalid)?;
        let is_rotation = |q: &[f64; 4]| {
            let squared = q.iter().map(|x| x * x).sum::<f64>();
            !((squared - 1.0).abs() > 2.0 * UNIT)
        };
        let attitudes = [self.bus_attitude_body_to_rtn, self.target_attitude_body_to_rtn];
        let are_numbers = attitudes.as_flattened().iter().all(|x| is_usable(*x));
        if are_numbers && !attitudes.iter().all(is_rotation) {
            return Err(invalid);
        }
        Ok(Estimate {
            time: self.time_s,
            position: self.bus_position_rtn_m.into(),
            velocity: self.bus_velocity_rtn_m_s.into(),
            state: State {
                attitude: self.bus_attitude_body_to_rtn.into(),
                joint_angle: self.joint_angle_rad.into(),
                rate: self.bus_rate_rtn_rad_s.into(),
                joint_rate: self.joint_rate_rad_s.into(),
            },
            target: TargetState {
                attitude: self.target_attitude_body_to_rtn.into(),
                rate: self.target_rate_rtn_rad_s.into(),
            },
            wrist: has_wrist.then(|| self.ee_from_port_rtn_m.into()),
        })
    }
}

/// Limits of the actuators now; finite and at least zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraLimits {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Not read.
    pub reserved: u32,
    /// Largest force along each axis, RTN [N].
    pub max_bus_force_rtn_n: [f64; 3],
    /// Largest bus torque about each axis, bus axes [N m].
    pub max_bus_torque_body_n_m: [f64; 3],
    /// Largest joint torques [N m].
    pub max_joint_torque_n_m: [f64; REMORA_JOINTS],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraLimits {}

impl RemoraLimits {
    /// The limits that C tells of, where they are some.
    pub(crate) fn limits(&self) -> Result<Limits, RemoraStatus> {
        let Self { max_bus_force_rtn_n: force, max_bus_torque_body_n_m: bus_torque, .. } = *self;
        let joint_torque = self.max_joint_torque_n_m;
        let all = force.iter().chain(&bus_torque).chain(&joint_torque);
        if !all.into_iter().all(|limit| is_usable(*limit) && *limit >= 0.0) {
            return Err(RemoraStatus::InvalidSetting);
        }
        Ok(Limits {
            force: force.into(),
            bus_torque: bus_torque.into(),
            joint_torque: joint_torque.into(),
        })
    }
}

/// Commands to the actuators until the next step.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraCommand {
    /// Size of this structure in bytes; to be set before the call.
    pub size: u32,
    /// State of guidance.
    pub mode: RemoraFlightModeCode,
    /// Reason why another plan is wanted.
    pub wanted: RemoraReasonCode,
    /// Nothing; zero.
    pub reserved: u32,
    /// Force on the bus at its centre of mass, RTN [N].
    pub bus_force_rtn_n: [f64; 3],
    /// Torque on the bus, bus axes [N m].
    pub bus_torque_body_n_m: [f64; 3],
    /// Joint torques; the feed-forward of joints that follow the references below [N m].
    pub joint_torque_n_m: [f64; REMORA_JOINTS],
    /// Angles for joints with servos of their own [rad].
    pub joint_angle_rad: [f64; REMORA_JOINTS],
    /// Their rates [rad/s].
    pub joint_rate_rad_s: [f64; REMORA_JOINTS],
    /// Error of the centre of mass of bus and arm from what is asked for [m].
    pub com_error_m: f64,
    /// Error of the bus attitude [rad].
    pub bus_error_rad: f64,
    /// Error of the joint farthest off [rad].
    pub joint_error_rad: f64,
    /// Error of the target's attitude from what the plan expects [rad].
    pub target_error_rad: f64,
    /// Share of the force's feedback that the limits leave.
    pub force_share: f64,
    /// Share of the torques' feedback that the limits leave.
    pub torque_share: f64,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraCommand {}

impl RemoraCommand {
    /// Converts a command for C.
    pub(crate) fn of(command: &Command) -> Self {
        let Command { mode, wanted, force, control, joint_angle, joint_rate, error, share } =
            *command;
        let [force_share, torque_share] = share;
        Self {
            size: size_of::<Self>() as u32,
            mode: mode as u32,
            wanted: wanted.map_or(RemoraReason::None as u32, |reason| reason as u32),
            reserved: 0,
            bus_force_rtn_n: force.into(),
            bus_torque_body_n_m: control.bus_torque.into(),
            joint_torque_n_m: control.joint_torque.into(),
            joint_angle_rad: joint_angle.into(),
            joint_rate_rad_s: joint_rate.into(),
            com_error_m: error.position,
            bus_error_rad: error.attitude,
            joint_error_rad: error.joint,
            target_error_rad: error.target,
            force_share,
            torque_share,
        }
    }
}
