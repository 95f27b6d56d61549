//! What C gets is what Rust gets: guidance and replanning step by step, models, clocks, the self-test.
#![allow(unsafe_code, reason = "calls what C calls")]

mod caller;

use caller::{Caller, sized};
use remora_capi::*;
use remora_core::advanced::math::quaternion;
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
        self.c.expects(time);
        self.c.estimate.bus_position_rtn_m[1] += 0.01;
        self.c.estimate.target_rate_rtn_rad_s[0] += 1e-6;
        let mut estimate = self.guidance.expected(&self.mission, &self.plan, time);
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
        assert_eq!(bits(&found.bus_force_rtn_n), bits(command.force.as_slice()), "{time}");
        let control = &command.control;
        assert_eq!(bits(&found.bus_torque_body_n_m), bits(control.bus_torque.as_slice()));
        assert_eq!(bits(&found.joint_torque_n_m), bits(control.joint_torque.as_slice()));
        assert_eq!(bits(&found.joint_angle_rad), bits(command.joint_angle.as_slice()));
        assert_eq!(bits(&found.joint_rate_rad_s), bits(command.joint_rate.as_slice()));
        assert_eq!(bits(&[found.force_share, found.torque_share]), bits(&command.share));
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
    assert_eq!((report.checksum, report.begins_s), (plan.record().output, replan.begins));
    assert_eq!((report.is_verified, report.start), (1, GuessRecord::Nominal.code()));
    assert_eq!(report.nodes as usize, plan.states().len());
    let next = plan.flight_plan(replan.begins).unwrap();
    // Guidance goes on along the plan in force meanwhile.
    for i in 0..4 {
        both.step(305.0 + 5.0 * f64::from(i));
    }
    both.plan = next;
    assert_eq!(both.c.hands_over(report.begins_s), RemoraStatus::Ok);
    for i in 0..20 {
        both.step(325.0 + 0.5 * f64::from(i));
    }

    let (replan, abort) = (RemoraRequest::Replan as u32, RemoraRequest::Abort as u32);
    // SAFETY: a flight of the caller's, here and below.
    unsafe { assert_eq!(remora_ask(both.c.flight.pointer(), replan), RemoraStatus::Ok) };
    both.guidance.ask_for_plan();
    assert_eq!(both.step(336.0).mode, FlightMode::ReplanWanted);
    unsafe { assert_eq!(remora_ask(both.c.flight.pointer(), abort), RemoraStatus::Ok) };
    both.guidance.abort();
    assert_eq!(both.step(336.5).mode, FlightMode::Abort);
}

/// Flies the estimates of remora_expected at a fixed step to the end, as docs/examples/c/plan.c begins to.
fn flies_what_is_expected(mut caller: Caller, period_s: f64) {
    assert_eq!((caller.opens(REMORA_ABI), caller.plans()), (RemoraStatus::Ok, RemoraStatus::Ok));
    assert_eq!(caller.report.is_verified, 1);
    assert_eq!((caller.flies(), caller.hands_over(50.0)), (RemoraStatus::Ok, RemoraStatus::Ok));
    let ends = 50.0 + caller.report.duration_s;
    let steps = (caller.report.duration_s / period_s).ceil() as u32;
    for step in 0..=steps {
        let time = ends - f64::from(steps - step) * period_s;
        caller.expects(time);
        assert_eq!(caller.guides(None), RemoraStatus::Ok, "{time}");
        let RemoraCommand { mode, com_error_m, bus_error_rad, joint_error_rad, .. } =
            caller.command;
        let is_exact = com_error_m < 1e-9 && bus_error_rad < 1e-9 && joint_error_rad < 1e-9;
        assert!(is_exact, "{time} {com_error_m} {bus_error_rad} {joint_error_rad}");
        let right = if step < steps { RemoraFlightMode::Track } else { RemoraFlightMode::Done };
        assert_eq!(mode, right as u32, "{time}");
    }
    let mission = caller.mission;
    let e = &caller.estimate;
    // The end effector is at the port: from the links, about the axes of the bus.
    let turned = |q: [f64; 4], v: [f64; 3]| {
        quaternion::rotation_matrix(&Vector4::from(q)) * Vector3::from(v)
    };
    let mut tip = Vector3::from(mission.arm_base_bus_m);
    let mut axes = Vector4::new(0.0, 0.0, 0.0, 1.0);
    for (link, angle) in mission.links.iter().zip(e.joint_angle_rad) {
        let turn = quaternion::exp(&(Vector3::from(link.axis_link) * angle));
        axes = quaternion::product(&axes, &turn);
        tip += quaternion::rotation_matrix(&axes) * Vector3::from(link.tip_from_joint_link_m);
    }
    let tip = Vector3::from(e.bus_position_rtn_m) + turned(e.bus_attitude_body_to_rtn, tip.into());
    let port = turned(e.target_attitude_body_to_rtn, mission.port_position_target_m);
    assert!((tip - port).norm() < mission.tolerance_ee_position_m, "{}", (tip - port).norm());
}

#[test]
fn what_is_expected_is_flown_to_a_capture() {
    let vehicles: [fn(&mut Caller); 4] = [
        |_| {},
        |c| c.mission.bus_mass_kg = 650.0,
        |c| c.mission.links.iter_mut().for_each(|link| link.radius_m = 0.04),
        |c| (c.mission.duration_s, c.mission.nodes) = (1100.0, 50),
    ];
    for (i, change) in vehicles.into_iter().enumerate() {
        let mut caller = Caller::new();
        change(&mut caller);
        caller.scenario.target_rate_body_rad_s = [2.0e-4 * i as f64, 0.0, 1.0e-3];
        flies_what_is_expected(caller, [1.0, 2.0, 0.5, 5.0][i]);
    }
}

