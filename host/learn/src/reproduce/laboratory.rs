//! Source of the numbers: plans and rollouts, made once and kept.

use super::Card;
use remora_host::error::Error;
use remora_host::formats::Row;
use remora_host::method::Mode;

/// Initial guess of Stage 2.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// The heuristic.
    Heuristic,
    /// A model's rollout, with so many steps of its flow where they are not the file's.
    Model(Box<Card>, Option<u16>),
}

/// All scenarios planned in one way.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Mode of Stage 2.
    pub mode: Mode,
    /// Initial guess of Stage 2.
    pub start: Start,
}

impl Run {
    /// From the heuristic.
    pub fn heuristic(mode: Mode) -> Self {
        Self { mode, start: Start::Heuristic }
    }

    /// From a model as its file is.
    pub fn model(mode: Mode, card: &Card) -> Self {
        Self { mode, start: Start::Model(Box::new(card.clone()), None) }
    }

    /// From a model with so many steps of its flow.
    pub fn flow(mode: Mode, card: &Card, steps: u16) -> Self {
        Self { mode, start: Start::Model(Box::new(card.clone()), Some(steps)) }
    }

    /// Name of its folder: equal for equal runs, different for others.
    pub fn key(&self) -> String {
        let start = match &self.start {
            Start::Heuristic => "heuristic".into(),
            Start::Model(card, None) => format!("{}-{}", card.name, card.checksum),
            Start::Model(card, Some(n)) => format!("{}-{}-flow{n}", card.name, card.checksum),
        };
        format!("{}-{start}", self.mode.name())
    }
}

/// Maker of plans: the bench plans and remembers, tests invent.
pub trait Laboratory {
    /// The rows of each run, all of the same scenarios in the same order.
    ///
    /// # Errors
    /// A failure that keeps a run from being made.
    fn plan(&mut self, runs: &[Run]) -> Result<Vec<Vec<Row>>, Error>;

    /// How far the end effector is from the port at the end of each rollout that a run starts
    /// from [m]; those that are of no use are left out.
    ///
    /// # Errors
    /// A failure that keeps a rollout from being made.
    fn misses(&mut self, runs: &[Run]) -> Result<Vec<Vec<f64>>, Error>;
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::Decoder;
    use super::super::card::tests::card;
    use super::super::measure::tests::row;
    use super::*;

    /// Rows that depend on the run in a way that a test can foresee: the heuristic takes 10 or 12
    /// iterations of 4 ms, a model three fewer, and one more with each step beyond the first.
    #[derive(Default)]
    pub(crate) struct Invented {
        pub asked: Vec<String>,
    }

    impl Laboratory for Invented {
        fn plan(&mut self, runs: &[Run]) -> Result<Vec<Vec<Row>>, Error> {
            self.asked.extend(runs.iter().map(Run::key));
            let fewer = |run: &Run| match &run.start {
                Start::Heuristic => 0,
                Start::Model(_, steps) => 4 - u64::from(steps.unwrap_or(1)).min(4),
            };
            let cost = |run: &Run, i: usize| match (run.mode, &run.start) {
                (Mode::Feasible, Start::Heuristic) if i == 7 => 11.0,
                _ => 0.3 + 0.01 * i as f64,
            };
            let rows = |run: &Run| {
                let of = |i: usize| {
                    let iterations = 10 + 2 * (i as u64 % 2) - fewer(run);
                    row(i, iterations, cost(run, i), 0.004 * iterations as f64)
                };
                (0..20).map(of).collect()
            };
            Ok(runs.iter().map(rows).collect())
        }

        fn misses(&mut self, runs: &[Run]) -> Result<Vec<Vec<f64>>, Error> {
            Ok(runs.iter().map(|_| (0..20).map(|i| 0.01 * i as f64).collect()).collect())
        }
    }

    #[test]
    fn runs_do_not_share_folders() {
        let (a, b) = (card(Decoder::Flow, 1, 5_000), card(Decoder::Flow, 1, 90_000));
        let mode = Mode::Optimal;
        let runs = [
            Run::heuristic(mode),
            Run::heuristic(Mode::Feasible),
            Run::model(mode, &a),
            Run::model(mode, &b),
            Run::flow(mode, &a, 1),
            Run::flow(mode, &a, 10),
        ];
        let keys: std::collections::BTreeSet<_> = runs.iter().map(Run::key).collect();
        assert_eq!(keys.len(), runs.len(), "{keys:?}");
        assert!(keys.contains("optimal-heuristic"));
    }
}
