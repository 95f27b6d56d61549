//! Planning, from C.
#![allow(unsafe_code, reason = "symbols of C, and pointers that come with them")]

use crate::abi::{
    REMORA_FLIGHT_BYTES, REMORA_SELF_TEST_EULER, REMORA_SELF_TEST_RK4, REMORA_WORKSPACE_BYTES,
};
use crate::environment;
use crate::memory::{Flight, InUse, Last, Workspace, look, make_workspace};
use crate::pointers::{Out, look_at_abi, look_at_memory, read, status};
use crate::report::{RemoraNode, RemoraRecord, RemoraReport, RemoraVerification};
use crate::scenario::CallersClock;
use crate::{
    RemoraEstimate, RemoraGuidance, RemoraIntegratorCode, RemoraMission, RemoraOptions,
    RemoraScenario, RemoraStatus,
};
use core::ffi::c_void;
use remora_core::advanced::qp::dense::is_usable;
use remora_core::advanced::qp::{Valid, Validate};
use remora_core::prelude::{
    Control, Estimate, InitialGuess, Mission, Model, Network, NetworkMemory, NetworkPolicy,
    Nominal, Options, OptionsBuilder, Planner, Scenario, Vector3, Vector4,
};

/// Fills in what most callers begin with, sizes included; each pointer may be NULL. What a caller does not set
/// afterwards keeps what stands here.
///
/// # Safety
/// Each pointer is NULL or leads to room for its structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_defaults(
    abi: u32,
    mission: *mut RemoraMission,
    scenario: *mut RemoraScenario,
    options: *mut RemoraOptions,
    guidance: *mut RemoraGuidance,
) -> RemoraStatus {
    /// The place, where one is given.
    unsafe fn place<T: Copy>(pointer: *mut T) -> Result<Option<Out<T>>, RemoraStatus> {
        // SAFETY: the caller's word.
        (!pointer.is_null()).then(|| unsafe { Out::plain(pointer) }).transpose()
    }
    let places = || {
        look_at_abi(abi)?;
        // SAFETY: the caller's word.
        unsafe { Ok((place(mission)?, place(scenario)?, place(options)?, place(guidance)?)) }
    };
    status(places().map(|(mission, scenario, options, guidance)| {
        if let Some(out) = mission {
            out.write(RemoraMission::of(&Mission::default()));
        }
        if let Some(out) = scenario {
            out.write(RemoraScenario::of(&Scenario::default()));
        }
        if let Some(out) = options {
            out.write(RemoraOptions::DEFAULT);
        }
        if let Some(out) = guidance {
            out.write(RemoraGuidance::of(&Default::default()));
        }
    }))
}

/// Makes a workspace of memory: at least REMORA_WORKSPACE_BYTES, at a multiple of REMORA_ALIGNMENT. It stays
/// the caller's, is never freed, and may be opened again for another mission. One thread uses it at a time.
/// Where a plan was cut off by a reset, fill the first 64 bytes with zero before.
///
/// # Safety
/// `memory` is NULL or `bytes` long; `mission` is NULL or as long as its first member says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_open(
    memory: *mut c_void,
    bytes: usize,
    abi: u32,
    mission: *const RemoraMission,
) -> RemoraStatus {
    let open = || {
        look_at_abi(abi)?;
        look_at_memory(memory, bytes, REMORA_WORKSPACE_BYTES)?;
        environment::check()?;
        // SAFETY: the caller's word, and the looks above.
        unsafe {
            if look::<Workspace>(memory).is_err_and(|why| why == RemoraStatus::Busy) {
                return Err(RemoraStatus::Busy);
            }
            let mission = read(mission)?.validated()?;
            make_workspace(memory, mission);
        }
        Ok(())
    };
    status(open())
}

