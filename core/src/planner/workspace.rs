//! The planner's memory.

use crate::model::TargetState;
use crate::scp::{self, Log};
use crate::stages::{
    LINKS, NODES, ReorientationTrajectory, TranslationTrajectory, reorientation_size as two,
    translation_size as one,
};

/// All the memory a plan needs beside its solvers'. The caller owns it; [`Workspace::BYTES`] is its
/// size.
pub struct Workspace {
    /// The target's tumble at the nodes.
    pub target: [TargetState; NODES],
    /// Stage 1: path and log.
    pub translation:
        scp::Workspace<TranslationTrajectory<NODES>, NODES, { one::NX }, { one::NU }, { one::NR }>,
    /// Stage 2: attitude, arm and log.
    pub reorientation: scp::Workspace<
        ReorientationTrajectory<NODES, LINKS>,
        NODES,
        { two::NX },
        { two::NU },
        { two::NR },
    >,
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
            translation: scp::Workspace::new(TranslationTrajectory::ZERO),
            reorientation: scp::Workspace::new(ReorientationTrajectory::BLANK),
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
