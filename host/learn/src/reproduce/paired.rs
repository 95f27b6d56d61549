//! A model against the heuristic, scenario by scenario.

use super::Card;
use super::laboratory::{Laboratory, Run};
use super::measure::{self, Against, Measured};
use remora_host::error::Error;
use remora_host::formats::{Row, Status};
use remora_host::method::Mode;
use remora_host::report::Table;
use remora_host::statistics::{self, Estimate};
use serde::Serialize;

/// Judgement of a model by a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// Fewer iterations, and no fewer scenarios solved.
    Better,
    /// More iterations, or fewer scenarios solved.
    Worse,
    /// The interval of the change holds zero.
    Undecided,
}

/// Plans in optimal mode from the heuristic, from a model, and from what that was trained on from.
#[derive(Clone, Debug, Serialize)]
pub struct Paired {
    /// From the heuristic.
    pub heuristic: Measured,
    /// From the model that the model's training started from, where it did from one.
    pub before: Option<Measured>,
    /// From the model.
    pub model: Measured,
    /// The model against the heuristic.
    pub against: Against,
    /// Relative change of the mean cost, over the scenarios that both solved.
    pub cost: Estimate,
    /// Plans in which the model's guess was dropped for the heuristic.
    pub fallbacks: usize,
    /// Judgement that follows.
    pub judgement: Judgement,
}

impl Paired {
    /// Plans all scenarios of a laboratory from each.
    ///
    /// # Errors
    /// A failure that keeps the laboratory from planning.
    pub fn test(
        model: &Card,
        before: Option<&Card>,
        lab: &mut dyn Laboratory,
    ) -> Result<Self, Error> {
        let mode = Mode::Optimal;
        let models = [model].into_iter().chain(before).map(|card| Run::model(mode, card));
        let runs: Vec<Run> = [Run::heuristic(mode)].into_iter().chain(models).collect();
        let rows = lab.plan(&runs)?;
        let before = rows.get(2).map(|rows| Measured::of(rows));
        Ok(Self { before, ..Self::of(&rows[0], &rows[1]) })
    }

    fn of(heuristic: &[Row], model: &[Row]) -> Self {
        let is_solved = |row: &Row| row.status == Status::Solved;
        let both = heuristic.iter().zip(model).filter(|(a, b)| is_solved(a) && is_solved(b));
        let costs: Vec<_> = both.map(|(a, b)| (a.stage2.cost, b.stage2.cost)).collect();
        let against = Against::of(heuristic, model);
        let fallbacks = model.iter().filter(|row| row.warm_start == "fallback").count();
        let (heuristic, model) = (Measured::of(heuristic), Measured::of(model));
        let change = against.iterations;
        let judgement = match model.success.count >= heuristic.success.count {
            false => Judgement::Worse,
            true if change.low > 0.0 => Judgement::Worse,
            true if change.high < 0.0 => Judgement::Better,
            true => Judgement::Undecided,
        };
        let cost = statistics::relative_change(&costs);
        Self { heuristic, before: None, model, against, cost, fallbacks, judgement }
    }

    /// The numbers and what follows from them, in text.
    pub fn text(&self) -> String {
        let mut table = Table::new("start | >solved [%] | >iterations | >cost");
        let before = self.before.iter().map(|before| ("built-in model", before));
        let own = [("heuristic", &self.heuristic), ("model", &self.model)];
        for (name, of) in own.into_iter().chain(before) {
            table.row([
                name.into(),
                measure::rate(&of.success),
                measure::of(&of.iterations),
                measure::of(&of.cost),
            ]);
        }
        let Self { against, cost, fallbacks, .. } = self;
        format!(
            "{table}\nModel against heuristic, over the {} scenarios that both solved [%]: iterations {}, \
             cost {}.\nThe model's guess was dropped for the heuristic in {fallbacks} of {}.\n{}\n",
            against.pairs,
            measure::change(&against.iterations),
            measure::change(cost),
            self.model.success.of,
            self.judgement.text(),
        )
    }
}

impl Judgement {
    fn text(self) -> &'static str {
        match self {
            Self::Better => "The model is better than the heuristic.",
            Self::Worse => {
                "The model is WORSE than the heuristic: plan with --warm-start heuristic, or learn \
                 with more hours."
            }
            Self::Undecided => {
                "So many scenarios do not show whether the model or the heuristic is better."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Decoder;
    use super::super::card::tests::card;
    use super::super::laboratory::tests::Invented;
    use super::super::measure::tests::row;
    use super::*;

    fn rows(iterations: u64) -> Vec<Row> {
        (0..20).map(|i| row(i, iterations + i as u64 % 2, 0.3, 0.04)).collect()
    }

    #[test]
    fn what_it_was_trained_on_from_is_tested_too() {
        let models = [card(Decoder::Linear, 1, 2), card(Decoder::Linear, 1, 3)];
        let mut lab = Invented::default();
        let paired = Paired::test(&models[0], Some(&models[1]), &mut lab).unwrap();
        assert_eq!(lab.asked.len(), 3);
        assert_eq!(paired.judgement, Judgement::Better);
        assert!(paired.text().contains("built-in model"), "{}", paired.text());
        let alone = Paired::test(&models[0], None, &mut lab).unwrap();
        assert!(alone.before.is_none() && lab.asked.len() == 5);
    }

    #[test]
    fn a_worse_model_is_said_to_be_worse() {
        let judged = |model: &[Row]| Paired::of(&rows(10), model).judgement;
        assert_eq!(judged(&rows(6)), Judgement::Better);
        assert_eq!(judged(&rows(14)), Judgement::Worse);
        assert_eq!(judged(&rows(10)), Judgement::Undecided);
        let mut unsolved = rows(6);
        unsolved[3].status = Status::IterationLimit;
        assert_eq!(judged(&unsolved), Judgement::Worse);
        unsolved[4].warm_start = "fallback".into();
        let paired = Paired::of(&rows(10), &unsolved);
        assert_eq!((paired.against.pairs, paired.fallbacks, paired.cost.value), (19, 1, 0.0));
        let text = paired.text();
        assert!(!text.contains("built-in"), "{text}");
        for part in ["95.0 [", "over the 19 scenarios", "cost +0.0 [", "in 1 of 20", "WORSE"] {
            assert!(text.contains(part), "{part}\n{text}");
        }
    }
}
