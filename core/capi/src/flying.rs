//! Guidance, from C.
#![allow(unsafe_code, reason = "symbols of C, and pointers that come with them")]

use crate::abi::{REMORA_FLIGHT_BYTES, REMORA_WORKSPACE_BYTES};
use crate::environment;
use crate::memory::{Flight, InUse, Last, Workspace, look, make_flight};
use crate::pointers::{Out, look_at_abi, look_at_memory, read, status};
use crate::{RemoraCommand, RemoraEstimate, RemoraGuidance, RemoraLimits, RemoraStatus};
use core::ffi::c_void;
use remora_core::advanced::guidance::NotFlyable;
use remora_core::advanced::qp::Valid;
use remora_core::prelude::{Estimate, Guidance, GuidanceSettings, Limits, Mission};

/// remora_ask: another plan is wanted.
pub const REMORA_REPLAN: u32 = 1;
/// remora_ask: leave the target, from the next step on; there is no way back.
pub const REMORA_ABORT: u32 = 2;

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

/// Hands the plan in the workspace to a flight, its first node at time `begins` on the clock of the estimates
/// [s]. A flight that has a plan goes over to this one: the command does not jump. Plans of one flight begin
/// at different times.
///
/// # Safety
/// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `flight` NULL or REMORA_FLIGHT_BYTES.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_flight_plan(
    workspace: *const c_void,
    begins: f64,
    flight: *mut c_void,
) -> RemoraStatus {
    // SAFETY: the caller's word; marks tell a workspace from a flight, so that they are not one memory.
    let hand_over = || unsafe {
        environment::check()?;
        if !begins.is_finite() {
            return Err(RemoraStatus::InvalidTime);
        }
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
        if flight.has_plan && flight.plan.begins == begins {
            return Err(RemoraStatus::InvalidTime);
        }
        let (path, motion) = (planner.translation(), planner.reorientation());
        let written = flight.plan.write(mission, scenario, *integrator, path, motion);
        written.map_err(|why| match why {
            NotFlyable::Euler => RemoraStatus::EulerPlan,
            NotFlyable::Unverified => RemoraStatus::NotFlyable,
        })?;
        flight.plan.begins = begins;
        flight.mission = *mission;
        flight.has_plan = true;
        Ok(())
    };
    status(hand_over())
}

/// One step of guidance, at any rate from 0.2 to 20 Hz: what the actuators are to do from the estimate's time
/// to the next step's. `limits` may be NULL: those of the servicer.
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
        let estimate = read(estimate)?.estimate()?;
        let given = if limits.is_null() { None } else { Some(read(limits)?.limits()?) };
        let mut flight = InUse::<Flight>::enter(flight)?;
        let Flight { guidance, mission, plan, has_plan } = &mut *flight;
        if !*has_plan {
            return Err(RemoraStatus::NoFlightPlan);
        }
        let limits = given.unwrap_or_else(|| Limits::of(&mission.servicer));
        out.write(RemoraCommand::of(&guidance.step(mission, plan, &estimate, &limits)));
        Ok(())
    };
    status(step())
}

/// What navigation would know at a time, were the servicer and the target exactly where the flight's plan
/// expects them: for tests of what surrounds guidance.
///
/// # Safety
/// As remora_guide.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_expected(
    flight: *const c_void,
    time: f64,
    estimate: *mut RemoraEstimate,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let expect = || unsafe {
        environment::check()?;
        let out = Out::sized(estimate, flight, REMORA_FLIGHT_BYTES)?;
        if !time.is_finite() {
            return Err(RemoraStatus::InvalidTime);
        }
        let Flight { mission, plan, has_plan, .. } = look(flight)?;
        if !*has_plan {
            return Err(RemoraStatus::NoFlightPlan);
        }
        let planned = plan.at(mission, time);
        out.write(RemoraEstimate::of(&Estimate::as_planned(mission, time, &planned)));
        Ok(())
    };
    status(expect())
}

/// Asks a flight for something: REMORA_REPLAN or REMORA_ABORT.
///
/// # Safety
/// `flight` is NULL or REMORA_FLIGHT_BYTES long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_ask(flight: *mut c_void, what: u32) -> RemoraStatus {
    let ask = || {
        // SAFETY: the caller's word.
        let mut flight = unsafe { InUse::<Flight>::enter(flight)? };
        match what {
            REMORA_REPLAN => flight.guidance.ask_for_plan(),
            REMORA_ABORT => flight.guidance.abort(),
            _ => return Err(RemoraStatus::InvalidOption),
        }
        Ok(())
    };
    status(ask())
}
