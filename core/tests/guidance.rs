//! Guidance in a world of the planner's own equations, integrated here.

use proptest::prelude::*;
use remora_core::advanced::dynamics::{Control, Multibody, State, SystemState};
use remora_core::advanced::guidance::{
    Command, Estimate, FlightMode, FlightPlan, Guidance, GuidanceSettings, Limits, NotFlyable,
    Reason, Triggers,
};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, TargetState};
use remora_core::advanced::stages::clearances_at;
use remora_core::nalgebra::{Vector3, Vector4};
use remora_core::prelude::{InitialGuess, Integrator, Options, Planner, Scenario, Valid, Validate};

/// A scenario like the drawn ones.
fn scenario() -> Scenario {
    Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(6e-4, -4e-4, 5e-4),
        position: Vector3::new(0.1, -0.3, 5.0),
        velocity: Vector3::new(1e-3, 0.0, -2e-3),
        ..Scenario::default()
    }
}

/// A world: servicer and target, in the planner's equations.
struct World<'m> {
    mission: &'m Mission<3>,
    body: Multibody<'m, 3>,
    time: f64,
    servicer: SystemState<3>,
    target: TargetState,
}

impl<'m> World<'m> {
    /// The start of a scenario, target and bus turned from it (and the target's rate off).
    fn beginning(
        mission: &'m Mission<3>,
        scenario: &Scenario,
        [turn, rate]: [Vector3<f64>; 2],
        bus: Vector3<f64>,
    ) -> Self {
        let body = Multibody::new(mission);
        let mut internal = State::at_start(mission, scenario);
        internal.attitude = quaternion::product(&quaternion::exp(&bus), &internal.attitude);
        let (center, drift) = body.center_of_mass(&internal);
        let attitude = scenario.target_attitude;
        let target = TargetState {
            attitude: quaternion::product(&quaternion::exp(&turn), &attitude),
            rate: quaternion::rotation_matrix(&attitude) * scenario.target_rate + rate,
        };
        let servicer = SystemState {
            position: scenario.position - center,
            velocity: scenario.velocity - drift,
            internal,
        };
        Self { mission, body, time: 0.0, servicer, target }
    }

    /// RK4 over `h` with the command held.
    fn advance(&mut self, h: f64, force: &Vector3<f64>, control: &Control<3>) {
        let rates = |x: &SystemState<3>| self.body.system_rates(x, control, force);
        let moved = |x: &SystemState<3>, at: &SystemState<3>, h: f64| {
            let r = rates(at);
            let q = quaternion::derivative(&at.internal.attitude, &at.internal.rate);
            SystemState {
                position: x.position + at.velocity * h,
                velocity: x.velocity + r.bus * h,
                internal: State {
                    attitude: x.internal.attitude + q * h,
                    joint_angle: x.internal.joint_angle + at.internal.joint_rate * h,
                    rate: x.internal.rate + r.rate * h,
                    joint_rate: x.internal.joint_rate + r.joint_rate * h,
                },
            }
        };
        let x = self.servicer;
        let b = moved(&x, &x, 0.5 * h);
        let c = moved(&x, &b, 0.5 * h);
        let d = moved(&x, &c, h);
        let y =
            moved(&moved(&moved(&moved(&x, &x, h / 6.0), &b, h / 3.0), &c, h / 3.0), &d, h / 6.0);
        self.servicer = y;
        self.servicer.internal.attitude = quaternion::normalized(&y.internal.attitude);
        let mut nodes = [TargetState::ZERO; 2];
        let to_body = quaternion::rotation_matrix(&self.target.attitude).transpose();
        self.mission.target.tumble(
            Integrator::RK4,
            self.mission.mean_motion(),
            &self.target.attitude,
            &(to_body * self.target.rate),
            h,
            &mut nodes,
        );
        self.target = nodes[1];
        self.time += h;
    }

    fn estimate(&self) -> Estimate<3> {
        Estimate {
            time: self.time,
            position: self.servicer.position,
            velocity: self.servicer.velocity,
            state: self.servicer.internal,
            target: self.target,
            wrist: None,
        }
    }

    /// End effector from the port [m].
    fn miss(&self) -> f64 {
        self.tip_from_port().norm()
    }

    /// End effector from the port, RTN [m].
    fn tip_from_port(&self) -> Vector3<f64> {
        let (center, _) = self.body.center_of_mass(&self.servicer.internal);
        let tip = self.body.end_effector(&self.servicer.internal).position;
        let target = quaternion::rotation_matrix(&self.target.attitude);
        let port = target * self.mission.target.port_position_m;
        self.servicer.position + center + tip - port
    }
}