/// Plans one approach. Where the scenario is refused, the report says why and the workspace holds no plan;
/// where anything else is wrong, nothing is changed. REMORA_STATUS_OK says that there is a plan; whether it
/// can be flown is RemoraReport.is_verified.
///
/// # Safety
/// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, structures are NULL or as long as their first members
/// say, the model's file is as long as is said, callbacks can be called.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_plan(
    workspace: *mut c_void,
    scenario: *const RemoraScenario,
    options: *const RemoraOptions,
    report: *mut RemoraReport,
) -> RemoraStatus {
    // SAFETY: the caller's word, here and below.
    let plan = || unsafe {
        environment::check()?;
        let out = Out::sized(report, workspace, REMORA_WORKSPACE_BYTES)?;
        let (scenario, options) = (read(scenario)?.validated()?, read(options)?);
        let file = model_file(&options)?;
        let clock = CallersClock::new(&options);
        let builder = builder(&options, &clock)?;
        let mut workspace = InUse::<Workspace>::enter(workspace)?;
        let begun = clock.reading();
        let (report, result) = plan_from(&mut workspace, &scenario, builder, file, options.seed);
        let planning_time_s = clock.reading() - begun;
        out.write(RemoraReport { planning_time_s, ..report });
        result
    };
    status(plan())
}

/// Plans the rest of a flight's plan again, to take over `lead_s` seconds after the estimate, with that plan
/// as the guess; a model is not asked. The flight is read before planning begins and stays as it is: it takes
/// the new plan by remora_flight_plan(workspace, report.begins_s, flight). A flight that another thread guides
/// meanwhile is given as a copy.
///
/// # Safety
/// As remora_plan; `flight` is NULL or REMORA_FLIGHT_BYTES long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_replan(
    workspace: *mut c_void,
    flight: *const c_void,
    estimate: *const RemoraEstimate,
    lead_s: f64,
    options: *const RemoraOptions,
    report: *mut RemoraReport,
) -> RemoraStatus {
    // SAFETY: the caller's word, here and below.
    let replan = || unsafe {
        environment::check()?;
        Out::sized(report, flight, REMORA_FLIGHT_BYTES)?;
        let out = Out::sized(report, workspace, REMORA_WORKSPACE_BYTES)?;
        let (estimate, options) = (read(estimate)?.estimate()?, read(options)?);
        if !estimate.is_finite() {
            return Err(RemoraStatus::NotFinite);
        }
        if !(is_usable(lead_s) && lead_s >= 0.0) {
            return Err(RemoraStatus::InvalidTime);
        }
        let clock = CallersClock::new(&options);
        let builder = builder(&options, &clock)?;
        let mut workspace = InUse::<Workspace>::enter(workspace)?;
        let Workspace { mission, planner, nominal, last, .. } = &mut *workspace;
        let left = what_is_left(look(flight)?, mission, &estimate, lead_s, nominal)?;
        let begun = clock.reading();
        let guess = InitialGuess::Nominal { plan: nominal, elapsed: left.elapsed };
        let builder = builder.initial_guess(guess);
        let (report, result) = make(mission, planner, last, &left.scenario, builder);
        let planning_time_s = clock.reading() - begun;
        out.write(RemoraReport { planning_time_s, begins_s: left.begins, ..report });
        result
    };
    status(replan())
}

/// Rest of a flight's plan.
struct Left {
    scenario: Valid<Scenario>,
    elapsed: f64,
    begins: f64,
}

/// Rest of a flight's plan `lead` seconds from now; the guess for it goes to `nominal`.
// Separate function: its memory is not on the stack of planning.
#[inline(never)]
fn what_is_left(
    flight: &Flight,
    mission: &Valid<Mission>,
    estimate: &Estimate,
    lead: f64,
    nominal: &mut Nominal,
) -> Result<Left, RemoraStatus> {
    let Flight { guidance, plan, has_plan, .. } = flight;
    if !has_plan {
        return Err(RemoraStatus::NoFlightPlan);
    }
    if flight.mission != *mission {
        return Err(RemoraStatus::OtherMission);
    }
    let next = guidance.replan(mission, plan, estimate, lead).ok_or(RemoraStatus::NothingLeft)?;
    let scenario = next.scenario.validated().map_err(|_| RemoraStatus::InvalidScenario)?;
    *nominal = next.nominal;
    Ok(Left { scenario, elapsed: next.elapsed, begins: next.begins })
}

