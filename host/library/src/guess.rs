//! What Stage 2 starts from, for an engine of any size.

use crate::learned::Learned;
use remora_core::advanced::dynamics::{Control, State};
use remora_core::advanced::planner::Nominal;
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory};
use remora_core::nalgebra::SVector;

/// What Stage 2 is to start from. What is given is dropped for the heuristic where that is better.
#[derive(Clone, Copy)]
pub enum Guess<'a, const NL: usize = LINKS> {
    /// The heuristic.
    Heuristic,
    /// The rollout of a learned model.
    Model(&'a Learned),
    /// A motion of the caller's.
    Given(&'a ReorientationTrajectory<NODES, NL>),
    /// What is left of a plan so many seconds after its first node.
    Left(&'a Nominal<NL>, f64),
}

impl<'a, const NL: usize> From<Option<&'a Learned>> for Guess<'a, NL> {
    /// The model's rollout; the heuristic where there is no model.
    fn from(model: Option<&'a Learned>) -> Self {
        model.map_or(Self::Heuristic, Self::Model)
    }
}

impl<'a, const NL: usize> Guess<'a, NL> {
    /// The model, where it is one.
    pub fn model(&self) -> Option<&'a Learned> {
        match self {
            Self::Model(model) => Some(model),
            _ => None,
        }
    }

    /// The same for an engine with room for `M` joints; a motion is kept in `kept`.
    pub(crate) fn resized<const M: usize>(self, kept: &'a mut Option<Nominal<M>>) -> Guess<'a, M> {
        match self {
            Self::Heuristic => Guess::Heuristic,
            Self::Model(model) => Guess::Model(model),
            Self::Given(motion) => {
                let motion =
                    Nominal { reorientation: resized(motion), nodes: NODES, duration: 0.0 };
                Guess::Given(&kept.insert(motion).reorientation)
            }
            Self::Left(&Nominal { ref reorientation, nodes, duration }, elapsed) => {
                let plan = Nominal { reorientation: resized(reorientation), nodes, duration };
                Guess::Left(kept.insert(plan), elapsed)
            }
        }
    }
}

/// A motion of the first `M` joints; those that it does not have stand at zero.
pub fn resized<const NL: usize, const M: usize>(
    motion: &ReorientationTrajectory<NODES, NL>,
) -> ReorientationTrajectory<NODES, M> {
    fn joints<const NL: usize, const M: usize>(from: &SVector<f64, NL>) -> SVector<f64, M> {
        SVector::from_fn(|i, _| from.as_slice().get(i).copied().unwrap_or(0.0))
    }
    let state = |x: &State<NL>| State {
        attitude: x.attitude,
        joint_angle: joints(&x.joint_angle),
        rate: x.rate,
        joint_rate: joints(&x.joint_rate),
    };
    let control = |u: &Control<NL>| Control {
        bus_torque: u.bus_torque,
        joint_torque: joints(&u.joint_torque),
    };
    ReorientationTrajectory {
        states: motion.states.each_ref().map(state),
        controls: motion.controls.each_ref().map(control),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::MAX_JOINTS;

    #[test]
    fn a_motion_keeps_its_joints() {
        let mut motion = ReorientationTrajectory::<NODES, 2>::ZERO;
        motion.states[3].joint_rate[1] = 0.5;
        motion.controls[3].joint_torque[0] = 0.25;
        let roomy: ReorientationTrajectory<NODES, MAX_JOINTS> = resized(&motion);
        assert_eq!(resized(&roomy), motion);
        assert_eq!(roomy.states[3].joint_rate.sum(), 0.5);
    }
}
