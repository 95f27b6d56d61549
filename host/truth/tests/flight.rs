//! Whole flights: contact, sensors in time, the same bits.

use crate::common;

use nalgebra::Vector3;
use remora_truth::{
    Axes, Command, Dispersion, Environment, Errors, JointCommand, Sampling, Setup,
    TargetRateChange, View, World,
};

/// The tip a metre above the port of a target at rest, falling on it at 10 mm/s.
fn falling(offset: f64) -> Setup<3> {
    let mut setup = common::setup(common::servicer());
    setup.environment = Environment::FREE;
    setup.target.attitude = [0.0, 0.0, 0.0, 1.0];
    setup.target.rate = Vector3::zeros();
    let start = &mut setup.start;
    // Bus above the target, its z axis downwards: half a turn about x. The straight arm's tip is
    // 0.116 + 0.75 + 0.75 + 0.30 m below the bus, the port 0.2 m above the target's centre.
    start.attitude = [1.0, 0.0, 0.0, 0.0];
    start.position = Vector3::new(offset, 0.0, 1.0 + 1.916 + 0.2);
    start.velocity = Vector3::new(0.0, 0.0, -1e-2);
    (start.rate, start.joint_rate) = (Vector3::zeros(), [0.0; 3]);
    start.joint_angle = [0.0; 3];
    setup
}

#[test]
fn a_flight_ends_where_the_tip_reaches_the_port() {
    let mut world = World::new(&falling(0.05), &common::quiet()).unwrap();
    assert_eq!(world.advance(99.5, &Command::default()).unwrap(), None);
    let contact = world.advance(120.0, &Command::default()).unwrap().unwrap();
    assert!((contact.time - 100.0).abs() < 1e-9, "{contact:?}");
    assert!((contact.miss - 0.05).abs() < 1e-12);
    assert_eq!(world.time(), contact.time);
    let view = world.view();
    assert!(view.height().abs() < 1e-14 && (view.offset() - 0.05).abs() < 1e-12);
    assert!(view.angle() < 1e-12 && (view.relative_speed() - 0.01).abs() < 1e-14);
    // Going on is possible: there are no contact forces, and the plane is behind.
    assert_eq!(world.advance(120.0, &Command::default()).unwrap(), None);
    // Beside the port the plane is no end.
    let mut world = World::new(&falling(0.3), &common::quiet()).unwrap();
    assert_eq!(world.advance(120.0, &Command::default()).unwrap(), None);
}

fn command(time: f64) -> Command<3> {
    let sign = if (time / 20.0) as i32 % 2 == 0 { 1.0 } else { -1.0 };
    Command {
        force: Vector3::new(0.05, -0.02, 0.03) * sign,
        axes: Axes::Rtn,
        bus_torque: Vector3::new(1e-3, -5e-4, 2e-3) * sign,
        joints: JointCommand::Torque([1e-4 * sign, -5e-5, 2e-5 * sign]),
    }
}

/// FNV-1a over the bits of what is true and what is measured, each second for a minute.
fn checksum(dispersion: &Dispersion) -> u64 {
    let mut setup = common::setup(common::servicer());
    setup.environment.oblateness = Some(remora_truth::Oblateness::EARTH);
    let mut world = World::new(&setup, dispersion).unwrap();
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut eat = |value: f64| {
        for byte in value.to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    };
    for second in 1..=60 {
        for tenth in 1..=10 {
            let time = f64::from(second - 1) + 0.1 * f64::from(tenth);
            world.advance(time, &command(time)).unwrap();
        }
        let (view, told) = (world.view(), world.measure());
        view.center.iter().chain(view.tip.iter()).chain(view.port.iter()).for_each(|&x| eat(x));
        view.attitude.into_iter().chain(view.joint_rate).for_each(&mut eat);
        told.position.unwrap().value.iter().for_each(|&x| eat(x));
        told.velocity.unwrap().value.iter().for_each(|&x| eat(x));
        told.attitude.unwrap().value.into_iter().for_each(&mut eat);
        told.target_attitude.unwrap().value.into_iter().for_each(&mut eat);
        told.joint_angle.unwrap().value.into_iter().for_each(&mut eat);
    }
    hash
}

#[test]
fn same_seed_same_bits() {
    let dispersion = Dispersion { errors: Errors::typical(), seed: 7, run: 3 };
    let sum = checksum(&dispersion);
    println!("{sum:#x}");
    assert_eq!(sum, checksum(&dispersion));
    assert_ne!(sum, checksum(&Dispersion { run: 4, ..dispersion.clone() }));
    assert_ne!(sum, checksum(&Dispersion { seed: 8, ..dispersion }));
    // The same on every machine; changes with every change of the model.
    assert_eq!(sum, GOLDEN);
}

