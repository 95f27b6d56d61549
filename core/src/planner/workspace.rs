//! The planner's memory.

use crate::model::TargetState;
use crate::scp::{Iterates, Log, Scratch};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory,
    size::{NG, NU, NX},
};
use remora_qp::EmbeddedQp;

/// The embedded solver at the size of the planner's subproblems.
pub type EmbeddedSolver = ArmSolver<NX, NU>;

/// The embedded solver for an arm with `NX` states and `NU` controls.
pub type ArmSolver<const NX: usize, const NU: usize> = EmbeddedQp<NODES, NX, NU, NG>;

/// [`ArmWorkspace`] of the mission's arm.
pub type Workspace = ArmWorkspace<LINKS, NX, NU>;

/// All memory of a plan besides its QP solver's, owned by the caller, for an arm of `NL` joints:
/// [`ArmWorkspace::BYTES`] bytes.
pub struct ArmWorkspace<const NL: usize, const NX: usize, const NU: usize> {
    /// The target's motion at the nodes.
    pub target: [TargetState; NODES],
    /// Scratch of both stages, one after the other.
    pub scratch: Scratch<NODES, NX, NU, NG>,
    /// Stage 1: trajectories and log.
    pub translation: Iterates<TranslationTrajectory<NODES>>,
    /// Stage 2: trajectories and log.
    pub reorientation: Iterates<ReorientationTrajectory<NODES, NL>>,
}

impl<const NL: usize, const NX: usize, const NU: usize> ArmWorkspace<NL, NX, NU> {
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Storage for any number of plans, one after the other. Place it in static memory or on a
    /// heap: it is too large for a small stack. All bits are zero, so that static memory costs no
    /// room in an image.
    pub const fn new() -> Self {
        Self {
            target: [TargetState::BLANK; NODES],
            scratch: Scratch::new(),
            translation: Iterates::new(TranslationTrajectory::ZERO),
            reorientation: Iterates::new(ReorientationTrajectory::BLANK),
        }
    }

    /// Trajectory of the centre of mass, as last planned.
    pub fn translation(&self) -> &TranslationTrajectory<NODES> {
        &self.translation.trajectory
    }

    /// Trajectory of attitude and arm, as last planned.
    pub fn reorientation(&self) -> &ReorientationTrajectory<NODES, NL> {
        &self.reorientation.trajectory
    }

    /// Logs of Stage 1 and Stage 2.
    pub fn logs(&self) -> (&Log, &Log) {
        (&self.translation.log, &self.reorientation.log)
    }
}

impl<const NL: usize, const NX: usize, const NU: usize> Default for ArmWorkspace<NL, NX, NU> {
    fn default() -> Self {
        Self::new()
    }
}
