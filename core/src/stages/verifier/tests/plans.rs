//! Whole plans: what a change of one number does to them.

extern crate std;

use super::super::verify;
use super::{FLOWN, FREE, Plan, Residuals, posed, residual, rolled_out, scenario, verified};
use crate::dynamics::Control;
use crate::model::{Mission, Scenario};
use crate::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Workspace, plan,
};
use crate::stages::{Mode, NODES};
use nalgebra::{Vector3, Vector4};
use remora_qp::time::Deadline;
use std::{boxed::Box, vec, vec::Vec};

/// A feasible plan of the paper's problem, and its scenario.
fn planned() -> (Scenario, Plan<NODES>) {
    let start = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(4e-4, -3e-4, 6e-4),
        position: Vector3::new(0.3, -0.4, 5.5),
        velocity: Vector3::new(1e-3, 2e-3, -1e-3),
        ..Scenario::default()
    };
    let (mut workspace, mut solver) = (Box::new(Workspace::new()), Box::new(EmbeddedSolver::new()));
    let options = PlanSettings::new(Mode::Feasible, FREE);
    let (mission, platform) = (Mission::default(), Platform::BARE);
    let begin = &InitialGuess::Heuristic;
    let report = plan(
        &mission,
        &start,
        &Options::from_parts(options, *begin, platform),
        &mut *solver,
        &mut workspace,
    );
    assert!(report.residuals.are_within(&mission.tolerances), "{:?}", report.residuals);
    (start, (*workspace.translation(), *workspace.reorientation()))
}

/// All numbers of a plan, but for the controls of the last node, which mean nothing.
fn numbers<const N: usize>(plan: &mut Plan<N>) -> Vec<&mut f64> {
    let (path, motion) = plan;
    let mut all: Vec<&mut f64> = vec![];
    all.extend(path.position.iter_mut().chain(&mut path.velocity).flatten());
    all.extend(path.force.iter_mut().take(N - 1).flatten());
    for state in &mut motion.states {
        all.extend(state.attitude.iter_mut().chain(&mut state.joint_angle));
        all.extend(state.rate.iter_mut().chain(&mut state.joint_rate));
    }
    for control in motion.controls.iter_mut().take(N - 1) {
        all.extend(control.bus_torque.iter_mut().chain(&mut control.joint_torque));
    }
    all
}

#[test]
fn no_plan_with_something_that_is_not_a_number_passes() {
    let mission = Mission::default();
    let (start, mut feasible) = planned();
    for i in (0..numbers(&mut feasible).len()).step_by(11) {
        for value in [f64::NAN, f64::INFINITY] {
            let mut spoilt = feasible;
            *numbers(&mut spoilt)[i] = value;
            let found = verified(&mission, FREE, &start, &spoilt).residuals;
            assert!(!found.are_within(&mission.tolerances), "{i} {value}");
        }
    }
    // To fly: nothing hides it.
    let start = scenario(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros());
    let mut plan = rolled_out::<3>(&mission, FLOWN, &start, posed([0.0; 3]), Control::ZERO);
    for i in 0..numbers(&mut plan).len() {
        let mut spoilt = plan;
        *numbers(&mut spoilt)[i] = f64::NAN;
        let found = verified(&mission, FLOWN, &start, &spoilt).residuals;
        let all = found.against(&mission.tolerances);
        assert!(all.iter().any(|(_, value, _)| value.is_nan()), "{i}");
    }
}

#[test]
fn a_scenario_that_is_not_a_number_fails() {
    let mission = Mission::default();
    let (start, (path, motion)) = planned();
    let changes: [fn(&mut Scenario); 4] = [
        |s| s.target_attitude.x = f64::NAN,
        |s| s.target_rate.y = f64::NAN,
        |s| s.position.z = f64::NAN,
        |s| s.velocity.x = f64::NAN,
    ];
    for change in changes {
        let mut other = start;
        change(&mut other);
        let found = verify(&mission, &other, FREE, &path, &motion, &Deadline::never());
        assert!(!found.residuals.are_within(&mission.tolerances));
    }
}

/// A change of a plan.
type Change = fn(&mut Plan<NODES>);

