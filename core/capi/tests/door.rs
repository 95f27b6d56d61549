//! What C gets is what Rust gets: guidance and replanning step by step, models, clocks, the self-test.
#![allow(unsafe_code, reason = "calls what C calls")]

mod caller;

use caller::{Caller, sized};
use remora_capi::*;
use remora_core::prelude::*;
use std::ffi::{CStr, c_void};

/// A flight in Rust beside one in C.
struct Both {
    c: Caller,
    mission: Valid<Mission>,
    planner: Box<Planner>,
    plan: FlightPlan,
    guidance: Guidance,
}

impl Both {
    fn new() -> Self {
        let c = Caller::flying();
        let mission = Mission::default().validated().unwrap();
        let scenario = Scenario { position: Vector3::new(8.0, 0.0, 0.0), ..Scenario::default() };
        let mut planner = Box::new(Planner::new());
        let options = Options::builder().mode(Mode::Feasible).build().unwrap();
        let plan = planner.plan(&mission, &scenario.validated().unwrap(), &options).unwrap();
        assert_eq!(plan.record().output, c.report.checksum);
        let plan = plan.flight_plan(0.0).unwrap();
        let guidance = Guidance::new(GuidanceSettings::DEFAULT.validated().unwrap());
        Self { c, mission, planner, plan, guidance }
    }

    /// What navigation says at a time, a little off: to both.
    fn estimate(&mut self, time: f64) -> Estimate {
        // SAFETY: a flight and a place of the caller's.
        let status =
            unsafe { remora_expected(self.c.flight.pointer(), time, &mut self.c.estimate) };
        assert_eq!(status, RemoraStatus::Ok);
        self.c.estimate.position[1] += 0.01;
        self.c.estimate.target_rate[0] += 1e-6;
        let reference = self.plan.at(&self.mission, time);
        let mut estimate = Estimate::as_planned(&self.mission, time, &reference);
        estimate.position.y += 0.01;
        estimate.target.rate.x += 1e-6;
        estimate
    }

    /// A step at a time, whose commands must be the same bits.
    fn step(&mut self, time: f64) -> Command {
        let estimate = self.estimate(time);
        assert_eq!(self.c.guides(None), RemoraStatus::Ok);
        let limits = Limits::of(&self.mission.servicer);
        let command = self.guidance.step(&self.mission, &self.plan, &estimate, &limits);
        let found = &self.c.command;
        assert_eq!(found.mode, command.mode as u32, "{time}");
        assert_eq!(found.wanted, command.wanted.map_or(0, |reason| reason as u32), "{time}");
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found.force), bits(command.force.as_slice()), "{time}");
        assert_eq!(bits(&found.bus_torque), bits(command.control.bus_torque.as_slice()));
        assert_eq!(bits(&found.joint_torque), bits(command.control.joint_torque.as_slice()));
        assert_eq!(bits(&found.joint_angle), bits(command.joint_angle.as_slice()));
        assert_eq!(bits(&found.joint_rate), bits(command.joint_rate.as_slice()));
        assert_eq!(bits(&found.share), bits(&command.share));
        command
    }
}

// Verifies REM-DOR-002.
#[test]
fn guidance_and_replanning_from_c_have_the_bits_of_rust() {
    let mut both = Both::new();
    for i in 0..20 {
        assert_eq!(both.step(295.0 + 0.5 * f64::from(i)).mode, FlightMode::Track);
    }
    // The flight can be copied, and the copy planned again.
    let estimate = both.estimate(305.0);
    let before = both.c.everything();
    assert_eq!(both.c.replans(20.0), RemoraStatus::Ok);
    let flight = both.c.workspace.length..both.c.workspace.length + both.c.flight.length;
    assert!(both.c.everything()[flight.clone()] == before[flight], "the flight was written");

    let replan = both.guidance.replan(&both.mission, &both.plan, &estimate, 20.0).unwrap();
    let guess = InitialGuess::Nominal { plan: &replan.nominal, elapsed: replan.elapsed };
    let options = Options::builder().mode(Mode::Feasible).initial_guess(guess).build().unwrap();
    let scenario = replan.scenario.validated().unwrap();
    let plan = both.planner.plan(&both.mission, &scenario, &options).unwrap();
    let report = both.c.report;
    assert_eq!((report.checksum, report.begins), (plan.record().output, replan.begins));
    assert_eq!((report.is_verified, report.start), (1, GuessRecord::Nominal.code()));
    assert_eq!(report.nodes as usize, plan.states().len());
    both.plan = plan.flight_plan(replan.begins).unwrap();
    assert_eq!(both.c.hands_over(report.begins), RemoraStatus::Ok);
    for i in 0..20 {
        both.step(325.0 + 0.5 * f64::from(i));
    }

    // SAFETY: a flight of the caller's, here and below.
    unsafe { assert_eq!(remora_ask(both.c.flight.pointer(), REMORA_REPLAN), RemoraStatus::Ok) };
    both.guidance.ask_for_plan();
    assert_eq!(both.step(336.0).mode, FlightMode::ReplanWanted);
    unsafe { assert_eq!(remora_ask(both.c.flight.pointer(), REMORA_ABORT), RemoraStatus::Ok) };
    both.guidance.abort();
    assert_eq!(both.step(336.5).mode, FlightMode::Abort);
}

