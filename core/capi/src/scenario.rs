//! A scenario and the options of a plan as C has them.
#![allow(unsafe_code, reason = "calls the caller's clock")]

use crate::RemoraStatus;
use crate::abi::REMORA_JOINTS;
use crate::codes::{RemoraIntegrator, RemoraIntegratorCode, RemoraMode, RemoraModeCode};
use crate::mission::flag;
use crate::pointers::Sized32;
use core::ffi::c_void;
use core::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use remora_core::advanced::qp::dense::is_usable;
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::nalgebra::{SVector, Vector4};
use remora_core::prelude::{Clock, Integrator, Mode, Refusal, Scenario, Start};

/// One approach: the target's tumble, where the servicer starts, and how long it has. RTN is radial, along
/// track, orbit normal; quaternions are (x, y, z, w), body to RTN.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraScenario {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Nodes of the plan; 0: the mission's.
    pub nodes: u32,
    /// Attitude of the target at t = 0; of norm 1.
    pub target_attitude_body_to_rtn: [f64; 4],
    /// Its angular velocity relative to RTN, in target axes [rad/s].
    pub target_rate_body_rad_s: [f64; 3],
    /// Centre of mass of bus and arm from the target's at t = 0, RTN [m].
    pub com_position_rtn_m: [f64; 3],
    /// Its velocity relative to RTN, in RTN [m/s].
    pub com_velocity_rtn_m_s: [f64; 3],
    /// Time from t = 0 to capture [s]; 0: the mission's.
    pub duration_s: f64,
    /// Whether `bus_attitude_body_to_rtn` is given; otherwise it is not read, and the bus looks at the target.
    pub has_bus_attitude: u32,
    /// Whether `joint_angle_rad` is given; otherwise it is not read, and the arm has the mission's initial angles.
    pub has_joint_angle: u32,
    /// Attitude of the bus at t = 0; of norm 1.
    pub bus_attitude_body_to_rtn: [f64; 4],
    /// Its angular velocity relative to RTN, in RTN [rad/s].
    pub bus_rate_rtn_rad_s: [f64; 3],
    /// Joint angles at t = 0 [rad].
    pub joint_angle_rad: [f64; REMORA_JOINTS],
    /// Joint rates at t = 0 [rad/s].
    pub joint_rate_rad_s: [f64; REMORA_JOINTS],
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraScenario {}

impl RemoraScenario {
    /// Converts a scenario for C.
    pub(crate) fn of(scenario: &Scenario) -> Self {
        let Scenario { target_attitude, target_rate, position, velocity, start, duration, nodes } =
            *scenario;
        Self {
            size: size_of::<Self>() as u32,
            nodes: nodes.unwrap_or(0) as u32,
            target_attitude_body_to_rtn: target_attitude.into(),
            target_rate_body_rad_s: target_rate.into(),
            com_position_rtn_m: position.into(),
            com_velocity_rtn_m_s: velocity.into(),
            duration_s: duration.unwrap_or(0.0),
            has_bus_attitude: u32::from(start.bus_attitude.is_some()),
            has_joint_angle: u32::from(start.joint_angle.is_some()),
            bus_attitude_body_to_rtn: start.bus_attitude.map_or([0.0; 4], Vector4::into),
            bus_rate_rtn_rad_s: start.bus_rate.into(),
            joint_angle_rad: start.joint_angle.map_or([0.0; REMORA_JOINTS], SVector::into),
            joint_rate_rad_s: start.joint_rate.into(),
        }
    }

    /// The scenario that C tells of, where it is one.
    pub(crate) fn validated(&self) -> Result<Valid<Scenario>, RemoraStatus> {
        let invalid = RemoraStatus::InvalidScenario;
        if !is_usable(self.duration_s) {
            return Err(RemoraStatus::NotFinite);
        }
        let has_attitude = flag(self.has_bus_attitude, invalid)?;
        let start = Start {
            bus_attitude: has_attitude.then(|| self.bus_attitude_body_to_rtn.into()),
            bus_rate: self.bus_rate_rtn_rad_s.into(),
            joint_angle: flag(self.has_joint_angle, invalid)?.then(|| self.joint_angle_rad.into()),
            joint_rate: self.joint_rate_rad_s.into(),
        };
        let scenario = Scenario {
            target_attitude: self.target_attitude_body_to_rtn.into(),
            target_rate: self.target_rate_body_rad_s.into(),
            position: self.com_position_rtn_m.into(),
            velocity: self.com_velocity_rtn_m_s.into(),
            start,
            duration: (self.duration_s != 0.0).then_some(self.duration_s),
            nodes: (self.nodes != 0).then_some(self.nodes as usize),
        };
        scenario.validated().map_err(|refusal| match refusal {
            Refusal::NotFinite { .. } => RemoraStatus::NotFinite,
            _ => invalid,
        })
    }
}