/// How a plan is flown.
struct Flight {
    /// Time between steps [s].
    period: f64,
    /// Turn and rate of the target from what the plan was made for [rad, rad/s].
    target: [Vector3<f64>; 2],
    /// Turn of the bus from where the plan begins [rad].
    bus: Vector3<f64>,
}

const AS_PLANNED: Flight = Flight { period: 0.1, target: [ZERO; 2], bus: ZERO };
const ZERO: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);

/// Flies the scenario's plan to its end; returns the miss [m] and what was commanded.
fn fly(flight: &Flight) -> (f64, Vec<Command<3>>) {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let options = Options::builder().integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap();
    let plan = plan.flight_plan(0.0).unwrap();
    let mut world = World::beginning(&mission, &scenario, flight.target, flight.bus);
    let limits = Limits::of(&mission.servicer);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    let mut guidance = Guidance::new(settings);
    let mut commands = Vec::new();
    let steps = (plan.duration() / flight.period).round() as usize;
    for _ in 0..steps {
        let command = guidance.step(&mission, &plan, &world.estimate(), &limits);
        world.advance(flight.period, &command.force, &command.control);
        commands.push(command);
    }
    (world.miss(), commands)
}

// Verifies REM-GUI-001.
#[test]
fn a_plan_flown_as_it_is_ends_at_the_port() {
    for period in [0.05, 0.1, 1.0, 5.0] {
        let (miss, commands) = fly(&Flight { period, ..AS_PLANNED });
        let worst = commands.iter().map(|c| c.error.joint).fold(0.0, f64::max);
        // Feed-forward is exact: nothing is left to feedback, ahead of the plan's time neither.
        let settled = &commands[(60.0 / period) as usize..];
        let off = settled.iter().map(|c| c.error.position).fold(0.0, f64::max);
        println!("{period}: {miss:e} {worst:e} {off:e}");
        assert!(miss < 3e-4, "{period} s: {miss}");
        assert!(off < 1e-4 * (1.0 + period), "{period} s: {off}");
        assert!(commands.iter().all(|c| c.mode == FlightMode::Track));
    }
}

// Verifies REM-GUI-001.
#[test]
fn the_plan_turns_with_the_target() {
    let target = [Vector3::new(0.05, -0.04, 0.02), Vector3::new(2e-5, 1e-5, -2e-5)];
    let (miss, commands) = fly(&Flight { target, ..AS_PLANNED });
    let share = commands.iter().map(|c| c.share[1]).fold(1.0, f64::min);
    println!("{miss:e} {share} {:?}", commands.last().unwrap().error);
    assert!(miss < 1e-3, "{miss}");
}

#[test]
fn a_disturbed_start_is_made_good() {
    let bus = Vector3::new(0.01, 0.02, -0.01);
    let (miss, commands) = fly(&Flight { bus, ..AS_PLANNED });
    let share = commands.iter().map(|c| c.share[1]).fold(1.0, f64::min);
    println!("{miss:e} {share} {:?}", commands[0].error);
    assert!(miss < 3e-4, "{miss}");
}