#[test]
fn each_residual_reacts() {
    let mission = Mission::default();
    let (start, feasible) = planned();
    let changes: [(&str, Change); 16] = [
        ("dynamics1", |p| p.0.position[0].x += 2e-4),
        ("dynamics1", |p| p.0.velocity[30].y += 2e-6),
        ("dynamics1", |p| p.0.force[10].z += 1e-3),
        ("dynamics1", |p| p.0.position[NODES - 1].x += 2e-4),
        ("keep_out", |p| p.0.position[20] *= 0.2),
        ("dynamics2", |p| p.1.states[0].attitude.x += 2e-4),
        ("dynamics2", |p| p.1.states[25].joint_rate[1] += 2e-6),
        ("dynamics2", |p| p.1.controls[25].joint_torque[2] += 1e-5),
        ("control", |p| p.0.force[3].y = 2.51),
        ("control", |p| p.1.controls[58].bus_torque.z = -5.1e-3),
        ("joint", |p| p.1.states[59].joint_angle[1] = 1.58),
        ("joint_rate", |p| p.1.states[7].joint_rate[0] = 5.1e-3),
        ("pointing", |p| p.1.states[7].attitude = Vector4::new(1.0, 0.0, 0.0, 1.0)),
        ("preset", |p| p.1.states[NODES - 5].joint_angle[0] += 2e-4),
        ("preset", |p| p.1.states[NODES - 2].joint_rate[0] += 2e-6),
        ("terminal_rate", |p| p.1.states[NODES - 1].rate.x += 2e-6),
    ];
    for (i, (name, change)) in changes.into_iter().enumerate() {
        let mut changed = feasible;
        change(&mut changed);
        let found = verified(&mission, FREE, &start, &changed).residuals;
        let (value, tolerance) = residual(&found, name);
        assert!(value > tolerance, "{i}: {name} {value}");
    }
    let mut changed = feasible;
    changed.0.position[NODES - 1].y += 2e-3;
    let found = verified(&mission, FREE, &start, &changed).residuals;
    assert!((found.ee_position - 2e-3).abs() < 1e-4);
    let mut changed = feasible;
    let attitude = &mut changed.1.states[NODES - 1].attitude;
    *attitude += Vector4::new(0.0, 0.0, 0.0, 0.02);
    let found = verified(&mission, FREE, &start, &changed).residuals;
    assert!(found.ee_angle > 1e-3 && found.ee_position > 1e-3, "{found:?}");
}

/// The same plan against a servicer of which one joint or axis may do less.
#[test]
fn limits_count_joint_by_joint_and_axis_by_axis() {
    let (start, feasible) = planned();
    let found = |change: &dyn Fn(&mut Mission<3>)| {
        let mut mission = Mission::default();
        change(&mut mission);
        verified(&mission, FREE, &start, &feasible).residuals
    };
    // The first joint ends at -0.753 rad; that is below this stop, and above no upper one.
    let low = found(&|m| m.servicer.min_joint_angle_rad[0] = -0.5);
    let (value, tolerance) = residual(&low, "joint");
    assert!((value - 0.252_793_7).abs() < 1e-6 && value > tolerance, "{value}");
    assert!(!low.are_within(&Mission::default().tolerances));
    let others = Residuals { joint: 0.0, ..low };
    assert!(others.are_within(&Mission::default().tolerances), "{others:?}");
    // The second one ends at 1.506 rad.
    let high = found(&|m| m.servicer.max_joint_angle_rad[1] = 1.5);
    assert!((high.joint - 5.587_4e-3).abs() < 1e-6, "{}", high.joint);
    assert_eq!(found(&|m| m.servicer.min_joint_angle_rad[1] = 0.5).joint, 0.0);

    let (path, motion) = &feasible;
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let force = largest(&mut path.force.iter().take(NODES - 1).map(|f| f.y.abs()));
    let bus = largest(&mut motion.controls.iter().take(NODES - 1).map(|u| u.bus_torque.x.abs()));
    let joint =
        largest(&mut motion.controls.iter().take(NODES - 1).map(|u| u.joint_torque[2].abs()));
    let rate = largest(&mut motion.states.iter().map(|x| x.joint_rate[1].abs()));
    let near_one = |value: f64| assert!((value - 1.0).abs() < 1e-12, "{value}");
    near_one(found(&|m| m.servicer.force_limit_n.y = force / 2.0).control);
    near_one(found(&|m| m.servicer.bus_torque_limit_n_m.x = bus / 2.0).control);
    near_one(found(&|m| m.servicer.joint_torque_limit_n_m[2] = joint / 2.0).control);
    near_one(found(&|m| m.servicer.joint_rate_limit_rad_s[1] = rate / 2.0).joint_rate);
}

/// To fly the arm is held by its angles, in the paper's problem by its rates.
#[test]
fn the_arm_is_held_as_the_problem_says() {
    let mission = Mission::default();
    let capture = mission.servicer.capture_joint_angle_rad;
    let start = scenario(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros());
    let angles = [capture[0], capture[1], capture[2]];
    let (path, mut motion) =
        rolled_out::<NODES>(&mission, FREE, &start, posed(angles), Control::ZERO);
    motion.states = [posed(angles); NODES];
    let held = |change: fn(&mut Plan<NODES>)| {
        let mut plan = (path, motion);
        change(&mut plan);
        [FREE, FLOWN].map(|i| verified(&mission, i, &start, &plan).residuals.preset)
    };
    assert_eq!(held(|_| ()), [0.0, 0.0]);
    let near = |found: [f64; 2], expected: [f64; 2]| {
        (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-12)
    };
    assert!(near(held(|p| p.1.states[54].joint_angle[0] += 1e-3), [0.0, 0.0]));
    assert!(near(held(|p| p.1.states[55].joint_angle[0] += 1e-3), [1e-3, 1e-3]));
    assert!(near(held(|p| p.1.states[57].joint_angle[0] += 1e-3), [0.0, 1e-3]));
    assert!(near(held(|p| p.1.states[59].joint_angle[0] += 1e-3), [0.0, 1e-3]));
    assert!(near(held(|p| p.1.states[54].joint_rate[0] += 1e-5), [0.0, 0.0]));
    assert!(near(held(|p| p.1.states[57].joint_rate[0] += 1e-5), [1e-3, 0.0]));
    assert!(near(held(|p| p.1.states[59].joint_rate[0] += 1e-5), [1e-3, 1e-3]));
}
