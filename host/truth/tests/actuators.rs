//! Actuators: what acts against what was asked.

use crate::common;

use nalgebra::Vector3;
use remora_truth::{
    Axes, Command, Dispersion, Environment, JointCommand, JointDrive, JointMode, JointStuck, Setup,
    ThrusterLost, World,
};

/// The default servicer, at rest in free space, arm straight: a force along z turns nothing.
fn at_rest() -> Setup<3> {
    let mut setup = common::setup(common::servicer());
    setup.environment = Environment::FREE;
    setup.start.velocity = Vector3::zeros();
    setup.start.rate = Vector3::zeros();
    setup.start.attitude = [0.0, 0.0, 0.0, 1.0];
    setup.start.joint_angle = [0.0; 3];
    setup.start.joint_rate = [0.0; 3];
    setup
}

fn push(force: f64) -> Command<3> {
    Command { force: Vector3::z() * force, axes: Axes::Bus, ..Command::default() }
}

#[test]
fn impulses_are_multiples_of_the_bit_and_right_in_the_mean() {
    let mut dispersion = common::quiet();
    dispersion.errors.thrusters.impulse_bit_n_s = 0.02;
    let mut world = World::new(&at_rest(), &dispersion).unwrap();
    let (mut before, mut fired) = (0.0, vec![]);
    for second in 1..=100 {
        for tenth in 1..=10 {
            let time = f64::from(second - 1) + 0.1 * f64::from(tenth);
            world.advance(time, &push(0.013)).unwrap();
        }
        let momentum = world.linear_momentum().z;
        fired.push((momentum - before) / 0.02);
        before = momentum;
    }
    assert!(fired.iter().all(|bits| (bits - bits.round()).abs() < 1e-9), "{fired:?}");
    assert!(fired.iter().any(|bits| *bits < 0.5) && fired.iter().any(|bits| *bits > 0.5));
    assert!((before - 1.3).abs() <= 0.0101, "{before}");
    // Below half a bit nothing fires at first, but what is owed adds up.
    let mut world = World::new(&at_rest(), &dispersion).unwrap();
    world.advance(2.0, &push(0.004)).unwrap();
    assert_eq!(world.linear_momentum().z, 0.0);
    world.advance(10.0, &push(0.004)).unwrap();
    assert!((world.linear_momentum().z - 0.04).abs() < 1e-12);
}

#[test]
fn without_a_bit_the_force_is_what_was_asked_within_limits() {
    let mut world = World::new(&at_rest(), &common::quiet()).unwrap();
    world.advance(10.0, &push(0.013)).unwrap();
    assert!((world.linear_momentum().z - 0.13).abs() < 1e-14);
    world.advance(20.0, &push(100.0)).unwrap();
    assert!((world.linear_momentum().z - 25.13).abs() < 1e-12);
}

#[test]
fn noise_of_thrusters_is_drawn_for_each_period() {
    let mut dispersion = common::quiet();
    dispersion.errors.thrusters.noise = 0.05;
    let mut world = World::new(&at_rest(), &dispersion).unwrap();
    let (mut before, mut squares) = (0.0, 0.0);
    for second in 1..=400 {
        world.advance(f64::from(second), &push(0.1)).unwrap();
        let momentum = world.linear_momentum().z;
        squares += (momentum - before - 0.1) * (momentum - before - 0.1) / 0.01;
        before = momentum;
    }
    let deviation = f64::sqrt(squares / 400.0);
    assert!((deviation - 0.05).abs() < 0.006, "{deviation}");
}

#[test]
fn a_lost_axis_gives_no_force_from_then_on() {
    let mut dispersion = common::quiet();
    dispersion.errors.faults.thruster_lost = Some(ThrusterLost { axis: 2, time_s: 3.45 });
    let mut world = World::new(&at_rest(), &dispersion).unwrap();
    world.advance(10.0, &push(0.1)).unwrap();
    assert!((world.linear_momentum().z - 0.345).abs() < 1e-14);
    let other = Command { force: Vector3::x() * 0.1, ..push(0.0) };
    world.advance(11.0, &other).unwrap();
    assert!((world.linear_momentum().x - 0.1).abs() < 1e-6);
}

#[test]
fn wheels_give_way_at_their_limits() {
    let mut setup = at_rest();
    setup.vehicle.limits.wheel_momentum = [1.0, 0.02, 1.0];
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let ask = |torque: f64| Command { bus_torque: Vector3::y() * torque, ..Command::default() };
    for step in 1..=100 {
        world.advance(0.1 * f64::from(step), &ask(1.0)).unwrap();
    }
    // Torque is limited to 5e-3, momentum to 0.02: full after 4 s, and the bus has its opposite.
    let wheels = world.view().wheel_momentum;
    assert!((wheels.y + 0.02).abs() < 1e-12, "{wheels:?}");
    assert!((world.angular_momentum().y - 0.02).abs() < 1e-12);
    // A full wheel still gives the other way.
    world.advance(11.0, &ask(-1.0)).unwrap();
    assert!((world.view().wheel_momentum.y + 0.015).abs() < 1e-12);
}

