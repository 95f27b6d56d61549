//! Sites of injected faults.

use remora_host::choice::Choice;
use serde::{Deserialize, Serialize};

/// Site of injected faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// The model file before it is opened
    WeightsBeforeCheck,
    /// The model file between its check and its use
    WeightsAfterCheck,
    /// The network's activations between two blocks
    Activations,
    /// The network's activations within a block
    Block,
    /// Keys and values that the network remembers
    KvCache,
    /// The start of Stage 2 before it is tested
    StartBeforeCheck,
    /// The start of Stage 2 once it has been accepted
    StartAfterCheck,
    /// A subproblem on its way to the solver
    QpData,
    /// Its solution on the way back
    QpSolution,
    /// A loop's trajectory between two iterations
    LoopIterate,
    /// Its residuals
    LoopResiduals,
    /// The multipliers that it keeps
    LoopMultipliers,
    /// Its radius, weight, costs and violations
    LoopScalars,
    /// Stage 1's path before Stage 2 goes by it
    Path,
    /// Guidance's state while it flies a plan in the truth
    Guidance,
}

impl Choice for Site {
    // Case `n` of any seed hits the one at `n` modulo their number.
    const ALL: &'static [Self] = &[
        Self::WeightsBeforeCheck,
        Self::WeightsAfterCheck,
        Self::Activations,
        Self::Block,
        Self::KvCache,
        Self::StartBeforeCheck,
        Self::StartAfterCheck,
        Self::QpData,
        Self::QpSolution,
        Self::LoopIterate,
        Self::LoopResiduals,
        Self::LoopMultipliers,
        Self::LoopScalars,
        Self::Path,
        Self::Guidance,
    ];

    fn name(self) -> &'static str {
        self.name()
    }

    fn help(self) -> &'static str {
        match self {
            Self::WeightsBeforeCheck => "The model file before it is opened",
            Self::WeightsAfterCheck => "The model file between its check and its use",
            Self::Activations => "The network's activations between two blocks",
            Self::Block => "The network's activations within a block",
            Self::KvCache => "Keys and values that the network remembers",
            Self::StartBeforeCheck => "The start of Stage 2 before it is tested",
            Self::StartAfterCheck => "The start of Stage 2 once it has been accepted",
            Self::QpData => "A subproblem on its way to the solver",
            Self::QpSolution => "Its solution on the way back",
            Self::LoopIterate => "A loop's trajectory between two iterations",
            Self::LoopResiduals => "Its residuals",
            Self::LoopMultipliers => "The multipliers that it keeps",
            Self::LoopScalars => "Its radius, weight, costs and violations",
            Self::Path => "Stage 1's path before Stage 2 goes by it",
            Self::Guidance => "Guidance's state while it flies a plan in the truth",
        }
    }
}

impl Site {
    /// Number of sites.
    pub const COUNT: u64 = Self::ALL.len() as u64;

    /// The site of a case.
    pub fn of(number: u64) -> Self {
        Self::ALL[(number % Self::COUNT) as usize]
    }

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::WeightsBeforeCheck => "weights_before_check",
            Self::WeightsAfterCheck => "weights_after_check",
            Self::Activations => "activations",
            Self::Block => "block",
            Self::KvCache => "kv_cache",
            Self::StartBeforeCheck => "start_before_check",
            Self::StartAfterCheck => "start_after_check",
            Self::QpData => "qp_data",
            Self::QpSolution => "qp_solution",
            Self::LoopIterate => "loop_iterate",
            Self::LoopResiduals => "loop_residuals",
            Self::LoopMultipliers => "loop_multipliers",
            Self::LoopScalars => "loop_scalars",
            Self::Path => "path",
            Self::Guidance => "guidance",
        }
    }
}
