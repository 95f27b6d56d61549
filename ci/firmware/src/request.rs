//! Request to an image: one word that its starter may leave in its memory.

use remora_core::advanced::dynamics::Integrator;

/// Requested initial guess of Stage 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartKind {
    /// The heuristic.
    Heuristic,
    /// The image's model for the integrator.
    Model,
}

/// Request for plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Scenarios of the corpus: bit 0 is its first.
    pub scenarios: u16,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Start of Stage 2.
    pub start: StartKind,
    /// Whether what plans are made from is held against checksums, and the verifier run twice.
    pub is_scrubbed: bool,
}

/// Substeps of RK4: this many fit a flight processor's time.
const SUBSTEPS: usize = 4;

impl Request {
    /// The request in a word: `0x52` (`R`) in its top byte; in the next, bit 0 for RK4, bit 1 for a
    /// start from the model and bit 2 for scrubbing; in the low half, a bit for each scenario to plan.
    /// Anything else, such as what memory happens to hold, asks for the first scenario with Euler and
    /// the heuristic.
    pub fn from_word(word: u32) -> Self {
        match word.to_be_bytes() {
            [0x52, flags @ 0..8, high, low] => Self {
                is_scrubbed: flags & 4 == 4,
                ..Self::new(u16::from_be_bytes([high, low]), flags & 1 == 1, flags & 2 == 2)
            },
            _ => Self::new(1, false, false),
        }
    }

    /// These scenarios with RK4 or Euler, from the model or the heuristic, without scrubbing.
    pub fn new(scenarios: u16, rk4: bool, model: bool) -> Self {
        let integrator =
            if rk4 { Integrator::Rk4 { substeps: SUBSTEPS } } else { Integrator::Euler };
        let start = if model { StartKind::Model } else { StartKind::Heuristic };
        Self { scenarios, integrator, start, is_scrubbed: false }
    }

    /// Whether the corpus's scenario of this index is to be planned.
    pub fn wants(&self, index: usize) -> bool {
        index < u16::BITS as usize && self.scenarios >> index & 1 == 1
    }
}
