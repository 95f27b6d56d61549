//! Plans without a fault, to which those with one are compared.

use super::draw::Work;
use super::flights::Sortie;
use remora_core::advanced::planner::GuessRecord;
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{LINKS, NODES, ReorientationTrajectory};

/// How a plan ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ended {
    pub status: Status,
    pub is_verified: bool,
    pub start: GuessRecord,
    /// Of stages 1 and 2.
    pub iterations: [usize; 2],
    /// Of stages 1 and 2.
    pub costs: [f64; 2],
    /// Checksum of the trajectories.
    pub output: u64,
    /// Whether the judge found it to be other than claimed.
    pub is_wrong: bool,
    /// Whether iterations, programs and the solver's iterations are within their limits.
    pub is_bounded: bool,
}

impl Ended {
    /// Whether bits and iterations are the same.
    pub fn is_same(&self, other: &Self) -> bool {
        self.output == other.output && self.iterations == other.iterations
    }
}

/// A scenario planned without a fault, by each way that cases plan it.
pub(super) struct Reference {
    /// From the model's roll-out.
    pub learned: Ended,
    /// From the same roll-out, handed in.
    pub given: Ended,
    /// From the same, handed over once it was accepted.
    pub accepted: Ended,
    /// From the heuristic, the model refused.
    pub refused: Ended,
    /// What the first of these takes, and its flight.
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
