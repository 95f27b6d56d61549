//! Cost of the dynamics: one evaluation and its exact derivatives over the oracle's varied states.
//! Cost of an iteration of Stage 2 besides solving its program. It is measured on a plan of the
//! first public scenario, after a few iterations.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{SVector, Vector3, Vector4};
use remora_core::advanced::dynamics::{
    Acceleration, Control, Integrator, Multibody, State, Stepping,
};
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::{
    InitialGuess, Options, PlanSettings, Platform, Workspace, plan as make_plan,
};
use remora_core::advanced::qp::Qp;
use remora_core::advanced::scp::{Problem, Residuals, Settings};
use remora_core::advanced::stages::size::{NG, NU, NX};
use remora_core::advanced::stages::{
    Formulation, LINKS, Mode, NODES, Reorientation, ReorientationTrajectory,
};
use remora_host::backend::ClarabelQp;
use remora_host::formats::ScenarioSet;
use serde::Deserialize;
use std::hint::black_box;
use std::path::Path;

const INTERVALS: usize = NODES - 1;

/// Iterations of Stage 2 before its phases are timed: steps are still of the usual size.
const ITERATIONS: usize = 4;

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

/// The first public scenario.
fn scenario() -> Scenario {
    let path =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/scenarios/public.scenarios.json");
    ScenarioSet::read(Path::new(path)).unwrap().scenarios[0].scenario().resized()
}

/// A whole Stage 2 workspace after a few iterations on it.
fn workspace(integrator: Integrator) -> Box<Workspace> {
    let mut options = PlanSettings::new(Mode::Optimal, integrator);
    options.reorientation = Settings::with_max_iterations(&options.reorientation, ITERATIONS);
    let mut workspace = Box::new(Workspace::new());
    make_plan(
        &Mission::default(),
        &scenario(),
        &Options::from_parts(options, InitialGuess::Heuristic, Platform::BARE),
        &mut ClarabelQp::default(),
        &mut workspace,
    );
    workspace
}

/// Measures an iteration's work besides solving its program, over all 59 intervals.
fn phases(c: &mut Criterion) {
    for (name, integrator) in
        [("euler", Integrator::Euler), ("rk4:4", Integrator::Rk4 { substeps: 4 })]
    {
        let (mission, scenario) = (Mission::default(), scenario());
        let workspace = workspace(integrator);
        let path = &workspace.translation.trajectory;
        let motion = &workspace.reorientation.trajectory;
        let step = &workspace.scratch.step;
        let mut problem = Reorientation::<Sequential, NODES, LINKS, NX, NU>::new(
            &Formulation::new(&mission, &scenario, integrator),
            path,
            &workspace.target,
            Mode::Optimal,
            &Sequential,
        );
        let mut qp = Box::new(Qp::<NODES, NX, NU, NG>::ZERO);
        c.bench_function(&format!("linearise {name}"), |b| {
            b.iter(|| problem.linearise(motion, None, &mut qp));
        });
        c.bench_function(&format!("linearise with curvature {name}"), |b| {
            b.iter(|| problem.linearise(motion, Some(step), &mut qp));
        });
        convexify(c, name, &qp);
        let mut to = ReorientationTrajectory::ZERO;
        c.bench_function(&format!("retract {name}"), |b| {
            b.iter(|| problem.retract(motion, &workspace.scratch.qp, step, &mut to));
        });
        let mut residuals = Residuals::ZERO;
        c.bench_function(&format!("residuals {name}"), |b| {
            b.iter(|| problem.residuals(&to, &mut residuals));
        });
    }
}

/// The sweep that makes the program convex, on one that already is: the same arithmetic.
fn convexify(c: &mut Criterion, name: &str, qp: &Qp<NODES, NX, NU, NG>) {
    let mut copy = Box::new(qp.clone());
    let convex = SVector::repeat(1.0);
    c.bench_function(&format!("convexify {name}, with a copy"), |b| {
        b.iter(|| {
            (*copy).clone_from(qp);
            black_box(copy.convexify(&convex, |k, _| k == 0));
        });
    });
    c.bench_function(&format!("copy {name}"), |b| {
        b.iter(|| (*copy).clone_from(black_box(qp)));
    });
}

criterion_group!(benches, dynamics, phases);
criterion_main!(benches);
