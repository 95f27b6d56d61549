//! The verifier against plans made by hand.

mod bodies;
mod distance;
mod intervals;
mod plans;
mod shared;
mod target;

use super::{Residuals, Verification, verify};
use crate::dynamics::{Control, Integrator, Multibody, State};
use crate::math::quaternion;
use crate::model::{Approach, HcwTransition, Mission, Scenario};
use crate::stages::{ReorientationTrajectory, TranslationTrajectory};
use nalgebra::{SVector, Vector3};
use remora_qp::time::Deadline;

const FREE: Integrator = Integrator::Euler;
const FLOWN: Integrator = Integrator::Rk4 { substeps: 8 };

type Plan<const N: usize> = (TranslationTrajectory<N>, ReorientationTrajectory<N, 3>);

/// A target that rests in RTN at t = 0, aligned with it, and the servicer at `position`.
fn scenario(position: Vector3<f64>, velocity: Vector3<f64>) -> Scenario {
    let target_attitude = quaternion::IDENTITY;
    Scenario { target_attitude, position, velocity, ..Scenario::default() }
}

/// A state at rest in RTN and aligned with it.
fn posed(joint_angle: [f64; 3]) -> State<3> {
    State { joint_angle: SVector::from(joint_angle), ..State::ZERO }
}

/// What follows from a start with a control held all the time and no force.
fn rolled_out<const N: usize>(
    mission: &Mission<3>,
    integrator: Integrator,
    scenario: &Scenario,
    state: State<3>,
    control: Control<3>,
) -> Plan<N> {
    let dt = mission.approach.duration_s / (N - 1) as f64;
    let coast = HcwTransition::new(mission.mean_motion(), dt).state;
    let body = Multibody::new(mission);
    let mut path = TranslationTrajectory::ZERO;
    let mut motion = ReorientationTrajectory { states: [state; N], controls: [control; N] };
    path.position[0] = scenario.position;
    path.velocity[0] = scenario.velocity;
    for k in 0..N - 1 {
        let (r, v) = (path.position[k], path.velocity[k]);
        let next = coast * SVector::<f64, 6>::from([r.x, r.y, r.z, v.x, v.y, v.z]);
        path.position[k + 1] = next.fixed_rows::<3>(0).into_owned();
        path.velocity[k + 1] = next.fixed_rows::<3>(3).into_owned();
        let force = Vector3::zeros();
        motion.states[k + 1] = body.step(integrator, dt, &motion.states[k], &control, &force);
    }
    (path, motion)
}

/// The mission with plans of so many nodes.
fn with_nodes(mission: &Mission<3>, nodes: usize) -> Mission<3> {
    Mission { approach: Approach { nodes, ..mission.approach }, ..*mission }
}

fn verified<const N: usize>(
    mission: &Mission<3>,
    integrator: Integrator,
    scenario: &Scenario,
    plan: &Plan<N>,
) -> Verification {
    let mission = with_nodes(mission, N);
    verify(&mission, scenario, integrator, &plan.0, &plan.1, &Deadline::never())
}

fn residual(of: &Residuals, name: &str) -> (f64, f64) {
    let all = of.against(&Mission::default().tolerances);
    let (_, value, tolerance) = all.into_iter().find(|row| row.0 == name).unwrap();
    (value, tolerance)
}
