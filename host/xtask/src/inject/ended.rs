//! Endings of plans and flights, with a fault and without.

use remora_core::advanced::planner::GuessRecord;
use remora_core::advanced::scp::Status;
use remora_flight::flight::Ending;

/// How a plan ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ended {
    pub status: Status,
    pub is_verified: bool,
    pub start: GuessRecord,
    /// Iterations of stages 1 and 2.
    pub iterations: [usize; 2],
    /// Costs of stages 1 and 2.
    pub costs: [f64; 2],
    /// Checksum of the trajectories.
    pub output: u64,
    /// Whether the judge found it to be other than claimed.
    pub is_wrong: bool,
    /// Whether iterations, programs and the solver's iterations are within their limits.
    pub is_bounded: bool,
}

impl Ended {
    /// Default values of a flight's end.
    pub const NOTHING: Self = Self {
        status: Status::Solved,
        is_verified: true,
        start: GuessRecord::Heuristic,
        iterations: [0; 2],
        costs: [0.0; 2],
        output: 0,
        is_wrong: false,
        is_bounded: true,
    };

    /// Whether bits and iterations are the same.
    pub fn is_same(&self, other: &Self) -> bool {
        self.output == other.output && self.iterations == other.iterations
    }
}

/// Outcome of a case.
pub(super) struct Ran {
    pub ended: Ended,
    /// How it ends without the fault.
    pub baseline: Ended,
    /// Whether a check refused what was hit.
    pub is_refused: bool,
    /// How a flight ended, where one was flown.
    pub ending: Option<Ending>,
}