/// How to plan. remora_defaults fills in: the optimum, RK4 with eight substeps, the heuristic guess, no
/// deadline.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraOptions {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Goal at which planning ends.
    pub mode: RemoraModeCode,
    /// Integrator of the plan.
    pub integrator: RemoraIntegratorCode,
    /// Substeps of RK4 in an interval, from 4 to 1000; with Euler not read.
    pub substeps: u32,
    /// Time for the whole plan with its verification [s], above 0; INFINITY for none. Needs a clock.
    pub deadline_s: f64,
    /// A learned model's file for the initial guess, at any alignment, or NULL: then, or where the file is
    /// damaged or for other plans, the heuristic serves. Read during the call only.
    pub model: *const u8,
    /// Bytes of the file.
    pub model_bytes: usize,
    /// Seed of a model that samples.
    pub seed: u64,
    /// Reads a monotonic clock [s], or NULL.
    pub clock: Option<unsafe extern "C" fn(context: *mut c_void) -> f64>,
    /// Is called some thousand times a plan, or NULL: the place for a step of guidance on one core. Where
    /// it answers other than zero, planning ends; what is left is not flyable.
    pub should_stop: Option<unsafe extern "C" fn(context: *mut c_void) -> u32>,
    /// Handed to both.
    pub context: *mut c_void,
}

// SAFETY: begins with its size; a pointer may hold any bits until it is followed, functions are NULL or the
// caller's.
unsafe impl Sized32 for RemoraOptions {}

impl RemoraOptions {
    /// The defaults.
    pub(crate) const DEFAULT: Self = Self {
        size: size_of::<Self>() as u32,
        mode: RemoraMode::Optimal as u32,
        integrator: RemoraIntegrator::Rk4 as u32,
        substeps: Integrator::DEFAULT_SUBSTEPS as u32,
        deadline_s: f64::INFINITY,
        model: core::ptr::null(),
        model_bytes: 0,
        seed: 0,
        clock: None,
        should_stop: None,
        context: core::ptr::null_mut(),
    };

    /// Optimality or feasibility.
    pub(crate) fn mode(&self) -> Result<Mode, RemoraStatus> {
        match self.mode {
            0 => Ok(Mode::Optimal),
            1 => Ok(Mode::Feasible),
            _ => Err(RemoraStatus::InvalidOption),
        }
    }

    /// The discretisation.
    pub(crate) fn integrator(&self) -> Result<Integrator, RemoraStatus> {
        match self.integrator {
            0 => Ok(Integrator::Rk4 { substeps: self.substeps as usize }),
            1 => Ok(Integrator::Euler),
            _ => Err(RemoraStatus::InvalidOption),
        }
    }

    /// The deadline: without one, but with something that may stop planning, one that comes only then.
    pub(crate) fn deadline(&self) -> Result<f64, RemoraStatus> {
        match self.deadline_s {
            // NaN is no deadline either.
            time if !(time > 0.0) => Err(RemoraStatus::InvalidOption),
            f64::INFINITY if self.should_stop.is_some() => Ok(LATEST_S),
            time if time < f64::INFINITY && self.clock.is_none() => {
                Err(RemoraStatus::InvalidOption)
            }
            f64::INFINITY => Ok(f64::INFINITY),
            time => Ok(if time < LATEST_S { time } else { LATEST_S }),
        }
    }
}

/// The latest deadline, and the end of time after it. Differences of infinities would be invalid operations.
const LATEST_S: f64 = 1e30;
const END_S: f64 = 1e31;

/// The caller's clock, which stands at the end of time once planning is to stop.
pub(crate) struct CallersClock {
    clock: Option<unsafe extern "C" fn(*mut c_void) -> f64>,
    should_stop: Option<unsafe extern "C" fn(*mut c_void) -> u32>,
    context: AtomicPtr<c_void>,
    stopped: AtomicBool,
}

impl CallersClock {
    /// That of these options.
    ///
    /// # Safety
    /// Its functions can be called with the context for as long as this lives.
    pub(crate) unsafe fn new(options: &RemoraOptions) -> Self {
        let RemoraOptions { clock, should_stop, context, .. } = *options;
        Self {
            clock,
            should_stop,
            context: AtomicPtr::new(context),
            stopped: AtomicBool::new(false),
        }
    }

    /// Reads the caller's clock, stopped or not.
    pub(crate) fn reading(&self) -> f64 {
        let context = self.context.load(Ordering::Relaxed);
        // SAFETY: the word of whoever made this.
        self.clock.map_or(0.0, |clock| unsafe { clock(context) })
    }
}

impl Clock for CallersClock {
    fn seconds(&self) -> f64 {
        if self.stopped.load(Ordering::Relaxed) { END_S } else { self.reading() }
    }

    fn pause(&self) {
        let Some(should_stop) = self.should_stop else { return };
        let context = self.context.load(Ordering::Relaxed);
        // SAFETY: the word of whoever made this.
        if unsafe { should_stop(context) } != 0 {
            self.stopped.store(true, Ordering::Relaxed);
        }
    }
}
