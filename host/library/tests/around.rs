//! Starts in all directions: where the target stands in the way, the path leads around it.

use nalgebra::{Vector3, Vector4};
use remora_core::advanced::model::Mission;
use remora_core::prelude::{InitialGuess, Options, Planner, Scenario, Validate};
use remora_host::formats::Verdict;
use remora_host::memory::on_heap;
use remora_host::method::Integrator;
use std::f64::consts::PI;

/// Directions on and near the six axes of RTN: each axis, and eleven beside it.
fn near_axes() -> Vec<Vector3<f64>> {
    let mut all = Vec::new();
    for axis in 0..6 {
        let unit = |i: usize, by: f64| Vector3::from_fn(|j, _| if i % 3 == j { by } else { 0.0 });
        let out = unit(axis, if axis < 3 { 1.0 } else { -1.0 });
        let aside = [unit(axis + 1, 1.0), unit(axis + 2, 1.0)];
        all.push(out);
        for [a, b] in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.7, 0.7]] {
            for by in [0.01, 0.1] {
                all.push((out + (aside[0] * a + aside[1] * b) * by).normalize());
            }
        }
        all.push((out + (aside[0] - aside[1]) * 0.05).normalize());
    }
    all
}

/// The `k`-th point of a sequence of low discrepancy in the unit cube (Roberts' `R_3`).
fn point(k: usize) -> [f64; 3] {
    let plastic: f64 = 1.220_744_084_605_76;
    [1, 2, 3].map(|power| (0.5 + k as f64 / plastic.powi(power)).fract())
}

/// 400 starts from 4.6 to 10 m, the first 72 on and near the axes.
fn starts() -> Vec<Vector3<f64>> {
    let mut starts = Vec::new();
    for (k, direction) in near_axes().into_iter().enumerate() {
        starts.push(direction * (4.6 + 5.4 * point(k)[2]));
    }
    for k in starts.len()..400 {
        let [a, b, c] = point(k);
        let (height, turn) = (2.0 * a - 1.0, 2.0 * PI * b);
        let ring = (1.0 - height * height).sqrt();
        let direction = Vector3::new(ring * turn.cos(), ring * turn.sin(), height);
        starts.push(direction * (4.6 + 5.4 * c));
    }
    starts
}

/// At rest, or tumbling with up to 1e-3 rad/s about each axis.
fn scenario(k: usize, position: Vector3<f64>, tumbles: bool) -> Scenario {
    let rate = point(k + 1000).map(|share| if tumbles { 1e-3 * (2.0 * share - 1.0) } else { 0.0 });
    let (target_attitude, target_rate) = (Vector4::w(), Vector3::from(rate));
    Scenario { target_attitude, target_rate, position, ..Scenario::default() }
}

/// Plans them all with the built-in mission; returns those that are not optimal.
fn not_optimal(integrator: Integrator, scenarios: &[Scenario]) -> Vec<String> {
    let mut planner = on_heap(Planner::new);
    let mission = Mission::<3>::default().validated().unwrap();
    let options = Options::builder().integrator(integrator).initial_guess(InitialGuess::Heuristic);
    let options = options.build().unwrap();
    let mut found = Vec::new();
    for (k, scenario) in scenarios.iter().enumerate() {
        let plan = planner.plan(&mission, &scenario.validated().unwrap(), &options).unwrap();
        if plan.report().verdict() != Verdict::Optimal {
            let [one, two] = [&plan.report().translation, &plan.report().reorientation];
            let (place, rate) = (scenario.position, scenario.target_rate);
            found.push(format!("{k} {integrator} {place:?} {rate:?}: {one:?} {two:?}"));
        }
    }
    found
}

/// Every `step`-th start, at rest and tumbling in turn.
fn sample(step: usize) -> Vec<Scenario> {
    let starts = starts().into_iter().enumerate().step_by(step).enumerate();
    starts.map(|(i, (k, position))| scenario(k, position, i % 2 == 1)).collect()
}

/// Starts whose Stage 1 takes the most iterations: its path bends over an edge of the target's box.
fn slow() -> Vec<Scenario> {
    let starts = starts();
    [(64, false), (80, false), (117, true), (185, true), (240, true), (333, true)]
        .map(|(k, tumbles)| scenario(k, starts[k], tumbles))
        .into()
}

#[test]
fn starts_opposite_the_port_are_planned() {
    let mut scenarios = Vec::new();
    for aside in [0.0, 0.05, 0.5] {
        for distance in [4.6, 5.0, 7.3, 10.0] {
            scenarios.push(scenario(0, Vector3::new(aside, 0.0, -distance), false));
        }
    }
    for integrator in [Integrator::RK4, Integrator::Euler] {
        assert_eq!(not_optimal(integrator, &scenarios), [""; 0]);
    }
}

/// The bus cannot follow the line of sight of Stage 1's first path: the second turns it slowly.
#[test]
fn a_start_far_beside_the_port_is_planned() {
    let scenarios = [scenario(0, Vector3::new(50.0, 0.0, 0.0), false)];
    for integrator in [Integrator::RK4, Integrator::Euler] {
        assert_eq!(not_optimal(integrator, &scenarios), [""; 0]);
    }
}

#[test]
fn starts_in_all_directions_are_planned() {
    let near = starts().into_iter().take(72).step_by(3);
    let near: Vec<_> = near.map(|position| scenario(0, position, false)).collect();
    assert_eq!(not_optimal(Integrator::RK4, &near), [""; 0]);
    assert_eq!(not_optimal(Integrator::RK4, &sample(14)), [""; 0]);
    assert_eq!(not_optimal(Integrator::RK4, &slow()), [""; 0]);
    assert_eq!(not_optimal(Integrator::Euler, &sample(7)), [""; 0]);
}

#[test]
#[ignore = "nightly: 1600 plans, four minutes"]
fn all_starts_in_all_directions_are_planned_at_rest_and_tumbling() {
    for integrator in [Integrator::Euler, Integrator::RK4] {
        for tumbles in [false, true] {
            let starts = starts().into_iter().enumerate();
            let all: Vec<_> = starts.map(|(k, at)| scenario(k, at, tumbles)).collect();
            assert_eq!(not_optimal(integrator, &all), [""; 0]);
        }
    }
}
