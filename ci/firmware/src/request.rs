//! What an image is asked to do: one word, which whoever starts it may leave in its memory.

use remora_core::dynamics::Integrator;

/// What to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// How many scenarios of the public set, from its first.
    pub scenarios: usize,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
}

/// Substeps of RK4 here: what fits a flight processor's time.
const SUBSTEPS: usize = 4;

impl Request {
    /// The request in a word: `0x52` (`R`) in its top byte, then zero or one for Euler or RK4 in
    /// the next, the number of scenarios in the low half. Anything else, such as what memory
    /// happens to hold, asks for one scenario with Euler.
    pub fn from_word(word: u32) -> Self {
        let (tag, integrator, scenarios) = (word >> 24, (word >> 16) & 0xff, word & 0xffff);
        match (tag, integrator) {
            (0x52, 0) => Self::new(scenarios as usize, false),
            (0x52, 1) => Self::new(scenarios as usize, true),
            _ => Self::new(1, false),
        }
    }

    /// So many scenarios with RK4 or Euler.
    pub fn new(scenarios: usize, rk4: bool) -> Self {
        let integrator =
            if rk4 { Integrator::Rk4 { substeps: SUBSTEPS } } else { Integrator::Euler };
        Self { scenarios, integrator }
    }
}
