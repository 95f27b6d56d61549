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

/// All the memory a plan needs beside its solver's. The caller owns it; [`Workspace::BYTES`] is its
/// size.
pub struct Workspace {
    /// The target's tumble at the nodes.
    pub target: [TargetState; NODES],
    /// What the stages work with, one after the other: after a plan Stage 2's.
    pub scratch: Scratch<NODES, NX, NU, NG>,
    /// Stage 1: path and log.
    pub translation: Iterates<TranslationTrajectory<NODES>>,
    /// Stage 2: attitude, arm and log.
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

    /// The path of the centre of mass last planned.
    pub fn path(&self) -> &TranslationTrajectory<NODES> {
        &self.translation.trajectory
    }

    /// Attitude and arm last planned.
    pub fn motion(&self) -> &ReorientationTrajectory<NODES, LINKS> {
        &self.reorientation.trajectory
    }

    /// The loops' logs.
    pub fn logs(&self) -> (&Log, &Log) {
        (&self.translation.log, &self.reorientation.log)
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}