// Verifies REM-GUI-004.
#[test]
fn a_new_plan_takes_over_without_a_jump() {
    let mission = Mission::<3>::default().validated().unwrap();
    let (first, options) = (scenario().validated().unwrap(), Options::builder());
    let options = options.integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let mut plan = planner.plan(&mission, &first, &options).unwrap().flight_plan(0.0).unwrap();
    let turn = [Vector3::new(0.05, -0.04, 0.02), Vector3::new(2e-5, 1e-5, -2e-5)];
    let mut world = World::beginning(&mission, &first, turn, Vector3::zeros());
    let limits = Limits::of(&mission.servicer);
    let triggers = Triggers { age: 300.0, last: 90.0, ..Triggers::NEVER };
    let settings = GuidanceSettings { triggers, ..GuidanceSettings::DEFAULT };
    let mut guidance = Guidance::new(settings.validated().unwrap());
    let (mut next, mut before, mut swaps, mut predicted) = (None, None, 0, Vec::new());
    for _ in 0..12_000 {
        if next.as_ref().is_some_and(|next: &FlightPlan| world.time >= next.begins - 1e-9) {
            plan = next.take().unwrap();
            swaps += 1;
        }
        let command = guidance.step(&mission, &plan, &world.estimate(), &limits);
        let jump = before.map_or(0.0, |before: Command<3>| {
            (command.control.joint_torque - before.control.joint_torque).amax()
                + (command.control.bus_torque - before.control.bus_torque).amax()
        });
        // At a node of the plan in force the torques themselves change.
        if (world.time - plan.begins).abs() < 1e-9 && swaps > 0 {
            assert!(jump < 1e-4, "{} s: {jump}", world.time);
        }
        if command.mode == FlightMode::ReplanWanted && next.is_none() {
            assert_eq!(command.wanted, Some(Reason::Time));
            predicted.push(command.error.target);
            let replan = guidance.replan(&mission, &plan, &world.estimate(), 5.0).unwrap();
            let scenario = replan.scenario.validated().unwrap();
            let guess = InitialGuess::Nominal { plan: &replan.nominal, elapsed: replan.elapsed };
            let options = Options::builder()
                .integrator(Integrator::RK4)
                .initial_guess(guess)
                .build()
                .unwrap();
            let plan = planner.plan(&mission, &scenario, &options).unwrap();
            next = Some(plan.flight_plan(replan.begins).unwrap());
        }
        world.advance(0.1, &command.force, &command.control);
        before = Some(command);
    }
    println!("{swaps} swaps, target off by {predicted:?}, miss {:e}", world.miss());
    assert_eq!(swaps, 3);
    assert!(world.miss() < 1e-3, "{}", world.miss());
    assert!(predicted[1] < 0.2 * predicted[0]);
}

// Verifies REM-GUI-005.
#[test]
fn every_node_says_how_the_approach_may_end_there() {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let options = Options::builder().integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap().flight_plan(0.0).unwrap();
    let limits = Limits::of(&mission.servicer);
    for k in 0..60 {
        let safety = plan.safety(&mission, &limits, k).unwrap();
        println!("{k} {safety:?}");
        assert!(safety.escape.clears && safety.escape.time <= 60.0, "{k}: {safety:?}");
        // A plan drifts too near sooner or later; what moves away from the port on the last way may not.
        let recedes = safety.time > plan.duration() - GuidanceSettings::DEFAULT.closing.out[0];
        assert!(safety.drift.distance <= 5.0, "{k}: {safety:?}");
        assert!(
            (recedes || !safety.drift.clears) && (k != 59 || safety.drift.clears),
            "{k}: {safety:?}"
        );
    }
    assert!(plan.safety(&mission, &limits, 60).is_none());
}

/// A plan to fly, and the scenario it is for.
fn planned() -> (Valid<Mission<3>>, Valid<Scenario>, FlightPlan<3>) {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let options = Options::builder().integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap().flight_plan(0.0).unwrap();
    (mission, scenario, plan)
}

/// What navigation says of a servicer that is where the plan has it.
fn on_the_plan(mission: &Mission<3>, plan: &FlightPlan<3>, time: f64) -> Estimate<3> {
    let there = plan.at(mission, time);
    let (center, drift) = Multibody::new(mission).center_of_mass(&there.state);
    Estimate {
        time,
        position: there.position - center,
        velocity: there.velocity - drift,
        state: there.state,
        target: there.target,
        wrist: None,
    }
}

/// A first step somewhere in an interval follows the plan from the node before in one step of the dynamics.
#[test]
fn a_first_step_amid_an_interval_asks_for_what_later_ones_do() {
    let (mission, _, plan) = planned();
    let limits = Limits::of(&mission.servicer);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    for node in [0.0, 12.0, 30.0, 40.0] {
        let begins = node * plan.duration() / 59.0;
        let mut early = Guidance::new(settings);
        for second in 0..20 {
            let estimate = on_the_plan(&mission, &plan, begins + f64::from(second));
            let expected = early.step(&mission, &plan, &estimate, &limits);
            let found = Guidance::new(settings).step(&mission, &plan, &estimate, &limits);
            let force = (found.force - expected.force).amax();
            let bus = (found.control.bus_torque - expected.control.bus_torque).amax();
            let joint = (found.control.joint_torque - expected.control.joint_torque).amax();
            println!("{node} {second}: {force:e} N, {bus:e}, {joint:e} N m");
            assert!(force < 1e-4 && bus < 1e-6 && joint < 1e-6, "{node} {second}");
        }
    }
}

