//! Sites of injected faults.

use remora_host::choice::{Choice, choices};
use serde::{Deserialize, Serialize};

choices! {
    /// Site of injected faults. Case `n` of any seed hits the one at `n` modulo their number.
    #[derive(PartialOrd, Ord, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Site {
        /// The model file before it is opened.
        WeightsBeforeCheck = "weights_before_check",
        /// The model file between its check and its use.
        WeightsAfterCheck = "weights_after_check",
        /// The network's activations between two blocks.
        Activations = "activations",
        /// The network's activations within a block.
        Block = "block",
        /// Keys and values that the network remembers.
        KvCache = "kv_cache",
        /// The start of Stage 2 before it is tested.
        StartBeforeCheck = "start_before_check",
        /// The start of Stage 2 once it has been accepted.
        StartAfterCheck = "start_after_check",
        /// A subproblem on its way to the solver.
        QpData = "qp_data",
        /// Its solution on the way back.
        QpSolution = "qp_solution",
        /// A loop's trajectory between two iterations.
        LoopIterate = "loop_iterate",
        /// Its residuals.
        LoopResiduals = "loop_residuals",
        /// The multipliers that it keeps.
        LoopMultipliers = "loop_multipliers",
        /// Its radius, weight, costs and violations.
        LoopScalars = "loop_scalars",
        /// Stage 1's path before Stage 2 goes by it.
        Path = "path",
        /// Guidance's state while it flies a plan in the truth.
        Guidance = "guidance",
    }
}

impl Site {
    /// Number of sites.
    pub const COUNT: u64 = Self::ALL.len() as u64;

    /// The site of a case.
    pub fn of(number: u64) -> Self {
        Self::ALL[(number % Self::COUNT) as usize]
    }
}