/// The bytes of the model's file, if any.
///
/// # Safety
/// They are there for as long as the call lasts.
unsafe fn model_file<'a>(options: &RemoraOptions) -> Result<Option<&'a [u8]>, RemoraStatus> {
    match (options.model.is_null(), options.model_bytes) {
        (true, 0) => Ok(None),
        (true, _) => Err(RemoraStatus::Null),
        (false, bytes) if bytes > isize::MAX as usize => Err(RemoraStatus::InvalidOption),
        // SAFETY: the caller's word.
        (false, bytes) => unsafe { Ok(Some(core::slice::from_raw_parts(options.model, bytes))) },
    }
}

/// The options of a plan, all in their ranges, from the heuristic guess.
fn builder<'a>(
    options: &RemoraOptions,
    clock: &'a CallersClock,
) -> Result<OptionsBuilder<'a>, RemoraStatus> {
    let builder = Options::builder().mode(options.mode()?).integrator(options.integrator()?);
    let builder = builder.clock(clock, options.deadline()?);
    builder.build().map(|_| builder).map_err(|_| RemoraStatus::InvalidOption)
}

type Made = (RemoraReport, Result<(), RemoraStatus>);

/// Plans from a model's file, or without one from the heuristic.
#[inline(never)]
fn plan_from(
    workspace: &mut Workspace,
    scenario: &Valid<Scenario>,
    builder: OptionsBuilder<'_>,
    file: Option<&[u8]>,
    seed: u64,
) -> Made {
    let Workspace { mission, planner, network, last, .. } = workspace;
    let model = file.and_then(|file| Model::open(file).ok());
    let policy = model.as_ref().and_then(|model| policy(model, network));
    let guess = match (&policy, file) {
        (Some(policy), _) => InitialGuess::Learned { policy, seed },
        (None, Some(_)) => InitialGuess::Refused,
        (None, None) => InitialGuess::Heuristic,
    };
    make(mission, planner, last, scenario, builder.initial_guess(guess))
}

fn policy<'n>(
    model: &'n Model<'n>,
    memory: &'n mut NetworkMemory,
) -> Option<NetworkPolicy<'n, 'n, NetworkMemory>> {
    NetworkPolicy::new(Network::new(model, memory).ok()?).ok()
}

/// Makes a plan; notes what it was made from.
#[inline(never)]
fn make(
    mission: &Valid<Mission>,
    planner: &mut Planner,
    last: &mut Option<Last>,
    scenario: &Valid<Scenario>,
    builder: OptionsBuilder<'_>,
) -> Made {
    *last = None;
    let Ok(options) = builder.build() else {
        return (RemoraReport::NOTHING, Err(RemoraStatus::InvalidOption));
    };
    let grid = mission.grid(scenario);
    let integrator = options.settings().integrator;
    match planner.plan(mission, scenario, &options) {
        Ok(plan) => {
            let report = *plan.report();
            *last = Some(Last { scenario: *scenario, integrator, report });
            let told = RemoraReport::of(&report);
            (RemoraReport { nodes: grid.nodes as u32, duration_s: grid.duration, ..told }, Ok(()))
        }
        Err(refusal) => (RemoraReport::refused(&refusal), Err(RemoraStatus::Refused)),
    }
}

/// The plan in the workspace.
fn last(workspace: &Workspace) -> Result<&Last, RemoraStatus> {
    workspace.last.as_ref().ok_or(RemoraStatus::NoPlan)
}

/// Copies a node of the plan out, from 0 to RemoraReport.nodes - 1.
///
/// # Safety
/// As remora_plan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_node(
    workspace: *const c_void,
    index: u32,
    node: *mut RemoraNode,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let copy = || unsafe {
        let out = Out::sized(node, workspace, REMORA_WORKSPACE_BYTES)?;
        out.write(node_of(look(workspace)?, index)?);
        Ok(())
    };
    status(copy())
}

