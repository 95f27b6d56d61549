//! Guidance in a world of the planner's own equations, integrated here.

use remora_core::advanced::dynamics::{Control, Multibody, State, SystemState};
use remora_core::advanced::guidance::{
    Command, Estimate, Guidance, GuidanceSettings, Limits, Mode,
};
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{Mission, TargetState};
use remora_core::nalgebra::{Vector3, Vector4};
use remora_core::prelude::{
    Integrator, InitialGuess, Options, Planner, Scenario, Valid, Validate,
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

impl World<'_> {
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
    let first = State::at_start(&mission, &scenario);
    let plan = plan.flight_plan().unwrap();
    let body = Multibody::new(&mission);
    let mut internal = first;
    internal.attitude = quaternion::product(&quaternion::exp(&flight.bus), &first.attitude);
    let (center, drift) = body.center_of_mass(&internal);
    let [turn, rate] = flight.target;
    let mut target = plan.target[0];
    target.attitude = quaternion::product(&quaternion::exp(&turn), &target.attitude);
    target.rate += rate;
    let mut world = World {
        mission: &mission,
        body,
        time: 0.0,
        servicer: SystemState {
            position: scenario.position - center,
            velocity: scenario.velocity - drift,
            internal,
        },
        target,
    };
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
        assert!(commands.iter().all(|c| c.mode == Mode::Track));
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
