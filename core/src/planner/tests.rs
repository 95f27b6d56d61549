//! Tests: no plan depends on earlier contents of memory, or is called solved when rejected.

extern crate std;

use super::*;
use crate::dynamics::{Control, Integrator, State};
use crate::executor::Sequential;
use crate::model::TargetState;
use crate::scp::Problem;
use crate::stages::{
    Formulation, LINKS, Mode, Reorientation, ReorientationTrajectory, TranslationTrajectory, size,
};
use nalgebra::{SVector, Vector3, Vector4};
use remora_qp::time::Clock;
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
        ..Scenario::default()
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

/// The heuristic's merit, and what its sum, broken off once it is enough, says of merits up to it and beyond.
#[test]
fn a_merit_that_is_not_summed_to_its_end_is_judged_as_the_whole() {
    let (mut workspace, mut solver) = (Box::new(Workspace::new()), Box::new(EmbeddedSolver::new()));
    let mission = Mission::default();
    let scenario = Scenario { target_attitude: Vector4::w(), ..Scenario::default() };
    for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
        for mode in [Mode::Optimal, Mode::Feasible] {
            let settings = PlanSettings::new(mode, integrator);
            let options = Options::from_parts(settings, InitialGuess::Heuristic, Platform::BARE);
            plan(&mission, &scenario, &options, &mut *solver, &mut workspace);
            let formulation = Formulation::new(&mission, &scenario, integrator);
            guess::write_heuristic(&formulation, &mut workspace);
            let ArmWorkspace { target, scratch: w, translation, reorientation: z } =
                &mut *workspace;
            let translation = &translation.trajectory;
            let problem = Reorientation::<_, NODES, LINKS, _, { size::controls(LINKS) }>::new(
                &formulation,
                translation,
                target,
                mode,
                &Sequential,
            );
            let z = &mut z.trajectory;
            problem.project(z);
            problem.residuals(z, &mut w.residuals);
            for penalty_parameter in [0.0, 10.0, 30.0] {
                let whole = w.residuals.cost + penalty_parameter * w.residuals.l1_violation();
                assert!(penalty_parameter == 0.0 || whole > 0.0);
                let scratch = &mut w.trial_residuals;
                let mut is_reached =
                    |merit| problem.has_at_least_merit(merit, penalty_parameter, z, scratch);
                for merit in [-1.0, 0.0, 0.1 * whole, 0.9 * whole, whole] {
                    assert!(is_reached(merit), "{merit} of {whole}");
                }
                for merit in [whole.next_up(), 2.0 * whole + 1.0, f64::INFINITY, f64::NAN] {
                    assert!(!is_reached(merit), "{merit} of {whole}");
                }
            }
        }
    }
}

/// A clock by which every deadline of a second has passed once it is set.
struct Late;

impl Clock for Late {
    fn seconds(&self) -> f64 {
        f64::INFINITY
    }
}

/// Residuals of which one is `value`.
fn one_residual(which: usize, value: f64) -> Residuals {
    let set: [fn(&mut Residuals, f64); Residuals::COUNT] = [
        |r, value| r.dynamics1 = value,
        |r, value| r.keep_out = value,
        |r, value| r.dynamics2 = value,
        |r, value| r.control = value,
        |r, value| r.joint = value,
        |r, value| r.joint_rate = value,
        |r, value| r.pointing = value,
        |r, value| r.preset = value,
        |r, value| r.terminal_rate = value,
        |r, value| r.ee_position = value,
        |r, value| r.ee_angle = value,
        |r, value| r.clearance = value,
    ];
    let mut residuals = Residuals::default();
    set[which](&mut residuals, value);
    residuals
}

/// Every way in which the stages end, with each residual beyond its tolerance, with time left and
/// without.
// Verifies REM-PLN-003.
#[test]
fn what_the_verifier_rejects_is_never_called_solved() {
    let tolerances = Mission::<LINKS>::default().tolerances;
    let ends = [
        Status::Solved,
        Status::IterationLimit,
        Status::Infeasible,
        Status::Deadline,
        Status::NumericalFailure,
    ];
    let deadlines = [Deadline::never(), Deadline::after(&Late, 0.0)];
    let judge = |residuals: Residuals, stages, deadline| {
        let is_verified = residuals.are_within(&tolerances);
        let (clearances, arm) = (Clearances::NONE, ArmClearances::NONE);
        let found = Verification { residuals, clearances, arm };
        (is_verified, status_of(stages, &found, is_verified, deadline))
    };
    for stages in ends {
        for deadline in &deadlines {
            assert_eq!(judge(Residuals::default(), stages, deadline), (true, stages));
            assert_ne!(judge(Residuals::UNFINISHED, stages, deadline).1, Status::Solved);
            for which in 0..Residuals::COUNT {
                let (_, _, tolerance) = Residuals::default().against(&tolerances)[which];
                assert_eq!(judge(one_residual(which, tolerance), stages, deadline).1, stages);
                for value in [1.001 * tolerance, 1.0, f64::MAX, f64::INFINITY, f64::NAN] {
                    let (is_verified, status) = judge(one_residual(which, value), stages, deadline);
                    assert!(!is_verified, "{which} {value}");
                    assert_ne!(status, Status::Solved, "{stages:?} {which} {value}");
                    if stages != Status::Solved {
                        assert_eq!(status, stages);
                    }
                }
            }
        }
    }
}
