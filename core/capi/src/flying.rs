//! Guidance, from C.
#![allow(unsafe_code, reason = "symbols of C, and pointers that come with them")]

use crate::abi::{REMORA_FLIGHT_BYTES, REMORA_WORKSPACE_BYTES};
use crate::environment;
use crate::memory::{Flight, InUse, Last, Workspace, look, make_flight};
use crate::pointers::{Out, look_at_abi, look_at_memory, look_at_time, read, status};
use crate::{
    RemoraCommand, RemoraEstimate, RemoraGuidance, RemoraLimits, RemoraRequestCode, RemoraStatus,
};
use core::ffi::c_void;
use remora_core::advanced::guidance::NotFlyable;
use remora_core::advanced::qp::Valid;
use remora_core::prelude::{Guidance, GuidanceSettings, Limits, Mission};

/// Time from step to step of guidance [s]: 20 to 0.2 Hz, with a tenth for jitter.
const SHORTEST_STEP_S: f64 = 0.9 * 0.05;
const LONGEST_STEP_S: f64 = 1.1 * 5.0;

/// Makes a flight of memory: at least REMORA_FLIGHT_BYTES, at a multiple of REMORA_ALIGNMENT. It stays the
/// caller's. A flight is plain data, which may be copied byte by byte while nobody works in it. `settings` may
/// be NULL: the defaults.
///
/// # Safety
/// `memory` is NULL or `bytes` long; `settings` is NULL or as long as its first member says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_fly(
    memory: *mut c_void,
    bytes: usize,
    abi: u32,
    settings: *const RemoraGuidance,
) -> RemoraStatus {
    // SAFETY: the caller's word, and the looks at the memory.
    let fly = || unsafe {
        look_at_abi(abi)?;
        look_at_memory(memory, bytes, REMORA_FLIGHT_BYTES)?;
        environment::check()?;
        let settings = if settings.is_null() {
            Valid::of_constant(GuidanceSettings::DEFAULT)
        } else {
            read(settings)?.validated()?
        };
        make_flight(memory, Guidance::new(settings), Valid::of_constant(Mission::default()));
        Ok(())
    };
    status(fly())
}

/// Hands the plan in the workspace to a flight; its first node is at `begins_s` on the clock of the estimates
/// [s]. A flight that has a plan goes over to this one: the command does not jump. Plans of one flight begin
/// at different times.
///
/// # Safety
/// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `flight` NULL or REMORA_FLIGHT_BYTES.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_flight_plan(
    workspace: *const c_void,
    begins_s: f64,
    flight: *mut c_void,
) -> RemoraStatus {
    // SAFETY: the caller's word; marks tell a workspace from a flight, so that they are not one memory.
    let hand_over = || unsafe {
        environment::check()?;
        look_at_time(begins_s)?;
        let Workspace { mission, planner, last, .. } = look(workspace)?;
        let Last { scenario, integrator, report } = last.as_ref().ok_or(RemoraStatus::NoPlan)?;
        if !report.is_verified() {
            return Err(RemoraStatus::NotFlyable);
        }
        let distance = flight.addr().abs_diff(workspace.addr());
        if !flight.is_null() && distance < REMORA_FLIGHT_BYTES.min(REMORA_WORKSPACE_BYTES) {
            return Err(RemoraStatus::Overlap);
        }
        let mut flight = InUse::<Flight>::enter(flight)?;
        if flight.has_plan && flight.mission != *mission {
            return Err(RemoraStatus::OtherMission);
        }
        if flight.has_plan && flight.plan.begins == begins_s {
            return Err(RemoraStatus::InvalidTime);
        }
        let (path, motion) = (planner.translation(), planner.reorientation());
        let written = flight.plan.write(mission, scenario, *integrator, path, motion);
        written.map_err(|why| match why {
            NotFlyable::Euler => RemoraStatus::EulerPlan,
            NotFlyable::Unverified => RemoraStatus::NotFlyable,
        })?;
        flight.plan.begins = begins_s;
        flight.mission = *mission;
        flight.has_plan = true;
        Ok(())
    };
    status(hand_over())
}