// Verifies REM-GUI-003.
#[test]
fn what_is_not_a_number_leaves_the_plan_as_it_stands() {
    let (mission, scenario, plan) = planned();
    let limits = Limits::of(&mission.servicer);
    let world = World::beginning(&mission, &scenario, [ZERO; 2], ZERO);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    let broken: [fn(&mut Estimate<3>); 8] = [
        |e| e.time = f64::NAN,
        |e| e.position.x = f64::NAN,
        |e| e.velocity.z = f64::INFINITY,
        |e| e.state.attitude.w = f64::NAN,
        |e| e.state.joint_rate[2] = f64::NAN,
        |e| e.target.attitude.x = f64::NEG_INFINITY,
        |e| e.target.rate.y = f64::NAN,
        |e| e.wrist = Some(Vector3::new(0.0, f64::NAN, 0.0)),
    ];
    for (i, spoil) in broken.into_iter().enumerate() {
        let mut guidance = Guidance::new(settings);
        let sound = guidance.step(&mission, &plan, &world.estimate(), &limits);
        let mut estimate = world.estimate();
        spoil(&mut estimate);
        let command = guidance.step(&mission, &plan, &estimate, &limits);
        assert_eq!(command.mode, FlightMode::Degraded, "{i}");
        assert_eq!(command.control, plan.nominal.reorientation.controls[0], "{i}");
        assert!((command.force - plan.translation.force[0]).amax() < 1e-12, "{i}");
        assert!(guidance.replan(&mission, &plan, &estimate, 1.0).is_none());
        // The next sound estimate finds all as it was.
        assert_eq!(guidance.step(&mission, &plan, &world.estimate(), &limits), sound, "{i}");
    }
}

// Verifies REM-GUI-005.
#[test]
fn an_abort_leaves_the_target_within_the_limits() {
    let (mission, scenario, plan) = planned();
    let limits = Limits::of(&mission.servicer);
    let mut world = World::beginning(&mission, &scenario, [ZERO; 2], ZERO);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    let mut guidance = Guidance::new(settings);
    let place = |world: &World<'_>| {
        let (center, _) = world.body.center_of_mass(&world.servicer.internal);
        world.servicer.position + center
    };
    let mut nearest = f64::INFINITY;
    for step in 0..1600 {
        if step == 1000 {
            guidance.abort();
        }
        let command = guidance.step(&mission, &plan, &world.estimate(), &limits);
        assert_eq!(command.mode == FlightMode::Abort, step >= 1000);
        assert!(is_within(&command, &limits));
        world.advance(1.0, &command.force, &command.control);
        if step >= 1000 {
            let at = place(&world);
            let found =
                clearances_at(&mission, world.time, &world.target, &at, &world.servicer.internal);
            nearest = found.least().min(nearest);
        }
    }
    let rate = world.servicer.internal.rate.norm();
    println!("{} m, {nearest} m, {rate} rad/s", place(&world).norm());
    assert!(nearest > 0.0 && place(&world).norm() > 5.0 && rate < 1e-3);
    assert!(world.servicer.internal.joint_rate.amax() < 1e-4);
}

// Verifies REM-GUI-005.
#[test]
fn a_servicer_far_from_its_plan_leaves_the_target() {
    let (mission, scenario, plan) = planned();
    let limits = Limits::of(&mission.servicer);
    let world = World::beginning(&mission, &scenario, [ZERO; 2], ZERO);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    let off: [fn(&mut Estimate<3>); 3] = [
        |e| e.position.y += 0.31,
        |e| e.state.attitude = quaternion::exp(&Vector3::new(0.0, 2.0, 0.0)),
        |e| e.state.joint_angle[1] += 0.26,
    ];
    for lose in off {
        let mut guidance = Guidance::new(settings);
        let mut estimate = world.estimate();
        lose(&mut estimate);
        let command = guidance.step(&mission, &plan, &estimate, &limits);
        assert_eq!(command.mode, FlightMode::Track);
        // From the next step on, and there is no way back.
        for _ in 0..2 {
            let command = guidance.step(&mission, &plan, &world.estimate(), &limits);
            assert_eq!(command.mode, FlightMode::Abort);
            assert!(is_within(&command, &limits));
        }
        // What is planned leads to the target: nothing is done where nothing is known.
        estimate.time = f64::NAN;
        let command = guidance.step(&mission, &plan, &estimate, &limits);
        assert_eq!((command.mode, command.force), (FlightMode::Abort, ZERO));
        assert_eq!(command.control, Control::ZERO);
    }
}

