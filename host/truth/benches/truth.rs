//! Time of one evaluation of the dynamics and of a flight of 1200 s with torques held for 0.1 s.

#[path = "../tests/common/mod.rs"]
mod common;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::Vector3;
use remora_truth::{Axes, Command, Dispersion, Environment, Errors, JointCommand, World};
use std::hint::black_box;

fn slope(c: &mut Criterion) {
    let mut world = World::new(&common::setup(common::servicer()), &common::quiet()).unwrap();
    let command = Command::default();
    c.bench_function("slope, three joints", |b| {
        b.iter(|| black_box(world.slope(black_box(&command))));
    });
}

/// A flight at 10 Hz.
fn flight(world: &mut World<3>) {
    for step in 1..=12_000 {
        let sign = if step / 200 % 2 == 0 { 1.0 } else { -1.0 };
        let command = Command {
            force: Vector3::new(0.01, -0.02, 0.005) * sign,
            axes: Axes::Rtn,
            bus_torque: Vector3::new(1e-4, 2e-4, -1e-4) * sign,
            joints: JointCommand::Torque([1e-4 * sign, -5e-5 * sign, 1e-5 * sign]),
        };
        world.advance(f64::from(step) * 0.1, &command).unwrap();
    }
}

fn flights(c: &mut Criterion) {
    let mut group = c.benchmark_group("1200 s at 10 Hz");
    group.sample_size(10);
    let setup = common::setup(common::servicer());
    let typical = Dispersion { errors: Errors::typical(), seed: 1, run: 0 };
    let mut oblate = setup.clone();
    oblate.environment.oblateness = Some(remora_truth::Oblateness::EARTH);
    let mut free = setup.clone();
    free.environment = Environment::FREE;
    let cases = [
        ("no errors, no sensors", World::new(&setup, &common::quiet()).unwrap()),
        ("no gravity", World::new(&free, &common::quiet()).unwrap()),
        ("oblate Earth", World::new(&oblate, &common::quiet()).unwrap()),
        ("no errors, sensors at 10 Hz", World::new(&setup, &common::exact()).unwrap()),
        ("typical errors", World::new(&setup, &typical).unwrap()),
    ];
    for (name, world) in cases {
        group.bench_function(name, |b| {
            b.iter_batched_ref(|| world.clone(), flight, BatchSize::LargeInput);
        });
    }
}

criterion_group!(benches, slope, flights);
criterion_main!(benches);
