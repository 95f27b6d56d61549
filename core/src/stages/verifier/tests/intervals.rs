//! What happens between the nodes.

use super::super::PARTS;
use super::super::posture::{Posture, initial_bus_attitude};
use super::super::reorientation::{Interval, difference};
use super::super::start::Beyond;
use super::super::translation::Path;
use super::super::{Residuals, verify, verify_translation};
use super::{FLOWN, FREE, posed, rolled_out, scenario, verified, with_nodes};
use crate::dynamics::{Control, Integrator, State, articulated};
use crate::math::quaternion;
use crate::model::{self, Mission, Scenario, Switch};
use crate::stages::TranslationTrajectory;
use core::sync::atomic::{AtomicU32, Ordering};
use nalgebra::{SVector, Vector3};
use proptest::prelude::*;
use remora_qp::time::{Clock, Deadline};

/// A mission of `seconds`, with limits between the nodes or without.
fn mission(seconds: f64, between_nodes: Switch) -> Mission<3> {
    let mut mission = Mission::default();
    mission.approach.duration_s = seconds;
    mission.approach.keep_out_near_s = 0.3 * seconds;
    mission.approach.between_nodes = between_nodes;
    mission.approach.clearance = Switch::Off;
    mission
}

const SWITCHES: [Switch; 2] = [Switch::Off, Switch::On];

/// Through the target from one node to the next.
// Verifies REM-PLN-012.
#[test]
fn keep_out_holds_between_the_nodes() {
    let start = scenario(Vector3::new(-4.0, 0.0, 0.0), Vector3::new(0.4, 0.0, 0.0));
    for integrator in [FREE, FLOWN] {
        let [off, on] = SWITCHES.map(|switch| {
            let mission = mission(60.0, switch);
            let state = posed([0.0; 3]);
            let plan = rolled_out::<4>(&mission, integrator, &start, state, Control::ZERO);
            let residuals = verified(&mission, integrator, &start, &plan).residuals;
            let alone = verify_translation(&with_nodes(&mission, 4), &start, integrator, &plan.0);
            assert_eq!(alone.keep_out, residuals.keep_out);
            assert_eq!(alone.dynamics1, residuals.dynamics1);
            residuals.keep_out
        });
        assert_eq!(off, 0.0);
        // At the middle of the interval it is at the target's centre, 0.2 m deep.
        assert!((on - 2.05).abs() < 0.01, "{on}");
    }
}

#[test]
fn the_radius_between_nodes_is_the_smaller_and_at_the_end_that_of_the_terminal_state() {
    let mission = Mission::default();
    let trajectory = &TranslationTrajectory::<60>::ZERO;
    let grid = mission.own_grid();
    let beyond = &Beyond::of(&mission, &Scenario::default(), &grid);
    let path = Path { mission: &mission, grid, trajectory, between: true, beyond };
    assert_eq!([40, 41, 42].map(|k| path.radius_after(k)), [1.85, 1.46, 1.46]);
    let reach = mission.servicer.capture_geometry().reach;
    assert!((path.radius_after(58) - reach.min(1.46)).abs() < 1e-14);
    let mut short = mission;
    short.approach.keep_out_near_m = 2.0;
    let path = Path { mission: &short, ..path };
    assert!((path.radius_after(58) - reach).abs() < 1e-14);
}

/// A joint's torque that brings it back after an interval to where it came from.
fn bounce(mission: &Mission<3>, state: &State<3>, dt: f64) -> Control<3> {
    let n = mission.mean_motion();
    let acceleration = |torque: f64| {
        let joint_torque = SVector::from([0.0, 0.0, torque]);
        let control = Control { joint_torque, ..Control::ZERO };
        articulated::acceleration(&mission.servicer, n, state, &control, &Vector3::zeros()).joint[2]
    };
    let (free, unit) = (acceleration(0.0), acceleration(1e-4) - acceleration(0.0));
    let torque = 1e-4 * (-2.0 * state.joint_rate[2] / dt - free) / unit;
    Control { joint_torque: SVector::from([0.0, 0.0, torque]), ..Control::ZERO }
}

/// Beyond the stop and back within one interval, by 20 s of at most 4e-3 rad/s.
// Verifies REM-PLN-012.
#[test]
fn joint_stops_hold_between_the_nodes() {
    let start = scenario(Vector3::new(0.0, 0.0, 9.0), Vector3::zeros());
    let [off, on] = SWITCHES.map(|switch| {
        let mission = mission(20.0, switch);
        let mut state = posed([0.0, 0.0, 1.745]);
        state.joint_rate[2] = 4e-3;
        let control = bounce(&mission, &state, 20.0);
        let plan = rolled_out::<2>(&mission, FLOWN, &start, state, control);
        verified(&mission, FLOWN, &start, &plan).residuals
    });
    assert_eq!(off.joint, 0.0);
    assert!((on.joint - 0.015).abs() < 1e-3, "{}", on.joint);
    assert!(on.joint_rate == 0.0 && on.control == 0.0, "{on:?}");
}

