//! The paper's tables for our models, beside the published numbers.
//!
//! A table asks a [`Laboratory`] for the plans of a few [`Run`]s, all of the same scenarios, and
//! makes [`Findings`] of them. The [`Bench`] makes these plans as campaigns in a folder each, run
//! together so that all are measured under the same load; what was planned once is not planned
//! again by another table or another call.
//!
//! ```text
//! OUT/runs/BUILD/KEY/     a campaign: program, mission and scenarios in BUILD, the start in KEY
//! OUT/TABLE.md, .json, .svg
//! ```

mod bench;
mod card;
mod decoders;
mod feasibility;
mod findings;
mod flow_steps;
mod laboratory;
mod measure;
mod models;
mod paired;
pub mod published;
mod sample_efficiency;

pub use bench::Bench;
pub use card::{Card, Decoder, read_cards};
pub use findings::Findings;
pub use laboratory::{Laboratory, Run, Start};
pub use measure::{Against, Measured};
pub use paired::{Judgement, Paired};

use remora_host::choice::choices;
use remora_host::error::Error;
use remora_host::formats::NamedScenario;
use remora_host::method::Integrator;
use serde::Serialize;
use serde_json::Value;

choices! {
    /// A table or figure of the paper.
    pub enum Table {
        /// Table II: steps of the flow.
        FlowSteps = "flow-steps",
        /// Table III: decoders and chunk lengths.
        Decoders = "decoders",
        /// The figure of decoders over the size of the training set.
        SampleEfficiency = "sample-efficiency",
        /// Table IV: feasibility and optimality.
        Feasibility = "feasibility",
    }
}

impl Table {
    /// Makes it of the models that there are for the integrator.
    ///
    /// # Errors
    /// No model that the table could show; whatever keeps the laboratory from planning.
    pub fn reproduce(self, models: &[Card], lab: &mut dyn Laboratory) -> Result<Findings, Error> {
        match self {
            Self::FlowSteps => flow_steps::reproduce(models, lab),
            Self::Decoders => decoders::reproduce(models, lab),
            Self::SampleEfficiency => sample_efficiency::reproduce(models, lab),
            Self::Feasibility => feasibility::reproduce(models, lab),
        }
    }
}

/// The models for an integrator; those of RK4 are for any number of substeps. One that was trained
/// on a scenario of the evaluation, itself or an ancestor, is refused.
///
/// # Errors
/// The model and the scenario.
pub fn fit_for_evaluation(
    models: Vec<Card>,
    integrator: Integrator,
    scenarios: &[NamedScenario],
) -> Result<Vec<Card>, Error> {
    let fits = |card: &Card| {
        let learnt = card.integrator.parse::<Integrator>();
        learnt
            .is_ok_and(|learnt| (learnt == Integrator::Euler) == (integrator == Integrator::Euler))
    };
    let models: Vec<Card> = models.into_iter().filter(fits).collect();
    for card in &models {
        if let Some(id) = card.lineage.learnt(scenarios) {
            let reason = format!(
                "was trained on {id}, itself or an ancestor: choose scenarios of another seed"
            );
            return Err(Error::input(&card.file, "", reason));
        }
    }
    Ok(models)
}

fn no_model(with: &str) -> Error {
    Error::argument("--models", format!("no model there has {with}"))
}

fn to_value(numbers: &impl Serialize) -> Result<Value, Error> {
    let failed = |error: serde_json::Error| Error::argument("reproduce", error.to_string());
    serde_json::to_value(numbers).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::choice::Choice;
    use remora_host::formats::{Mission, ScenarioSet};
    use remora_host::lineage::Source;

    #[test]
    fn a_model_is_not_judged_on_what_it_was_trained_on() {
        let set = |seed| remora_host::draw::draw(3, seed, &Mission::default()).unwrap();
        let euler = Integrator::Euler;
        let fit = |integrator, set: ScenarioSet| {
            let models = vec![card::tests::card(Decoder::Flow, 1, 2)];
            fit_for_evaluation(models, integrator, &set.scenarios)
        };
        assert_eq!(fit(euler, set(7)).unwrap().len(), 1);
        assert_eq!(fit(Integrator::RK4, set(7)).unwrap().len(), 0);
        // One that learnt plans of other substeps is compared, and must not have seen any either.
        let substeps: Integrator = "rk4:4".parse().unwrap();
        let mut rk4 = card::tests::card(Decoder::Linear, 1, 2);
        rk4.integrator = "rk4".into();
        rk4.lineage.sources.push(Source { seed: 2000, count: 5 });
        let fit_rk4 = |seed| fit_for_evaluation(vec![rk4.clone()], substeps, &set(seed).scenarios);
        assert_eq!(fit_rk4(7).unwrap().len(), 1);
        // Nor may what it started from.
        for (seed, reason) in
            [(1000, "was trained on s1000-000"), (2000, "was trained on s2000-000")]
        {
            assert!(fit_rk4(seed).unwrap_err().to_string().contains(reason));
        }
        let error = fit(euler, set(1000)).unwrap_err().to_string();
        assert!(error.contains("was trained on s1000-000"), "{error}");
        // Beyond what it was trained on, the seed is as good as another.
        let mut beyond = set(1000);
        beyond.scenarios.drain(..2);
        assert_eq!(fit(euler, beyond).unwrap().len(), 1);
    }

    #[test]
    fn findings_are_written_as_pages_numbers_and_plots() {
        let models = [card::tests::card(Decoder::Flow, 1, 90_000)];
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("a/b");
        for table in Table::ALL {
            let mut lab = laboratory::tests::Invented::default();
            let findings = table.reproduce(&models, &mut lab).unwrap();
            let files = findings.write(&out, table.name()).unwrap();
            assert!(files.len() >= 3 && files.iter().all(|file| file.is_file()), "{files:?}");
            let numbers = std::fs::read_to_string(&files[1]).unwrap();
            let numbers: Value = serde_json::from_str(&numbers).unwrap();
            assert_eq!(numbers["format"], "remora-reproduction/1");
        }
    }
}
