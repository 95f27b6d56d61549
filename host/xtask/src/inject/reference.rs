//! Plans without a fault, to which those with one are compared.

use super::draw::Work;
use super::ended::Ended;
use super::flights::Sortie;
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory};

/// A scenario planned without a fault, by each way that cases plan it.
pub(super) struct Reference {
    /// Plan from the model's rollout.
    pub learned: Ended,
    /// Plan from that rollout as a user's guess.
    pub given: Ended,
    /// Plan from that rollout, handed over once it was accepted.
    pub accepted: Ended,
    /// Plan from the heuristic, the model refused.
    pub refused: Ended,
    /// Work of the plan from the model's rollout, and of its flight.
    pub work: Work,
    /// A plan that can be flown, with its flight; none where nothing flies.
    pub sortie: Option<Sortie>,
    /// The roll-out as it came, and as it is once it has been moved into limits and onto pins.
    pub rolled: Box<ReorientationTrajectory<NODES, LINKS>>,
    pub clipped: Box<ReorientationTrajectory<NODES, LINKS>>,
    /// Time of the longest of the four [s]; on it no result depends.
    pub time_s: f64,
}

impl Reference {
    /// Whether all its plans are solved: otherwise nothing could be told from a fault in one.
    pub fn is_solved(&self) -> bool {
        let Self { learned, given, accepted, refused, .. } = self;
        [learned, given, accepted, refused].iter().all(|e| e.status == Status::Solved)
    }
}