const GOLDEN: u64 = 0x9e10_56cd_cc41_cf98;

#[test]
fn a_clone_goes_on_like_the_original() {
    let dispersion = Dispersion { errors: Errors::typical(), seed: 7, run: 3 };
    let mut world = World::new(&common::setup(common::servicer()), &dispersion).unwrap();
    world.advance(3.3, &command(0.0)).unwrap();
    let mut other = world.clone();
    world.advance(9.0, &command(0.0)).unwrap();
    other.advance(9.0, &command(0.0)).unwrap();
    assert_eq!(world.measure(), other.measure());
    assert_eq!(world.view().tip, other.view().tip);
}

#[test]
fn how_a_flight_is_cut_into_calls_changes_rounding_only() {
    let setup = common::setup(common::servicer());
    let end = |steps: u32| {
        let mut world = World::new(&setup, &common::quiet()).unwrap();
        for step in 1..=steps {
            let time = 1200.0 * f64::from(step) / f64::from(steps);
            let joints = JointCommand::Torque([0.0; 3]);
            world.advance(time, &Command { joints, ..command(0.0) }).unwrap();
        }
        world.view().tip
    };
    let apart = (end(60) - end(12_000)).norm();
    println!("tips of 60 and of 12000 calls {apart:e} m apart");
    assert!(apart < 1e-7, "{apart:e}");
}

#[test]
fn samples_come_at_their_rate_and_after_their_delay() {
    let mut dispersion = common::exact();
    dispersion.errors.sensors.position = Sampling { rate_hz: 2.0, delay_s: 0.7 };
    let mut world = World::new(&common::setup(common::servicer()), &dispersion).unwrap();
    assert!(world.measure().position.is_none());
    assert_eq!(world.measure().attitude.unwrap().time, 0.0);
    let mut truths: Vec<View<3>> = vec![world.view()];
    for step in 1..=100 {
        let now = 0.1 * f64::from(step);
        world.advance(now, &command(now)).unwrap();
        truths.push(world.view());
        let told = world.measure().position.map(|sample| sample.time);
        let newest = ((now - 0.7 + 1e-9) * 2.0).floor() / 2.0;
        let wanted = (newest >= 0.0).then_some(newest);
        assert!(told.zip(wanted).is_none_or(|(a, b)| (a - b).abs() < 1e-9), "{told:?} {now}");
        assert_eq!(told.is_some(), wanted.is_some());
    }
    let sample = world.measure().position.unwrap();
    let truth = &truths[(sample.time * 10.0).round() as usize];
    assert!((sample.value - truth.bus_position).norm() < 1e-15);
}

#[test]
fn without_errors_sensors_tell_the_truth() {
    let mut world = World::new(&falling(0.05), &common::exact()).unwrap();
    world.advance(50.0, &Command::default()).unwrap();
    let (told, view) = (world.measure(), world.view());
    assert_eq!(told.position.unwrap().value, view.bus_position);
    assert_eq!(told.velocity.unwrap().value, view.bus_velocity);
    assert_eq!(told.attitude.unwrap().value, view.attitude);
    assert_eq!(told.joint_angle.unwrap().value, view.joint_angle);
    assert_eq!(told.joint_rate.unwrap().value, view.joint_rate);
    assert_eq!(told.target_rate.unwrap().value, view.target.rate);
    // Half a metre ahead, 50 mm beside: bus x is inertial x, z is down.
    let seen = told.wrist_camera.unwrap().value;
    assert!((seen - Vector3::new(-0.05, 0.0, 0.5)).norm() < 1e-12, "{seen:?}");
    let early = World::new(&falling(0.05), &common::exact()).unwrap();
    assert!(early.measure().wrist_camera.is_none(), "the port is beyond 1 m");
}

#[test]
fn the_targets_rate_changes_when_it_is_told_to() {
    let mut dispersion = common::quiet();
    let change = TargetRateChange { factor: 1.2, time_s: 33.3 };
    dispersion.errors.faults.target_rate = Some(change);
    let mut setup = common::setup(common::servicer());
    setup.environment.target_gravity_gradient = false;
    let mut world = World::new(&setup, &dispersion).unwrap();
    let energy = |world: &World<3>| {
        let rate = world.view().target.rate;
        rate.dot(&setup.target.inertia.component_mul(&rate))
    };
    let before = energy(&world);
    world.advance(33.2, &Command::default()).unwrap();
    assert!((energy(&world) / before - 1.0).abs() < 1e-12);
    world.advance(33.4, &Command::default()).unwrap();
    assert!((energy(&world) / before - 1.44).abs() < 1e-12);
    world.advance(300.0, &Command::default()).unwrap();
    assert!((energy(&world) / before - 1.44).abs() < 1e-12);
}
