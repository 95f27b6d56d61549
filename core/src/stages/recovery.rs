//! The limits that a given start violates, once the path is known.

use super::heuristic::line_of_sight;
use super::{Formulation, TranslationTrajectory};
use crate::dynamics::{Control, Multibody, State};
use crate::math::quaternion;
use crate::model::{Recovery, TargetState};
use nalgebra::Vector3;

/// The limits that a given start violates. With Euler the pose of node 1 is part of the start: it follows
/// from the rates at t = 0 alone, whatever the torques.
pub(crate) fn recovery<const N: usize, const NL: usize>(
    formulation: &Formulation<'_, NL>,
    translation: &TranslationTrajectory<N>,
    target: &[TargetState; N],
) -> Recovery<NL> {
    let Formulation { mission, scenario, integrator, .. } = *formulation;
    let grid = formulation.grid();
    let at_start = mission.recovery(scenario, grid.keep_out(0));
    let (Some(position), Some(target)) = (translation.position.get(1), target.get(1)) else {
        return at_start;
    };
    if integrator.is_flown() || !scenario.start.is_given() {
        return at_start;
    }
    let (start, still) = (State::at_start(mission, scenario), Vector3::zeros());
    let next =
        Multibody::new(mission).step(integrator, grid.interval(), &start, &Control::ZERO, &still);
    let boresight = quaternion::rotation_matrix(&next.attitude) * mission.servicer.boresight;
    let seen = line_of_sight(mission, position, target).dot(&boresight);
    at_start.and_pose(mission, &next.joint_angle, seen)
}
