//! The approach after Stage 1, as the learned guess sees it.

use crate::dynamics::{Integrator, Multibody, State};
use crate::math::quaternion;
use crate::model::{Mission, Scenario, TargetState};
use crate::stages::heuristic::line_of_sight;
use crate::stages::{LINKS, NODES, TranslationTrajectory};
use nalgebra::Vector3;
use remora_qp::time::Deadline;

/// An approach as the learned guess sees it: Stage 1's translation, the target's motion, and what
/// follows from them.
pub struct Scene<'a, const NL: usize = LINKS> {
    /// The mission.
    pub mission: &'a Mission<NL>,
    /// The scenario.
    pub scenario: &'a Scenario<NL>,
    /// Trajectory of the system's centre of mass.
    pub translation: &'a TranslationTrajectory<NODES>,
    /// The target at the nodes.
    pub target: &'a [TargetState; NODES],
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Deadline of a rollout; none by default.
    pub deadline: Deadline<'a>,
    /// The dynamics of bus and arm.
    pub body: Multibody<'a, NL>,
    /// Duration of an interval [s].
    pub dt: f64,
    /// The last node.
    pub last: usize,
    /// Node from which the joints have their capture angles.
    pub preset: usize,
    /// Unit vectors from the centre of mass to the docking port, RTN.
    pub(super) sight: [Vector3<f64>; NODES],
    /// Direction of the end effector at the last node, RTN.
    pub(super) approach: Vector3<f64>,
    /// The end effector's direction in bus axes at capture.
    pub(super) arm: Vector3<f64>,
}

impl<'a, const NL: usize> Scene<'a, NL> {
    /// The scene of a planned translation. Cost: a few square roots a node.
    pub fn new(
        mission: &'a Mission<NL>,
        scenario: &'a Scenario<NL>,
        translation: &'a TranslationTrajectory<NODES>,
        target: &'a [TargetState; NODES],
        integrator: Integrator,
    ) -> Self {
        let grid = mission.grid(scenario);
        let end = grid.last().min(NODES - 1);
        let last = &target[end];
        Self {
            mission,
            scenario,
            translation,
            target,
            integrator,
            deadline: Deadline::never(),
            body: Multibody::new(mission),
            dt: grid.interval(),
            last: end,
            preset: grid.preset_node(),
            sight: core::array::from_fn(|k| {
                line_of_sight(mission, &translation.position[k], &target[k])
            }),
            approach: -(quaternion::rotation_matrix(&last.attitude) * mission.target.port_normal),
            arm: mission.servicer.capture_geometry().direction,
        }
    }

    /// Initial state of every trajectory.
    pub fn initial_state(&self) -> State<NL> {
        State::at_start(self.mission, self.scenario)
    }

    /// Distance of the end effector from the docking port at the last node [m], the paper's error of a
    /// rollout.
    pub fn miss(&self, last: &State<NL>) -> f64 {
        let (Some(target), Some(position)) =
            (self.target.get(self.last), self.translation.position.get(self.last))
        else {
            return f64::NAN;
        };
        let port =
            quaternion::rotation_matrix(&target.attitude) * self.mission.target.port_position_m;
        let arm = self.body.end_effector(last).position;
        let miss = position + arm - port;
        libm::sqrt(miss.dot(&miss))
    }
}
