//! Plans that images are asked for.

use crate::audit::emulation::{IntegratorName, StartName};
use remora_host::choice::choices;

/// Scenarios in the audit's set.
const SCENARIOS: u16 = 12;

choices! {
    /// Extent of the images' plans.
    #[derive(Default)]
    pub enum Extent {
        /// One scenario with Euler, from both starts.
        One = "one" default,
        /// Cases that the audit reports: both integrators and starts, hard scenarios.
        Corpus = "corpus",
        /// Corpus with all scenarios of the audit's set, some three times as long.
        Full = "full",
    }
}

impl Extent {
    /// Plans that each image is asked for.
    pub fn plans(self) -> Vec<Plans> {
        let starts = [StartName::Heuristic, StartName::Model];
        match self {
            Self::One => starts.map(|start| Plans::first(IntegratorName::Euler, start, 1)).into(),
            Self::Corpus => Plans::corpus(),
            Self::Full => Plans::full_corpus(),
        }
    }
}

/// Plans of one run of an image: one integrator, one start, some scenarios of the audit's set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plans {
    /// Discretisation of Stage 2.
    pub integrator: IntegratorName,
    /// Start of Stage 2.
    pub start: StartName,
    /// A bit for each scenario, the lowest for the first.
    pub scenarios: u16,
}

impl Plans {
    /// The first `count` scenarios.
    fn first(integrator: IntegratorName, start: StartName, count: u16) -> Self {
        Self { integrator, start, scenarios: ((1_u32 << count.min(SCENARIOS)) - 1) as u16 }
    }

    /// Plans that the audit reports: a typical scenario or two, and those that are hardest with this
    /// integrator and start. With RK4, where one of these takes an emulator half a minute, the
    /// hardest.
    fn corpus() -> Vec<Self> {
        use IntegratorName::{Euler, Rk4};
        use StartName::{Heuristic, Model};
        let of = |integrator, start, indices: &[u16]| Self {
            integrator,
            start,
            scenarios: indices.iter().fold(0, |bits, index| bits | 1 << index),
        };
        vec![
            of(Euler, Heuristic, &[0, 1, 4, 5]),
            of(Euler, Model, &[0, 1, 6, 7]),
            of(Rk4, Heuristic, &[0, 8]),
            of(Rk4, Model, &[0, 1, 10]),
        ]
    }

    /// Plans of all scenarios of the set, which take some three times as long.
    fn full_corpus() -> Vec<Self> {
        let all = |plans| Self { scenarios: (1 << SCENARIOS) - 1, ..plans };
        Self::corpus().into_iter().map(all).collect()
    }

    /// The word that asks an image for them: see `ci/firmware/src/request.rs`.
    pub fn word(&self) -> u32 {
        let rk4 = u8::from(self.integrator == IntegratorName::Rk4);
        let model = u8::from(self.start == StartName::Model);
        let [high, low] = self.scenarios.to_be_bytes();
        u32::from_be_bytes([b'R', rk4 | model << 1, high, low])
    }

    /// The arguments that ask the host's program for them.
    pub fn arguments(&self) -> [String; 3] {
        [self.integrator.name().into(), self.start.name().into(), self.scenarios.to_string()]
    }

    /// Name of their log.
    pub fn log(&self, target: &str) -> String {
        format!("{target}.{}.{}.log", self.start.name(), self.integrator.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_the_word_that_images_understand() {
        let plans = Plans::corpus();
        assert_eq!(plans[0].word(), 0x5200_0033);
        assert_eq!(plans[3].word(), 0x5203_0403);
        assert_eq!(plans[3].arguments(), ["rk4", "model", "1027"]);
        assert_eq!(plans[3].log("host"), "host.model.rk4.log");
        let one = Plans::first(IntegratorName::Rk4, StartName::Heuristic, 1);
        assert_eq!(one.word(), 0x5201_0001);
        let all = Plans::first(IntegratorName::Euler, StartName::Model, SCENARIOS);
        assert_eq!((all.word(), Plans::full_corpus()[1]), (0x5202_0fff, all));
    }
}