#[test]
fn wheels_momentum_turns_with_the_bus_if_asked() {
    let mut setup = at_rest();
    setup.start.rate = Vector3::new(0.0, 0.0, 0.01);
    setup.start.wheel_momentum = Vector3::new(0.5, 0.0, 0.0);
    let momenta = |turns: bool| {
        let mut setup = setup.clone();
        setup.environment.wheel_momentum = turns;
        let mut world = World::new(&setup, &common::quiet()).unwrap();
        let before = world.angular_momentum();
        let torque = Vector3::new(1e-3, -2e-3, 1e-3);
        world.advance(100.0, &Command { bus_torque: torque, ..Command::default() }).unwrap();
        (before, world.angular_momentum())
    };
    // As wheels the torque is an internal one, as in the planner it is external.
    let (before, after) = momenta(true);
    assert!((after - before).norm() < 1e-13);
    let (before, after) = momenta(false);
    assert!((after - before).norm() > 0.1);
}

/// One joint with its motor in servo mode about a still reference.
fn servo(limit: f64) -> Vec<f64> {
    let mut vehicle = common::skewed::<1>();
    vehicle.limits.joint_torque = [limit];
    vehicle.servo[0].bandwidth = 0.5;
    let mut setup = common::setup(vehicle);
    setup.environment = Environment::FREE;
    setup.start.rate = Vector3::zeros();
    setup.start.joint_rate = [0.0];
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let angle = [setup.start.joint_angle[0] - 0.01];
    let joints = JointCommand::Servo { angle, rate: [0.0], torque: [0.0] };
    (1..=200)
        .map(|step| {
            let command = Command { joints, ..Command::default() };
            world.advance(0.1 * f64::from(step), &command).unwrap();
            world.view().joint_angle[0] - angle[0]
        })
        .collect()
}

#[test]
fn a_servo_settles_as_its_bandwidth_says() {
    for (step, error) in servo(f64::INFINITY).into_iter().enumerate() {
        let phase = 0.5 * 0.1 * (step + 1) as f64;
        let wanted = 0.01 * (1.0 + phase) * (-phase).exp();
        assert!((error - wanted).abs() < 1e-5, "{error} {wanted}");
    }
    // With little torque it is later, and never beyond its limit.
    assert!(servo(1e-3)[40] > servo(f64::INFINITY)[40] + 1e-4);
}

#[test]
fn a_servo_follows_a_moving_reference() {
    let mut setup = common::setup(common::servicer());
    setup.start.joint_rate = [0.0; 3];
    let mut world = World::new(&setup, &common::quiet()).unwrap();
    let (start, rate) = (setup.start.joint_angle, [1e-3, -2e-3, 5e-4]);
    let mut command = Command::default();
    for step in 0..1000 {
        let time = 0.1 * f64::from(step);
        let angle = core::array::from_fn(|j| start[j] + rate[j] * time);
        command.joints = JointCommand::Servo { angle, rate, torque: [0.0; 3] };
        world.advance(0.1 * f64::from(step + 1), &command).unwrap();
    }
    let view = world.view();
    for j in 0..3 {
        assert!((view.joint_angle[j] - start[j] - rate[j] * 100.0).abs() < 2e-4);
        assert!((view.joint_rate[j] - rate[j]).abs() < 1e-5);
    }
}

#[test]
fn friction_is_coulombs_but_smooth() {
    let drive = JointDrive {
        mode: JointMode::Torque(1e-3),
        limit: 5e-3,
        gain: 1.1,
        bias: 1e-4,
        friction: 2e-4,
        friction_rate: 1e-4,
    };
    let given = 1.2e-3;
    assert!((drive.torque(0.0, 0.0, 0.0) - given).abs() < 1e-18);
    assert!((drive.torque(0.0, 0.0, 1e-3) - (given - 2e-4)).abs() < 2e-6);
    assert!((drive.torque(0.0, 0.0, -1e-3) - (given + 2e-4)).abs() < 2e-6);
}

#[test]
fn a_stuck_joint_stops_at_once_and_the_others_feel_it() {
    let mut setup = common::setup(common::skewed::<3>());
    setup.environment = Environment::FREE;
    let mut dispersion: Dispersion = common::quiet();
    dispersion.errors.faults.joint_stuck = Some(JointStuck { joint: 1, time_s: 5.0 });
    let mut world = World::new(&setup, &dispersion).unwrap();
    let momentum = world.angular_momentum();
    world.advance(4.999, &Command::default()).unwrap();
    let moving = world.view();
    assert!(moving.joint_rate[1].abs() > 1e-4);
    world.advance(5.0, &Command::default()).unwrap();
    let stuck = world.view();
    assert_eq!(stuck.joint_rate[1], 0.0);
    assert!((stuck.joint_rate[0] - moving.joint_rate[0]).abs() > 1e-5);
    let energy = world.kinetic_energy();
    for step in 1..=100 {
        world.advance(5.0 + f64::from(step), &Command::default()).unwrap();
    }
    assert_eq!(world.view().joint_angle[1], stuck.joint_angle[1]);
    assert!((world.angular_momentum() - momentum).norm() < 1e-13 * momentum.norm());
    assert!((world.kinetic_energy() - energy).abs() < 1e-12 * energy);
}
