//! The planner's memory.

use crate::model::TargetState;
use crate::scp::{Iterates, Log, Scratch};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory,
    size::{NG, NU, NX},
};
use remora_qp::EmbeddedQp;

/// The embedded solver at the size of the planner's subproblems.
pub type EmbeddedSolver = EmbeddedQp<NODES, NX, NU, NG>;

/// All memory of a plan besides its QP solver's, owned by the caller: [`Workspace::BYTES`] bytes.
pub struct Workspace {
    /// The target's motion at the nodes.
    pub target: [TargetState; NODES],
    /// Scratch of both stages, one after the other.
    pub scratch: Scratch<NODES, NX, NU, NG>,
    /// Stage 1: trajectories and log.
    pub translation: Iterates<TranslationTrajectory<NODES>>,
    /// Stage 2: trajectories and log.
    pub reorientation: Iterates<ReorientationTrajectory<NODES, LINKS>>,
}

impl Workspace {
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
    pub fn reorientation(&self) -> &ReorientationTrajectory<NODES, LINKS> {
        &self.reorientation.trajectory
    }

    /// Logs of Stage 1 and Stage 2.
    pub fn logs(&self) -> (&Log, &Log) {
        (&self.translation.log, &self.reorientation.log)
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}
