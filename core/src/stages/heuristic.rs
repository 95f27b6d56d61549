//! The heuristic start of Stage 2 (section 9).

use super::terminal::Terminal;
use super::{ReorientationTrajectory, TranslationTrajectory};
use crate::dynamics::{Control, State};
use crate::math::quaternion;
use crate::model::{Mission, Scenario, Servicer, TargetState};
use nalgebra::{SVector, Vector3};

/// Writes the heuristic start: the bus's +z axis follows the docking port's line of sight without
/// roll about it (parallel transport from the initial attitude), the joints move to their capture
/// angles at the preset node, light ones late, rates are finite differences of the pose, controls are
/// zero.
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
    let way = servicer.capture_joint_angle_rad - initial.joint_angle;
    let lightness = SVector::<usize, NL>::from_fn(|i, _| decades_lighter(servicer, i));
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
        let moved = way.zip_map(&lightness, |way, decades| way * share_of_way(progress, decades));
        out.states[k].attitude = attitude;
        out.states[k].joint_angle = initial.joint_angle + moved;
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

/// Powers of ten by which joint `i` carries less inertia than the first joint does, four at most.
fn decades_lighter<const NL: usize>(servicer: &Servicer<NL>, i: usize) -> usize {
    let (all, own) = (servicer.inertia_beyond(0), servicer.inertia_beyond(i));
    [1e1, 1e2, 1e3, 1e4].iter().filter(|&decades| own * decades <= all).count()
}

/// Share of its way that a joint has behind it after a share `progress` of the time. What is heavy moves
/// evenly, for its torques count; what is light turns when the arm is nearly there.
fn share_of_way(progress: f64, decades_lighter: usize) -> f64 {
    (0..decades_lighter).fold(progress, |share, _| share * progress)
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
    let port = quaternion::rotation_matrix(&target.attitude) * mission.target.port_position_m;
    let sight = port - position;
    sight / libm::sqrt(sight.dot(&sight))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_arms_gripper_turns_late() {
        let servicer = Mission::default().servicer;
        assert_eq!([0, 1, 2].map(|i| decades_lighter(&servicer, i)), [0, 0, 2]);
    }

    #[test]
    fn a_joint_that_is_not_there_leaves_the_others_as_they_are() {
        let servicer = Mission::default().servicer;
        let padded = servicer.resized::<7>();
        for i in 0..3 {
            assert_eq!(decades_lighter(&padded, i), decades_lighter(&servicer, i));
        }
    }

    #[test]
    fn shares_go_from_none_to_all_and_the_lighter_joint_is_behind() {
        for decades in 0..4 {
            assert_eq!([0.0, 1.0].map(|progress| share_of_way(progress, decades)), [0.0, 1.0]);
            for k in 1..10 {
                let progress = 0.1 * f64::from(k);
                let share = share_of_way(progress, decades);
                assert!(share > share_of_way(progress, decades + 1), "{decades} {k}");
                assert!(share > share_of_way(progress - 0.1, decades), "{decades} {k}");
            }
        }
    }

    /// A hundred millionth of the first joint's inertia, or none at all.
    #[test]
    fn four_decades_are_the_most() {
        let mut servicer = Mission::default().servicer;
        let gripper = &mut servicer.links[2];
        (gripper.mass_kg, gripper.inertia_kg_m2) = (0.0, nalgebra::Matrix3::zeros());
        assert_eq!(decades_lighter(&servicer, 2), 4);
    }
}
