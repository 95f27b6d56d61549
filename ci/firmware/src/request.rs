//! What an image is asked to do: one word, which whoever starts it may leave in its memory.

use remora_core::dynamics::Integrator;

/// What Stage 2 is to start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartKind {
    /// The heuristic.
    Heuristic,
    /// The image's model for the integrator.
    Model,
}

/// What to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The first scenario of the corpus to plan.
    pub first: usize,
    /// How many scenarios from there.
    pub scenarios: usize,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Start of Stage 2.
    pub start: StartKind,
}

/// Substeps of RK4 here: what fits a flight processor's time.
const SUBSTEPS: usize = 4;

impl Request {
    /// The request in a word: `0x52` (`R`) in its top byte; in the next, bit 0 for RK4 and bit 1
    /// for a start from the model; then the first scenario and the number of scenarios. Anything
    /// else, such as what memory happens to hold, asks for one scenario with Euler and the heuristic.
    pub fn from_word(word: u32) -> Self {
        match word.to_be_bytes() {
            [0x52, flags @ 0..4, first, scenarios] => {
                Self::new(first.into(), scenarios.into(), flags & 1 == 1, flags & 2 == 2)
            }
            _ => Self::new(0, 1, false, false),
        }
    }

    /// So many scenarios with RK4 or Euler, from the model or the heuristic.
    pub fn new(first: usize, scenarios: usize, rk4: bool, model: bool) -> Self {
        let integrator =
            if rk4 { Integrator::Rk4 { substeps: SUBSTEPS } } else { Integrator::Euler };
        let start = if model { StartKind::Model } else { StartKind::Heuristic };
        Self { first, scenarios, integrator, start }
    }
}
