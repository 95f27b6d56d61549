//! The heuristic start of Stage 2 (section 9).

use super::terminal::Terminal;
use super::{ReorientationTrajectory, TranslationTrajectory};
use crate::dynamics::{Control, State};
use crate::math::quaternion;
use crate::model::{Mission, Scenario, TargetState};
use nalgebra::Vector3;

/// Writes the heuristic start: the bus's +z axis follows the docking port's line of sight without
/// roll about it (parallel transport from the initial attitude), the joints move linearly to their
/// capture angles at the preset node, rates are finite differences of the pose, controls are zero.
///
/// The initial state is the scenario's.
pub fn warm_start<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    scenario: &Scenario<NL>,
    translation: &TranslationTrajectory<N>,
    target: &[TargetState; N],
    out: &mut ReorientationTrajectory<N, NL>,
) {
    let servicer = &mission.servicer;
    let grid = mission.grid(scenario);
    let (preset, dt, nodes) = (grid.preset_node(), grid.interval(), grid.nodes.min(N));
    let initial = State::at_start(mission, scenario);
    let mut attitude = initial.attitude;
    for k in 0..nodes {
        if k > 0 {
            let sight = line_of_sight(mission, &translation.position[k], &target[k]);
            let axis = quaternion::rotation_matrix(&attitude) * Vector3::z();
            attitude = quaternion::normalized(&quaternion::product(
                &quaternion::between(&axis, &sight),
                &attitude,
            ));
        }
        let progress = (k as f64 / preset as f64).min(1.0);
        let travel = servicer.capture_joint_angle - initial.joint_angle;
        out.states[k].attitude = attitude;
        out.states[k].joint_angle = initial.joint_angle + travel * progress;
        out.controls[k] = Control::ZERO;
    }
    if mission.roll.is_some() {
        roll_to_port(mission, translation, target, nodes, out);
    }
    for k in 0..nodes {
        // The pose of the last node says nothing about its rate; the terminal constraints do.
        let next = (k + 1).min(nodes - 1);
        let turn = quaternion::product(
            &out.states[next].attitude,
            &quaternion::conjugate(&out.states[k].attitude),
        );
        out.states[k].rate = quaternion::log(&turn) / dt;
        out.states[k].joint_rate = (out.states[next].joint_angle - out.states[k].joint_angle) / dt;
    }
}

/// Rolls the bus about the line of sight, by a share that grows with time, until its roll at the last
/// node is that of capture.
// Not inlined: most missions leave the roll free.
#[inline(never)]
fn roll_to_port<const N: usize, const NL: usize>(
    mission: &Mission<NL>,
    translation: &TranslationTrajectory<N>,
    target: &[TargetState; N],
    nodes: usize,
    out: &mut ReorientationTrajectory<N, NL>,
) {
    let last = nodes.saturating_sub(1).min(N - 1);
    let terminal = Terminal::new(mission, &target[last]);
    let end = &out.states[last].attitude;
    let aligned = quaternion::product(&terminal.alignment(end), end);
    let angle = terminal.roll_left(&aligned);
    for k in 0..nodes {
        let share = k as f64 / last as f64;
        let sight = line_of_sight(mission, &translation.position[k], &target[k]);
        let roll = quaternion::exp(&(sight * (share * angle)));
        let attitude = &mut out.states[k].attitude;
        *attitude = quaternion::normalized(&quaternion::product(&roll, attitude));
    }
}

/// Unit vector from the system's centre of mass (`position`, RTN) to the docking port, in RTN.
pub fn line_of_sight<const NL: usize>(
    mission: &Mission<NL>,
    position: &Vector3<f64>,
    target: &TargetState,
) -> Vector3<f64> {
    let port = quaternion::rotation_matrix(&target.attitude) * mission.target.port_position;
    let sight = port - position;
    sight / libm::sqrt(sight.dot(&sight))
}