/// Once round in an interval, back where it looked at the port; the arm swings as it turns.
// Verifies REM-PLN-012.
#[test]
fn joint_rates_and_pointing_hold_between_the_nodes() {
    let start = scenario(Vector3::new(0.0, 0.0, -9.0), Vector3::zeros());
    let [off, on] = SWITCHES.map(|switch| {
        let mission = mission(60.0, switch);
        let mut state = posed([0.2, 0.0, 0.0]);
        state.rate.y = core::f64::consts::TAU / 60.0;
        let fine = Integrator::Rk4 { substeps: 200 };
        let plan = rolled_out::<2>(&mission, fine, &start, state, Control::ZERO);
        verified(&mission, fine, &start, &plan).residuals
    });
    assert!(on.joint_rate > 1.05 * off.joint_rate, "{off:?} {on:?}");
    assert!(on.pointing > 1.5 && off.pointing < 0.3, "{off:?} {on:?}");
}

#[test]
fn too_few_substeps_are_seen_and_enough_are_too() {
    let mission = mission(20.0, Switch::Auto);
    let start = scenario(Vector3::new(0.0, 0.0, -9.0), Vector3::zeros());
    let mut state = posed([-0.3, 0.6, 0.0]);
    state.rate = Vector3::new(0.04, -0.02, 0.03);
    let defect = |substeps| {
        let integrator = Integrator::Rk4 { substeps };
        let (control, force) = (Control::ZERO, Vector3::zeros());
        let plan = rolled_out::<2>(&mission, integrator, &start, state, control);
        let found = verified(&mission, integrator, &start, &plan).residuals.dynamics2;
        let dt = mission.approach.duration_s;
        let held = Interval { mission: &mission, integrator, dt, control: &control, force: &force };
        let flown = held.fly(&state);
        assert_eq!(flown.unresolved, 0.0);
        let defect = difference(&flown.states[PARTS], &plan.1.states[1]);
        // The initial state is not the mission's either.
        assert!(found >= defect, "{found}");
        defect
    };
    let tolerance = mission.tolerances.dynamics;
    assert!(defect(1) > 10.0 * tolerance && defect(2) > tolerance, "{} {}", defect(1), defect(2));
    assert!(defect(200) < 0.01 * tolerance, "{}", defect(200));
}

#[test]
fn a_motion_that_cannot_be_resolved_does_not_pass() {
    let mission = mission(20.0, Switch::Auto);
    let start = scenario(Vector3::new(0.0, 0.0, -9.0), Vector3::zeros());
    let mut state = posed([-0.3, 0.6, 0.0]);
    state.rate = Vector3::new(30.0, -20.0, 25.0);
    let plan = rolled_out::<2>(&mission, FLOWN, &start, state, Control::ZERO);
    assert!(!(verified(&mission, FLOWN, &start, &plan).residuals.dynamics2 < 0.1));
}

/// A clock that jumps beyond every deadline at a reading.
struct Jumps {
    readings: AtomicU32,
    at: u32,
}

impl Clock for Jumps {
    fn seconds(&self) -> f64 {
        let before = self.readings.fetch_add(1, Ordering::Relaxed);
        if before >= self.at { 3600.0 } else { 0.0 }
    }
}

#[test]
fn a_deadline_leaves_residuals_that_cannot_pass() {
    let mission = mission(60.0, Switch::Auto);
    let start = scenario(Vector3::new(0.0, 0.0, -4.0), Vector3::zeros());
    let state = posed([0.0; 3]);
    let (path, motion) = rolled_out::<4>(&mission, FLOWN, &start, state, Control::ZERO);
    // One reading sets the deadline, one is for each interval, one for the end.
    for at in 0..6 {
        let clock = Jumps { readings: AtomicU32::new(0), at };
        let deadline = Deadline::after(&clock, 1.0);
        let found = verify(&mission, &start, FLOWN, &path, &motion, &deadline);
        assert_eq!(found.residuals == Residuals::UNFINISHED, (1..=4).contains(&at), "{at}");
        let looked_at = found.clearances.arm.distance < f64::INFINITY;
        assert_eq!(looked_at, at != 1, "{at}");
    }
    assert!(!Residuals::UNFINISHED.are_within(&mission.tolerances));
    let passing = Residuals::UNFINISHED.against(&mission.tolerances);
    assert!(passing.iter().all(|(_, value, tolerance)| value > tolerance));
}

proptest! {
    #[test]
    fn initial_attitudes_agree(position in [-5.0..5.0_f64, -5.0..5.0, -5.0..5.0]) {
        let position = Vector3::from(position);
        let (a, b) = (initial_bus_attitude(&position), model::initial_bus_attitude(&position));
        prop_assert!(quaternion::difference(&a, &b).norm() < 1e-12);
    }
}

#[test]
fn initial_attitudes_agree_on_the_axes_too() {
    for i in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut position = Vector3::zeros();
            position[i] = 5.0 * sign;
            let (a, b) = (initial_bus_attitude(&position), model::initial_bus_attitude(&position));
            assert!(quaternion::difference(&a, &b).norm() < 1e-12, "{position}");
        }
    }
}

#[test]
fn the_reach_is_the_published_one() {
    let servicer = Mission::default().servicer;
    let (posture, other) = (Posture::at_capture(&servicer), servicer.capture_geometry());
    assert!((posture.reach() - 1.46).abs() < 5e-5);
    assert!((posture.arm() - other.direction * other.reach).norm() < 1e-14);
}
