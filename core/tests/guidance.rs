//! Guidance in a world of the planner's own equations, integrated here.

use remora_core::advanced::dynamics::{Control, Multibody, State, SystemState};
use remora_core::advanced::guidance::{
    Command, Estimate, Guidance, GuidanceSettings, Limits, FlightMode, Reason, Triggers,
};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, TargetState};
use remora_core::nalgebra::{Vector3, Vector4};
use remora_core::prelude::{
    InitialGuess, Integrator, Options, Planner, Scenario, Validate,
};

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
        let y = moved(&moved(&moved(&moved(&x, &x, h / 6.0), &b, h / 3.0), &c, h / 3.0), &d, h / 6.0);
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
        let (center, _) = self.body.center_of_mass(&self.servicer.internal);
        let tip = self.body.end_effector(&self.servicer.internal).position;
        let target = quaternion::rotation_matrix(&self.target.attitude);
        let port = target * self.mission.target.port_position;
        (self.servicer.position + center + tip - port).norm()
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
    let plan = plan.flight_plan().unwrap();
    let mut world = World::beginning(&mission, &scenario, flight.target, flight.bus);
    let limits = Limits::of(&mission.servicer);
    let settings = GuidanceSettings::DEFAULT.validated().unwrap();
    let mut guidance = Guidance::new(&mission, settings, &plan, 0.0);
    let mut commands = Vec::new();
    let steps = (plan.duration() / flight.period).round() as usize;
    for _ in 0..steps {
        let command = guidance.step(&world.estimate(), &limits);
        world.advance(flight.period, &command.force, &command.control);
        commands.push(command);
    }
    (world.miss(), commands)
}

#[test]
fn a_plan_flown_as_it_is_ends_at_the_port() {
    for period in [0.05, 0.1, 1.0, 5.0] {
        let (miss, commands) = fly(&Flight { period, ..AS_PLANNED });
        let worst = commands.iter().map(|c| c.error.joint).fold(0.0, f64::max);
        println!("{period}: {miss:e} {worst:e}");
        assert!(miss < 3e-4, "{period} s: {miss}");
        assert!(commands.iter().all(|c| c.mode == FlightMode::Track));
    }
}

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

#[test]
fn a_new_plan_takes_over_without_a_jump() {
    let mission = Mission::<3>::default().validated().unwrap();
    let (first, options) = (scenario().validated().unwrap(), Options::builder());
    let options = options.integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &first, &options).unwrap().flight_plan().unwrap();
    let turn = [Vector3::new(0.05, -0.04, 0.02), Vector3::new(2e-5, 1e-5, -2e-5)];
    let mut world = World::beginning(&mission, &first, turn, Vector3::zeros());
    let limits = Limits::of(&mission.servicer);
    let triggers = Triggers { age: 300.0, last: 90.0, ..Triggers::NEVER };
    let settings = GuidanceSettings { triggers, ..GuidanceSettings::DEFAULT };
    let mut guidance = Guidance::new(&mission, settings.validated().unwrap(), &plan, 0.0);
    let (mut next, mut before, mut swaps, mut predicted) = (None, None, 0, Vec::new());
    for _ in 0..12_000 {
        if next.as_ref().is_some_and(|(_, begins)| world.time >= *begins - 1e-9) {
            let (plan, begins) = next.take().unwrap();
            guidance.swap(&plan, begins);
            swaps += 1;
        }
        let command = guidance.step(&world.estimate(), &limits);
        let jump = before.map_or(0.0, |before: Command<3>| {
            (command.control.joint_torque - before.control.joint_torque).amax()
                + (command.control.bus_torque - before.control.bus_torque).amax()
        });
        let (_, begins) = guidance.plan();
        // At a node of the plan in force the torques themselves change.
        if (world.time - begins).abs() < 1e-9 && swaps > 0 {
            assert!(jump < 1e-4, "{} s: {jump}", world.time);
        }
        if command.mode == FlightMode::ReplanWanted && next.is_none() {
            assert_eq!(command.wanted, Some(Reason::Time));
            predicted.push(command.error.target);
            let replan = guidance.replan(&world.estimate(), 5.0).unwrap();
            let scenario = replan.scenario.validated().unwrap();
            let guess =
                InitialGuess::Nominal { plan: &replan.nominal, elapsed: replan.elapsed };
            let options =
                Options::builder().integrator(Integrator::RK4).initial_guess(guess).build().unwrap();
            let plan = planner.plan(&mission, &scenario, &options).unwrap();
            assert!(plan.is_verified());
            next = Some((plan.flight_plan().unwrap(), replan.begins));
        }
        world.advance(0.1, &command.force, &command.control);
        before = Some(command);
    }
    println!("{swaps} swaps, target off by {predicted:?}, miss {:e}", world.miss());
    assert_eq!(swaps, 3);
    assert!(world.miss() < 1e-3, "{}", world.miss());
    assert!(predicted[1] < 0.2 * predicted[0]);
}

#[test]
fn every_node_says_how_the_approach_may_end_there() {
    let mission = Mission::<3>::default().validated().unwrap();
    let scenario = scenario().validated().unwrap();
    let options = Options::builder().integrator(Integrator::RK4).build().unwrap();
    let mut planner = Box::new(Planner::new());
    let plan = planner.plan(&mission, &scenario, &options).unwrap().flight_plan().unwrap();
    let limits = Limits::of(&mission.servicer);
    for k in 0..60 {
        let safety = plan.safety(&mission, &limits, k).unwrap();
        println!("{k} {safety:?}");
        assert!(safety.escape.clears && safety.escape.time <= 60.0, "{k}: {safety:?}");
        // HCW's free drift from here to the place where it is nearest, along a finer path.
        assert!(safety.drift.distance <= 5.0 && safety.drift.clears == (k == 59), "{k}: {safety:?}");
    }
    assert!(plan.safety(&mission, &limits, 60).is_none());
}