fn is_within(command: &Command<3>, limits: &Limits<3>) -> bool {
    let within = |x: f64, most: f64| x.abs() <= most;
    command.force.iter().zip(&limits.force).all(|(x, most)| within(*x, *most))
        && command.control.bus_torque.iter().zip(&limits.bus_torque).all(|(x, m)| within(*x, *m))
        && command
            .control
            .joint_torque
            .iter()
            .zip(&limits.joint_torque)
            .all(|(x, m)| within(*x, *m))
}

#[test]
fn the_wrist_camera_closes_what_navigation_does_not_know() {
    let (mission, scenario, plan) = planned();
    let limits = Limits::of(&mission.servicer);
    let wrong = Vector3::new(0.004, -0.006, 0.003);
    let fly = |has_camera: bool| {
        let mut world = World::beginning(&mission, &scenario, [ZERO; 2], ZERO);
        let settings = GuidanceSettings::DEFAULT.validated().unwrap();
        let mut guidance = Guidance::new(settings);
        for _ in 0..1200 {
            let mut estimate = world.estimate();
            estimate.position += wrong;
            if has_camera && world.time > 1050.0 {
                estimate.wrist = Some(world.tip_from_port());
            }
            let command = guidance.step(&mission, &plan, &estimate, &limits);
            world.advance(1.0, &command.force, &command.control);
        }
        world.miss()
    };
    let (without, with) = (fly(false), fly(true));
    println!("{without} {with}");
    assert!((without - wrong.norm()).abs() < 1e-4 && with < 3e-4);
}

#[test]
fn a_plan_of_eulers_step_is_not_flown() {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let options = Options::builder().integrator(Integrator::Euler).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap();
    assert_eq!(plan.flight_plan(0.0).unwrap_err(), NotFlyable::Euler);
}

#[test]
fn a_plan_is_written_where_it_lies() {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let integrator = Integrator::Rk4 { substeps: 4 };
    let options = Options::builder().integrator(integrator).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap();
    let flown = plan.flight_plan(0.0).unwrap();
    let (path, motion) = (&flown.translation, &flown.nominal.reorientation);
    let mut written = FlightPlan::BLANK.beginning_at(7.0);
    let of_euler = written.write(&mission, &scenario, Integrator::Euler, path, motion);
    assert_eq!(of_euler, Err(NotFlyable::Euler));
    assert_eq!(written, FlightPlan::BLANK.beginning_at(7.0));
    written.write(&mission, &scenario, integrator, path, motion).unwrap();
    assert_eq!(written, flown);
    assert_eq!(FlightPlan::new(&mission, &scenario, integrator, path, motion), Ok(flown));
}

proptest! {
    /// Whatever the estimate, what is commanded is finite and within the limits.
    // Verifies REM-GUI-002.
    #[test]
    fn commands_keep_the_limits(
        numbers in prop::array::uniform32(-1.0..1.0_f64),
        scale in -6.0..6.0_f64,
        times in prop::array::uniform5(-2000.0..4000.0_f64),
        share in 0.0..1.0_f64,
        aborts in any::<bool>(),
    ) {
        static PLANNED: std::sync::OnceLock<(Valid<Mission<3>>, Valid<Scenario>, FlightPlan<3>)> =
            std::sync::OnceLock::new();
        let (mission, scenario, plan) = PLANNED.get_or_init(planned);
        let world = World::beginning(mission, scenario, [ZERO; 2], ZERO);
        let mut limits = Limits::of(&mission.servicer);
        limits.bus_torque *= share;
        let settings = GuidanceSettings::DEFAULT.validated().unwrap();
        let mut guidance = Guidance::new(settings);
        for (i, time) in times.into_iter().enumerate() {
            let mut numbers = numbers.iter().cycle().skip(5 * i).map(|x| x * 10_f64.powf(scale));
            let mut vector = || Vector3::from_fn(|_, _| numbers.next().unwrap_or(0.0));
            let mut estimate = world.estimate();
            estimate.time = time;
            estimate.position += vector();
            estimate.velocity += vector();
            estimate.state.rate += vector();
            estimate.state.joint_angle += vector();
            estimate.state.joint_rate += vector();
            estimate.target.rate += vector();
            let q = quaternion::exp(&vector());
            estimate.state.attitude = quaternion::product(&q, &estimate.state.attitude);
            let command = guidance.step(mission, plan, &estimate, &limits);
            prop_assert!(command.force.iter().all(|x| x.is_finite()) && command.control.is_finite());
            prop_assert!(is_within(&command, &limits), "{command:?}");
            if aborts && i == 2 {
                guidance.abort();
            }
        }
    }
}
