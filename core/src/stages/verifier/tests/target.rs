//! The target's motion: two integrations of it, and what is known of it exactly.

extern crate std;

use super::super::PARTS;
use super::super::target::Tumbling;
use super::{FLOWN, FREE};
use crate::math::quaternion;
use crate::model::{Integrator, Mission, Scenario, Switch, TargetState};
use nalgebra::{Vector3, Vector4};
use std::{vec, vec::Vec};

const HORIZON: f64 = 1200.0;

fn scenario(rate: Vector3<f64>) -> Scenario {
    Scenario {
        target_attitude: quaternion::normalized(&Vector4::new(0.2, -0.5, 0.1, 0.7)),
        target_rate: rate,
        ..Scenario::default()
    }
}

/// By the planner, at `t = 0, dt, ...`.
fn planned(mission: &Mission<3>, s: &Scenario, i: Integrator, dt: f64) -> Vec<TargetState> {
    let mut nodes = vec![TargetState::ZERO; (HORIZON / dt) as usize + 1];
    let n = mission.mean_motion();
    mission.target.tumble(i, n, &s.target_attitude, &s.target_rate, dt, &mut nodes);
    nodes
}

/// By the verifier.
fn verified(mission: &Mission<3>, s: &Scenario, i: Integrator, dt: f64) -> Vec<TargetState> {
    let mut target = Tumbling::new(mission, s, i);
    let mut nodes = vec![target.state()];
    nodes.extend((0..(HORIZON / dt) as usize).map(|k| target.along(k, dt)[PARTS]));
    nodes
}

// Verifies REM-PLN-015.
#[test]
fn planner_and_verifier_see_the_same_tumble() {
    let mission = Mission::default();
    let ways = [
        Vector3::new(0.0, 1.0, 0.0),
        Vector3::new(0.0, 0.0, 1.0),
        Vector3::new(0.6, -0.5, 0.62),
        Vector3::new(0.2, -0.5, 0.84),
        // Near the unstable axis; at it nobody can tell.
        Vector3::new(0.99, 0.1, 0.05),
    ];
    for (integrator, size, dt) in [FREE, FLOWN].into_iter().flat_map(|i| {
        let grids = [(1e-3, 20.0), (1e-2, 20.0), (0.1, 1.0), (0.1, 5.0), (0.1, 20.0)];
        grids.map(|(size, dt)| (i, size, dt))
    }) {
        for way in ways {
            let s = scenario(way.normalize() * size);
            let ours = verified(&mission, &s, integrator, dt);
            for (a, b) in planned(&mission, &s, integrator, dt).iter().zip(&ours) {
                let apart = quaternion::difference(&a.attitude, &b.attitude).norm();
                assert!(apart < 1e-9, "{integrator:?} {size} {dt} {way}: {apart}");
                assert!((a.rate - b.rate).norm() < 1e-9 * size);
            }
        }
    }
}

#[test]
fn the_gradient_makes_a_difference() {
    let (mission, s) = (Mission::default(), scenario(Vector3::new(9e-4, -7e-4, 5e-4)));
    let (free, flown) = (verified(&mission, &s, FREE, 20.0), verified(&mission, &s, FLOWN, 20.0));
    let apart = quaternion::difference(&free[60].attitude, &flown[60].attitude).norm();
    assert!(apart > 0.01, "{apart}");
}

/// The states within an interval are those that a finer grid has at its nodes.
#[test]
fn states_within_an_interval_are_where_they_belong() {
    let (mission, s) = (Mission::default(), scenario(Vector3::new(0.01, -0.02, 0.015)));
    let fine = verified(&mission, &s, FLOWN, 2.0);
    let mut target = Tumbling::new(&mission, &s, FLOWN);
    for k in 0..60 {
        for (part, state) in target.along(k, 20.0).iter().enumerate() {
            let at = fine[10 * k + part];
            assert!(quaternion::difference(&at.attitude, &state.attitude).norm() < 1e-11);
        }
    }
}

/// A symmetric body free of torques turns about its momentum and about its own axis.
#[test]
fn a_symmetric_target_moves_as_the_textbook_says() {
    let mut mission = Mission::default();
    mission.target.inertia_kg_m2 = Vector3::new(2.0, 2.0, 3.0);
    let s = scenario(Vector3::new(0.02, -0.03, 0.04));
    let n = mission.mean_motion();
    let start = quaternion::rotation_matrix(&s.target_attitude);
    let rate = s.target_rate + start.transpose() * Vector3::new(0.0, 0.0, n);
    let momentum = start * mission.target.inertia_kg_m2.component_mul(&rate);
    for states in [planned(&mission, &s, FREE, 20.0), verified(&mission, &s, FREE, 20.0)] {
        for (k, state) in states.iter().enumerate() {
            let t = 20.0 * k as f64;
            let precessed = quaternion::exp(&(momentum * (t / 2.0)));
            let spun = quaternion::exp(&(Vector3::z() * (rate.z * (1.0 - 3.0 / 2.0) * t)));
            let inertial =
                quaternion::product(&precessed, &quaternion::product(&s.target_attitude, &spun));
            let frame = quaternion::exp(&Vector3::new(0.0, 0.0, -n * t));
            let exact = quaternion::product(&frame, &inertial);
            assert!(quaternion::difference(&exact, &state.attitude).norm() < 1e-9, "{k}");
        }
    }
}

/// A body at rest near the attitude that the gravity gradient holds swings about it in pitch at
/// `n sqrt(3 (J_T - J_R) / J_N)`.
#[test]
fn small_librations_have_the_known_frequency() {
    let mut mission = Mission::default();
    mission.target.inertia_kg_m2 = Vector3::new(1.5, 2.5, 3.0);
    let (angle, n) = (1e-4, mission.mean_motion());
    let frequency = n * (3.0 * (2.5 - 1.5) / 3.0_f64).sqrt();
    let mut s = scenario(Vector3::zeros());
    s.target_attitude = quaternion::exp(&Vector3::new(0.0, 0.0, angle));
    for states in [planned(&mission, &s, FLOWN, 20.0), verified(&mission, &s, FLOWN, 20.0)] {
        for (k, state) in states.iter().enumerate() {
            let pitch = quaternion::log(&state.attitude);
            let exact = angle * (frequency * 20.0 * k as f64).cos();
            assert!((pitch - Vector3::new(0.0, 0.0, exact)).norm() < 1e-7 * angle, "{k}");
        }
    }
}

#[test]
fn a_target_that_cannot_be_followed_is_nowhere() {
    let mut mission = Mission::default();
    mission.target.gravity_gradient = Switch::On;
    for rate in [1e6, f64::NAN, f64::INFINITY] {
        let mut target = Tumbling::new(&mission, &scenario(Vector3::repeat(rate)), FLOWN);
        let states = target.along(0, 20.0);
        assert!(states[PARTS].attitude.iter().all(|x| x.is_nan()), "{rate}");
        assert!(target.state().rate.iter().all(|x| x.is_nan()), "{rate}");
    }
}