#[test]
fn an_estimate_that_is_no_number_is_guidances_to_judge() {
    let mut caller = Caller::flying();
    caller.estimate.velocity[0] = f64::NAN;
    assert_eq!(caller.guides(None), RemoraStatus::Ok);
    assert_eq!(caller.command.mode, FlightMode::Degraded as u32);
    assert!(caller.command.force.iter().all(|x| x.is_finite()));
}

#[test]
fn limits_of_the_callers_are_kept() {
    let mut caller = Caller::flying();
    caller.estimate.position[1] += 0.05;
    let mut limits: RemoraLimits = sized(|s, size| s.size = size);
    (limits.force, limits.bus_torque, limits.joint_torque) = ([0.02; 3], [1e-4; 3], [1e-4; 3]);
    assert_eq!(caller.guides(Some(&limits)), RemoraStatus::Ok);
    let command = &caller.command;
    assert!(command.force.iter().all(|x| x.abs() <= 0.02) && command.share[0] < 1.0);
    assert!(command.bus_torque.iter().all(|x| x.abs() <= 1e-4));
}

#[test]
fn nodes_records_and_findings_are_the_plans() {
    let mut caller = Caller::planned();
    let mission = Mission::default().validated().unwrap();
    let scenario = Scenario { position: Vector3::new(8.0, 0.0, 0.0), ..Scenario::default() };
    let scenario = scenario.validated().unwrap();
    let options = Options::builder().mode(Mode::Feasible).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap();
    for k in 0..60 {
        assert_eq!(caller.copies_node(k as u32), RemoraStatus::Ok);
        let (node, state) = (&caller.node, &plan.states()[k]);
        assert_eq!((node.time, node.index), (mission.grid(&scenario).time(k), k as u32));
        assert_eq!(Vector3::from(node.position), plan.positions()[k]);
        assert_eq!(Vector3::from(node.velocity), plan.velocities()[k]);
        assert_eq!(Vector4::from(node.attitude), state.attitude);
        assert_eq!(Vector3::from(node.rate), state.rate);
        assert_eq!(Vector3::from(node.joint_angle), state.joint_angle);
        assert_eq!(Vector3::from(node.joint_rate), state.joint_rate);
        let control = plan.controls().get(k).copied().unwrap_or(Control::ZERO);
        let force = plan.forces().get(k).copied().unwrap_or_default();
        assert_eq!(Vector3::from(node.force), force);
        assert_eq!(Vector3::from(node.bus_torque), control.bus_torque);
        assert_eq!(Vector3::from(node.joint_torque), control.joint_torque);
    }
    let mut record: RemoraRecord = sized(|s, size| s.size = size);
    let mut found: RemoraVerification = sized(|s, size| s.size = size);
    // SAFETY: a workspace and places of the caller's.
    unsafe {
        assert_eq!(remora_record(caller.workspace.pointer(), &mut record), RemoraStatus::Ok);
        assert_eq!(remora_verify(caller.workspace.pointer(), &mut found), RemoraStatus::Ok);
    }
    let expected = plan.record();
    assert_eq!(
        (record.input, record.settings, record.output),
        (expected.input, expected.settings, expected.output)
    );
    assert_eq!(record.reorientation.qp_iterations, expected.reorientation.qp_iterations);
    // SAFETY: a text that ends.
    let version = unsafe { CStr::from_ptr(record.version.as_ptr()) };
    assert_eq!(version.to_str(), Ok(expected.version));
    let report = plan.report();
    assert_eq!((found.is_verified, found.dynamics2), (1, report.residuals.dynamics2));
    assert_eq!(found.ee_position, report.residuals.ee_position);
    assert_eq!(found.arm.distance, report.clearances.arm.distance);
    assert!(found.arm.distance.is_finite() && found.own.body > 0);
}