/// One step of guidance, at any rate from 0.2 to 20 Hz: what the actuators are to do from the estimate's time
/// to the next step's. `limits` may be NULL: those of the servicer.
///
/// REMORA_STATUS_STEP_TIME: the estimate's time is not 0.05 to 5 s after that of the call before, within a tenth.
/// No command is written then. A time that is too late, or before that of the last call, is kept all the same:
/// the next call is measured from it.
///
/// # Safety
/// `flight` is NULL or REMORA_FLIGHT_BYTES long, structures are NULL or as long as their first members say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_guide(
    flight: *mut c_void,
    estimate: *const RemoraEstimate,
    limits: *const RemoraLimits,
    command: *mut RemoraCommand,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let step = || unsafe {
        environment::check()?;
        let out = Out::sized(command, flight, REMORA_FLIGHT_BYTES)?;
        let estimate = read(estimate)?;
        let given = if limits.is_null() { None } else { Some(read(limits)?.limits()?) };
        let mut flight = InUse::<Flight>::enter(flight)?;
        let Flight { guidance, mission, plan, has_plan, last_s } = &mut *flight;
        if !*has_plan {
            return Err(RemoraStatus::NoFlightPlan);
        }
        let estimate = estimate.estimate()?;
        look_at_step(last_s, estimate.time)?;
        let limits = given.unwrap_or_else(|| Limits::of(&mission.servicer));
        out.write(RemoraCommand::of(&guidance.step(mission, plan, &estimate, &limits)));
        Ok(())
    };
    status(step())
}

/// Checks the time since the step before. A time that is not finite passes: guidance judges it.
fn look_at_step(last_s: &mut Option<f64>, time_s: f64) -> Result<(), RemoraStatus> {
    if !time_s.is_finite() {
        return Ok(());
    }
    look_at_time(time_s)?;
    let since = last_s.map_or(SHORTEST_STEP_S, |last_s| time_s - last_s);
    if (0.0..SHORTEST_STEP_S).contains(&since) {
        return Err(RemoraStatus::StepTime);
    }
    *last_s = Some(time_s);
    let is_in_time = (SHORTEST_STEP_S..=LONGEST_STEP_S).contains(&since);
    if is_in_time { Ok(()) } else { Err(RemoraStatus::StepTime) }
}

/// Estimate of a servicer and a target that are exactly where guidance expects them at a step at this time. The
/// servicer is on the plan; near capture it is ahead of it and away from the port. It serves tests of software
/// around guidance: fed to remora_guide step by step it ends in a capture. Before the plan's first node and after
/// its last the target is where it is at that node.
///
/// # Safety
/// As remora_guide.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_expected(
    flight: *const c_void,
    time_s: f64,
    estimate: *mut RemoraEstimate,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let expect = || unsafe {
        environment::check()?;
        let out = Out::sized(estimate, flight, REMORA_FLIGHT_BYTES)?;
        look_at_time(time_s)?;
        let Flight { guidance, mission, plan, has_plan, .. } = look(flight)?;
        if !*has_plan {
            return Err(RemoraStatus::NoFlightPlan);
        }
        out.write(RemoraEstimate::of(&guidance.expected(mission, plan, time_s)));
        Ok(())
    };
    status(expect())
}

/// Asks a flight for another plan, or to leave the target.
///
/// # Safety
/// `flight` is NULL or REMORA_FLIGHT_BYTES long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_ask(flight: *mut c_void, what: RemoraRequestCode) -> RemoraStatus {
    let ask = || {
        // SAFETY: the caller's word.
        let mut flight = unsafe { InUse::<Flight>::enter(flight)? };
        match what {
            1 => flight.guidance.ask_for_plan(),
            2 => flight.guidance.abort(),
            _ => return Err(RemoraStatus::InvalidOption),
        }
        Ok(())
    };
    status(ask())
}