fn node_of(workspace: &Workspace, index: u32) -> Result<RemoraNode, RemoraStatus> {
    let grid = workspace.mission.grid(&last(workspace)?.scenario);
    let k = index as usize;
    let path = workspace.planner.translation();
    let motion = workspace.planner.reorientation();
    let (true, Some(position), Some(velocity), Some(state)) =
        (k < grid.nodes, path.position.get(k), path.velocity.get(k), motion.states.get(k))
    else {
        return Err(RemoraStatus::NoSuchNode);
    };
    let is_held = k < grid.last();
    let force = path.force.get(k).filter(|_| is_held).copied().unwrap_or_default();
    let control = motion.controls.get(k).filter(|_| is_held).copied().unwrap_or(Control::ZERO);
    Ok(RemoraNode {
        size: size_of::<RemoraNode>() as u32,
        index,
        time_s: grid.time(k),
        com_position_rtn_m: (*position).into(),
        com_velocity_rtn_m_s: (*velocity).into(),
        bus_attitude_body_to_rtn: state.attitude.into(),
        bus_rate_rtn_rad_s: state.rate.into(),
        joint_angle_rad: state.joint_angle.into(),
        joint_rate_rad_s: state.joint_rate.into(),
        bus_force_rtn_n: force.into(),
        bus_torque_body_n_m: control.bus_torque.into(),
        joint_torque_n_m: control.joint_torque.into(),
    })
}

/// Runs the independent verifier again on the plan in the workspace.
///
/// # Safety
/// As remora_plan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_verify(
    workspace: *const c_void,
    verification: *mut RemoraVerification,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let verify = || unsafe {
        environment::check()?;
        let out = Out::sized(verification, workspace, REMORA_WORKSPACE_BYTES)?;
        let Workspace { mission, planner, last: made, .. } = look(workspace)?;
        let Last { scenario, integrator, .. } = made.as_ref().ok_or(RemoraStatus::NoPlan)?;
        let options = Options::builder().integrator(*integrator).build();
        let options = options.map_err(|_| RemoraStatus::InvalidOption)?;
        let found = planner.verify(mission, scenario, &options);
        let is_verified = found.residuals.are_within(&mission.tolerances);
        out.write(RemoraVerification::of(&found, is_verified));
        Ok(())
    };
    status(verify())
}

/// Copies the record of the plan in the workspace out: what is to be filed with it.
///
/// # Safety
/// As remora_plan.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_record(
    workspace: *const c_void,
    record: *mut RemoraRecord,
) -> RemoraStatus {
    // SAFETY: the caller's word.
    let copy = || unsafe {
        let out = Out::sized(record, workspace, REMORA_WORKSPACE_BYTES)?;
        out.write(RemoraRecord::of(&last(look(workspace)?)?.report.record));
        Ok(())
    };
    status(copy())
}

/// Plans a built-in scenario of the built-in mission and tells the plan's checksum, which must be
/// REMORA_SELF_TEST_RK4 or REMORA_SELF_TEST_EULER: otherwise compiler, processor or memory are not what they
/// were tested to be. The workspace holds no plan afterwards.
///
/// # Safety
/// `workspace` is NULL or REMORA_WORKSPACE_BYTES long, `checksum` is NULL or leads to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn remora_self_test(
    workspace: *mut c_void,
    integrator: RemoraIntegratorCode,
    checksum: *mut u64,
) -> RemoraStatus {
    let options = RemoraOptions { integrator, ..RemoraOptions::DEFAULT };
    // SAFETY: the caller's word; there is no callback.
    let test = || unsafe {
        environment::check()?;
        let out = Out::plain(checksum)?;
        let clock = CallersClock::new(&options);
        let builder = builder(&options, &clock)?;
        let mut workspace = InUse::<Workspace>::enter(workspace)?;
        let mission = Valid::of_constant(Mission::default());
        let Workspace { planner, last, .. } = &mut *workspace;
        let (report, result) = make(&mission, planner, last, &self_test_scenario()?, builder);
        *last = None;
        out.write(report.checksum);
        result.map(|()| report.checksum)
    };
    let right = [REMORA_SELF_TEST_RK4, REMORA_SELF_TEST_EULER];
    match test() {
        Ok(sum) if right.get(integrator as usize) == Some(&sum) => RemoraStatus::Ok,
        Ok(_) => RemoraStatus::WrongChecksum,
        Err(status) => status,
    }
}

/// The scenario of the examples: 8 m above a target that tumbles.
fn self_test_scenario() -> Result<Valid<Scenario>, RemoraStatus> {
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(2.0e-4, 0.0, 1.0e-3),
        position: Vector3::new(8.0, 0.0, 0.0),
        ..Scenario::default()
    };
    scenario.validated().map_err(|_| RemoraStatus::InvalidScenario)
}
