//! Cost of the dynamics: one evaluation and its exact derivatives over the oracle's varied states. The phases of
//! whole plans are measured by `cargo xtask profile`.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{
    Acceleration, Control, Integrator, Multibody, State, Stepping,
};
use remora_core::advanced::model::Mission;
use remora_core::advanced::stages::NODES;
use remora_core::advanced::stages::size::{NU, NX};
use serde::Deserialize;
use std::hint::black_box;

const INTERVALS: usize = NODES - 1;

#[derive(Deserialize)]
struct Oracle {
    states: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    q: [f64; 4],
    alpha: [f64; 3],
    w: [f64; 3],
    alpha_dot: [f64; 3],
    f: [f64; 3],
    tau_0: [f64; 3],
    tau_m: [f64; 3],
}

type Input = (State<3>, Control<3>, Vector3<f64>);

fn inputs() -> Vec<Input> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/oracle/dynamics_public.json");
    let oracle: Oracle = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let input = |case: &Case| {
        let state = State {
            attitude: Vector4::from(case.q),
            joint_angle: SVector::from(case.alpha),
            rate: Vector3::from(case.w),
            joint_rate: SVector::from(case.alpha_dot),
        };
        let control = Control {
            bus_torque: Vector3::from(case.tau_0),
            joint_torque: SVector::from(case.tau_m),
        };
        (state, control, Vector3::from(case.f))
    };
    oracle.states.iter().map(input).collect()
}

/// Times `f` on one input after the other.
fn each(c: &mut Criterion, name: &str, inputs: &[Input], f: impl Fn(&Input)) {
    let mut next = inputs.iter().cycle();
    c.bench_function(name, |b| b.iter(|| f(black_box(next.next().unwrap()))));
}

/// Times `f` on all intervals of a plan.
fn plan(c: &mut Criterion, name: &str, inputs: &[Input], f: impl Fn(&Input)) {
    let plan = &inputs[..INTERVALS];
    c.bench_function(name, |b| b.iter(|| plan.iter().for_each(|input| f(black_box(input)))));
}

fn dynamics(c: &mut Criterion) {
    let mission = Mission::default();
    let body = Multibody::new(&mission);
    let inputs = inputs();
    each(c, "forward dynamics", &inputs, |(x, u, f)| {
        black_box(body.acceleration(x, u, f));
    });
    each(c, "acceleration jacobian", &inputs, |(x, u, f)| {
        black_box(body.acceleration_jacobian::<NX, NU>(x, u, f));
    });
    each(c, "acceleration and force jacobian", &inputs, |(x, u, f)| {
        black_box(body.acceleration_jacobian::<NX, NU>(x, u, f));
        black_box(body.force_jacobian(x, u, f));
    });
    each(c, "curvature", &inputs, |(x, _, f)| {
        let acceleration = Acceleration { bus: x.rate * 1e-2, joint: x.joint_rate * 1e-2 };
        let mu = SVector::repeat(0.1);
        black_box(body.torque_curvature::<NX, NU>(x, f, &acceleration, &mu));
    });
    let dt = 1200.0 / INTERVALS as f64;
    for (name, integrator) in [
        ("linearise 59 intervals euler", Integrator::Euler),
        ("linearise 59 intervals rk4:4", Integrator::Rk4 { substeps: 4 }),
    ] {
        plan(c, name, &inputs, |(x, u, f)| {
            black_box(body.step_jacobian::<NX, NU>(&Stepping::new(integrator, dt), x, u, f));
        });
    }
}

criterion_group!(benches, dynamics);
criterion_main!(benches);
