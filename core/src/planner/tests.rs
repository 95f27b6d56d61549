//! What is left in memory from before a plan: nothing of it counts.

extern crate std;

use super::*;
use crate::dynamics::{Control, Integrator, State};
use crate::model::TargetState;
use crate::stages::{Mode, ReorientationTrajectory, TranslationTrajectory};
use nalgebra::{SVector, Vector3, Vector4};
use std::boxed::Box;

/// The path and the motion of which every number is the same.
fn filled(value: f64) -> (TranslationTrajectory<NODES>, ReorientationTrajectory<NODES, LINKS>) {
    let (vector, joints) = (Vector3::repeat(value), SVector::repeat(value));
    let attitude = Vector4::repeat(value);
    let state = State { attitude, joint_angle: joints, rate: vector, joint_rate: joints };
    let control = Control { bus_torque: vector, joint_torque: joints };
    let translation = TranslationTrajectory {
        position: [vector; NODES],
        velocity: [vector; NODES],
        force: [vector; NODES],
    };
    (translation, ReorientationTrajectory { states: [state; NODES], controls: [control; NODES] })
}

/// Overwrites all memory of a planner.
fn fill(workspace: &mut Workspace, solver: &mut EmbeddedSolver, value: f64) {
    let (translation, reorientation) = filled(value);
    let (attitude, rate) = (Vector4::repeat(value), Vector3::repeat(value));
    workspace.target = [TargetState { attitude, rate }; NODES];
    workspace.scratch.fill(value);
    workspace.translation.fill(translation);
    workspace.reorientation.fill(reorientation);
    solver.fill(value);
}

/// A flipped bit in memory that a plan does not write first would stay, and strike every plan to
/// come: the controls of the last node are such memory, unless they are seen to.
// Verifies REM-SAF-004.
#[test]
fn a_plan_does_not_depend_on_what_memory_held_before() {
    let (mut workspace, mut solver) = (Box::new(Workspace::new()), Box::new(EmbeddedSolver::new()));
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(4e-4, -3e-4, 6e-4),
        position: Vector3::new(0.3, -0.4, 5.5),
        velocity: Vector3::new(1e-3, 2e-3, -1e-3),
    };
    let mission = Mission::default();
    for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
        let options = PlanSettings::new(Mode::Optimal, integrator);
        let planned = |workspace: &mut Workspace, solver: &mut EmbeddedSolver| {
            let start = &InitialGuess::Heuristic;
            plan(
                &mission,
                &scenario,
                &Options::from_parts(options, *start, Platform::BARE),
                solver,
                workspace,
            )
        };
        let first = planned(&mut workspace, &mut solver);
        assert_eq!(first.status, Status::Solved);
        for value in [f64::NAN, f64::INFINITY, -1e300, 1.0] {
            fill(&mut workspace, &mut solver, value);
            let again = planned(&mut workspace, &mut solver);
            assert_eq!(again.record, first.record, "{value}");
            assert!(again == first, "{value}");
        }
    }
}