#[test]
fn an_estimate_that_is_no_number_is_guidances_to_judge() {
    let mut caller = Caller::flying();
    caller.estimate.bus_velocity_rtn_m_s[0] = f64::NAN;
    assert_eq!(caller.guides(None), RemoraStatus::Ok);
    assert_eq!(caller.command.mode, RemoraFlightMode::Degraded as u32);
    assert!(caller.command.bus_force_rtn_n.iter().all(|x| x.is_finite()));
}

#[test]
fn limits_of_the_callers_are_kept() {
    let mut caller = Caller::flying();
    caller.estimate.bus_position_rtn_m[1] += 0.05;
    let mut limits: RemoraLimits = sized(|s, size| s.size = size);
    limits.max_bus_force_rtn_n = [0.02; 3];
    (limits.max_bus_torque_body_n_m, limits.max_joint_torque_n_m) = ([1e-4; 3], [1e-4; 3]);
    assert_eq!(caller.guides(Some(&limits)), RemoraStatus::Ok);
    let command = &caller.command;
    let is_within = command.bus_force_rtn_n.iter().all(|x| x.abs() <= 0.02);
    assert!(is_within && command.force_share < 1.0);
    assert!(command.bus_torque_body_n_m.iter().all(|x| x.abs() <= 1e-4));
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
        assert_eq!((node.time_s, node.index), (mission.grid(&scenario).time(k), k as u32));
        assert_eq!(Vector3::from(node.com_position_rtn_m), plan.positions()[k]);
        assert_eq!(Vector3::from(node.com_velocity_rtn_m_s), plan.velocities()[k]);
        assert_eq!(Vector4::from(node.bus_attitude_body_to_rtn), state.attitude);
        assert_eq!(Vector3::from(node.bus_rate_rtn_rad_s), state.rate);
        assert_eq!(Vector3::from(node.joint_angle_rad), state.joint_angle);
        assert_eq!(Vector3::from(node.joint_rate_rad_s), state.joint_rate);
        let control = plan.controls().get(k).copied().unwrap_or(Control::ZERO);
        let force = plan.forces().get(k).copied().unwrap_or_default();
        assert_eq!(Vector3::from(node.bus_force_rtn_n), force);
        assert_eq!(Vector3::from(node.bus_torque_body_n_m), control.bus_torque);
        assert_eq!(Vector3::from(node.joint_torque_n_m), control.joint_torque);
    }
    let mut record: RemoraRecord = sized(|s, size| s.size = size);
    let mut found: RemoraVerification = sized(|s, size| s.size = size);
    // SAFETY: all pointers are to memory of this test.
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
    assert_eq!(found.ee_position_m, report.residuals.ee_position);
    assert_eq!(found.arm.distance_m, report.clearances.arm.distance);
    assert!(found.arm.distance_m.is_finite() && found.own.body > 0);
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
    assert_eq!(start(&file), RemoraStart::Model as u32);
    file[1000] ^= 1;
    assert_eq!(start(&file), RemoraStart::Refused as u32);
    assert_eq!(start(&file[..20]), RemoraStart::Refused as u32);
}

/// Seconds that pass with each look at the clock.
unsafe extern "C" fn ticks(context: *mut c_void) -> f64 {
    // SAFETY: the context is a number, which nothing else reads now.
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
    assert!(caller.report.planning_time_s > 1.0 && caller.report.planning_time_s.is_finite());
    caller.options.deadline_s = 20.0;
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    assert_eq!((caller.report.is_verified, caller.report.status), (0, Status::Deadline.code()));
}

#[test]
fn a_scenario_that_no_plan_ends_well_is_refused_by_name() {
    let mut caller = Caller::planned();
    caller.scenario.com_position_rtn_m = [0.5, 0.0, 0.0];
    assert_eq!(caller.plans(), RemoraStatus::Refused);
    // SAFETY: a text that ends.
    let name = unsafe { CStr::from_ptr(caller.report.refusal_name.as_ptr()) };
    assert_eq!(
        (name.to_str(), caller.report.refusal),
        (Ok("keep_out"), RemoraRefusal::KeepOut as u32)
    );
    assert_eq!(caller.copies_node(0), RemoraStatus::NoPlan);
}

#[test]
fn a_mission_of_the_callers_is_planned() {
    let mut caller = Caller::new();
    caller.mission.bus_mass_kg = 350.0;
    assert_eq!(caller.opens(REMORA_ABI), RemoraStatus::Ok);
    assert_eq!(caller.plans(), RemoraStatus::Ok);
    let mut mission = Mission::default();
    mission.servicer.bus_mass_kg = 350.0;
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
    for (integrator, expected) in [
        (RemoraIntegrator::Rk4, REMORA_SELF_TEST_RK4),
        (RemoraIntegrator::Euler, REMORA_SELF_TEST_EULER),
    ] {
        let mut sum = 0;
        // SAFETY: both pointers are to memory of this test.
        let status =
            unsafe { remora_self_test(caller.workspace.pointer(), integrator as u32, &mut sum) };
        assert_eq!((status, sum), (RemoraStatus::Ok, expected));
    }
    assert_eq!(caller.copies_node(0), RemoraStatus::NoPlan);
}
