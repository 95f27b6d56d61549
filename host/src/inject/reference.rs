//! Plans without a fault, to which those with one are compared.

use super::worker::{Setup, Worker};
use crate::error::Error;
use remora_core::model::TargetState;
use remora_core::planner::StartRecord;
use remora_core::scp::Status;
use remora_core::stages::{LINKS, NODES, ReorientationTrajectory, TranslationTrajectory};

/// How a plan ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ended {
    pub status: Status,
    pub is_verified: bool,
    pub start: StartRecord,
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
    /// Programs of the first of these.
    pub programs: u32,
    /// Its path and the target's tumble.
    pub path: Box<TranslationTrajectory<NODES>>,
    pub target: Box<[TargetState; NODES]>,
    /// The roll-out as it came, and as it is once it has been moved into limits and onto pins.
    pub rolled: Box<ReorientationTrajectory<NODES, LINKS>>,
    pub clipped: Box<ReorientationTrajectory<NODES, LINKS>>,
    /// Time of the longest of the four [s]; on it no result depends.
    pub time_s: f64,
}

impl Reference {
    /// Plans scenario `index`.
    ///
    /// # Errors
    /// Where one of the plans is not solved: nothing could be told from a fault in it.
    pub fn new(setup: &Setup<'_>, worker: &mut Worker, index: usize) -> Result<Self, Error> {
        let reference = worker.reference(setup, index);
        let Self { learned, given, accepted, refused, .. } = &reference;
        match [learned, given, accepted, refused].iter().all(|e| e.status == Status::Solved) {
            true => Ok(reference),
            false => {
                let id = &setup.scenarios[index].id;
                let reason = format!("scenario {id} is not solved without a fault");
                Err(Error::argument("--scenarios", reason))
            }
        }
    }
}
