//! Measurements of one plan.

use super::order::Job;
use remora_core::advanced::planner::PhaseTimes;
use serde::{Deserialize, Serialize};

/// Scenarios that every configuration plans in every case before anything is measured.
pub const WARM_UP_PLANS: usize = 2;

/// One plan as it was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sample {
    pub job: Job,
    /// Time until plans were there, those of the other core included [s].
    pub wall_s: f64,
    /// Phase times [s]; of the case that counts, instructions.
    #[serde(with = "Times")]
    pub times: PhaseTimes,
    /// Linearisations of Stage 2, one by one [s].
    pub linearise_s: Vec<f64>,
    /// Subproblems of its iterations, one by one, corrections included [s].
    pub qp_s: Vec<f64>,
    pub iterations: u64,
    pub is_solved: bool,
    /// Involuntary context switches of the first core's thread.
    pub switches: u64,
}

/// [`PhaseTimes`] in a journal.
#[derive(Serialize, Deserialize)]
#[serde(remote = "PhaseTimes", deny_unknown_fields)]
struct Times {
    start_s: f64,
    inference_s: f64,
    translation_s: f64,
    linearise_s: f64,
    qp_s: f64,
    step_s: f64,
    verify_s: f64,
    total_s: f64,
}