/// A model serves where it is sound; a damaged one costs its guess, never the plan.
#[test]
fn a_model_is_asked_and_a_damaged_one_is_not() {
    let mut file = include_bytes!("../../../fixtures/models/rk4.model").to_vec();
    let start = |file: &[u8]| {
        let mut caller = Caller::open();
        caller.options.model = file.as_ptr();
        caller.options.model_bytes = file.len();
        assert_eq!(caller.plans(), RemoraStatus::Ok);
        assert_eq!(caller.report.is_verified, 1);
        caller.report.start
    };
    assert_eq!(start(&file), GuessRecord::Learned.code());
    file[1000] ^= 1;
    assert_eq!(start(&file), GuessRecord::Refused.code());
    assert_eq!(start(&file[..20]), GuessRecord::Refused.code());
}

/// Seconds that pass with each look at the clock.
unsafe extern "C" fn ticks(context: *mut c_void) -> f64 {
    // SAFETY: the context is a number, which nobody else looks at now.
    unsafe {
        *context.cast::<f64>() += 1.0;
        *context.cast::<f64>()
    }
}

#[test]
fn the_callers_clock_ends_planning_and_times_it() {
    let mut now = 0.0f64;
    let mut caller = Caller::open();
    caller.options.clock = Some(ticks);
    caller.options.context = (&raw mut now).cast();
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    assert_eq!(caller.report.is_verified, 1);
    assert!(caller.report.seconds > 1.0 && caller.report.seconds.is_finite());
    caller.options.deadline = 20.0;
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    assert_eq!((caller.report.is_verified, caller.report.status), (0, Status::Deadline.code()));
}

#[test]
fn a_scenario_that_no_plan_ends_well_is_refused_by_name() {
    let mut caller = Caller::planned();
    caller.scenario.position = [0.5, 0.0, 0.0];
    assert_eq!(caller.plans(), RemoraStatus::Refused);
    // SAFETY: a text that ends.
    let name = unsafe { CStr::from_ptr(caller.report.refusal_name.as_ptr()) };
    assert_eq!((name.to_str(), caller.report.refusal), (Ok("keep_out"), 9));
    assert_eq!(caller.copies_node(0), RemoraStatus::NoPlan);
}

#[test]
fn a_mission_of_the_callers_is_planned() {
    let mut caller = Caller::new();
    caller.mission.bus_mass = 350.0;
    assert_eq!(caller.opens(REMORA_ABI), RemoraStatus::Ok);
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    let mut mission = Mission::default();
    mission.servicer.bus_mass = 350.0;
    let scenario = Scenario { position: Vector3::new(8.0, 0.0, 0.0), ..Scenario::default() };
    let options = Options::builder().mode(Mode::Feasible).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let (mission, scenario) = (mission.validated().unwrap(), scenario.validated().unwrap());
    let plan = planner.plan(&mission, &scenario, &options).unwrap();
    assert_eq!(caller.report.checksum, plan.record().output);
}

#[test]
fn the_self_test_knows_its_checksums() {
    let mut caller = Caller::planned();
    for (integrator, expected) in
        [(REMORA_RK4, REMORA_SELF_TEST_RK4), (REMORA_EULER, REMORA_SELF_TEST_EULER)]
    {
        let mut sum = 0;
        // SAFETY: a workspace and a place of the caller's.
        let status = unsafe { remora_self_test(caller.workspace.pointer(), integrator, &mut sum) };
        assert_eq!((status, sum), (RemoraStatus::Ok, expected));
    }
    assert_eq!(caller.copies_node(0), RemoraStatus::NoPlan);
}
