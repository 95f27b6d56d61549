//! The retraction of Stage 2 against its promise: a step that would miss the pinned poses is led there.

use nalgebra::{SVector, Vector3, Vector4};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Options, PlanSettings, Platform, Workspace, plan,
};
use remora_core::advanced::qp::{Qp, Solution};
use remora_core::advanced::scp::{Problem, Residuals};
use remora_core::advanced::stages::{
    Formulation, LINKS, MissionReorientation, Mode, NODES, ReorientationTrajectory, size,
};
use remora_core::prelude::*;

const NX: usize = size::NX;
const NU: usize = size::NU;
const NG: usize = size::NG;

/// Node from which on the arm is held.
const PRESET: usize = 55;

/// How far a step ends beside the pinned poses of bus and arm [rad].
const TURNS: [f64; 2] = [0.003, 0.006];

/// A step that turns the bus and the first joint a little at every node until they are pinned, with
/// poses that follow from its rates, so that it ends [`TURNS`] beside what is pinned.
fn off_target(mission: &Mission) -> Box<Solution<NODES, NX, NU, NG>> {
    let typical = mission.typical();
    let mut step = Box::new(Solution::ZERO);
    let joint_rate = typical.joint_rate_rad_s.min(mission.servicer.joint_rate_limit_rad_s[0]);
    let ends = [(1, NODES - 1, TURNS[0], typical.rate_rad_s), (3, PRESET, TURNS[1], joint_rate)];
    for (pose, end, turn, scale) in ends {
        let interval = mission.approach.duration_s / (NODES - 1) as f64;
        let rate = turn / (end as f64 * interval);
        for k in 1..end {
            step.x[k][pose] = (k - 1) as f64 * interval * rate / typical.angle_rad;
            step.x[k][pose + 3 + LINKS] = rate / scale;
        }
    }
    step
}

/// What the step misses, the second rollout makes up for, to a few per cent.
#[test]
fn pinned_poses_are_reached() {
    let mission = Mission::default();
    let scenario = Scenario {
        target_attitude: Vector4::new(0.0, 0.0, 0.0, 1.0),
        target_rate: Vector3::new(4e-4, -3e-4, 6e-4),
        position: Vector3::new(0.3, -0.4, 5.5),
        velocity: Vector3::new(1e-3, 2e-3, -1e-3),
        ..Scenario::default()
    };
    for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
        let mut workspace = Box::new(Workspace::new());
        let settings = PlanSettings::new(Mode::Feasible, integrator);
        let options = Options::from_parts(settings, InitialGuess::Heuristic, Platform::BARE);
        let mut solver = Box::new(EmbeddedSolver::new());
        let report = plan(&mission, &scenario, &options, &mut *solver, &mut workspace);
        assert!(report.is_verified());
        let from = &workspace.reorientation.trajectory;
        let problem = MissionReorientation::<Sequential>::new(
            &Formulation::new(&mission, &scenario, integrator),
            &workspace.translation.trajectory,
            &workspace.target,
            Mode::Feasible,
            &Sequential,
        );
        let step = off_target(&mission);
        // Dynamics that the step satisfies.
        let mut qp = Box::new(Qp::<NODES, NX, NU, NG>::ZERO);
        for k in 0..NODES - 1 {
            qp.stages[k].c = step.x[k + 1];
        }
        let mut to = ReorientationTrajectory::ZERO;
        problem.retract(from, &qp, &step, &mut to);
        let mut residuals = Residuals::ZERO;
        problem.residuals(&to, &mut residuals);
        let missed = residuals.defect.iter().map(SVector::amax).fold(0.0, f64::max);
        let missed = missed * mission.typical().angle_rad;
        assert!(missed < 0.03 * TURNS[1], "{integrator}: {missed:e} rad");
    }
}
