//! Notes on the models of a page, and on the paper's network, which is of another kind.

use super::Card;
use remora_host::lineage::Training;

/// A row of the paper in a table.
pub(super) const PAPER_ROW: &str = "  paper†";

/// A column of the paper in a table.
pub(super) const PAPER_COLUMN: &str = "†";

/// A paragraph of what the paper's numbers are, then one a model: inputs, actions, size, trainings.
pub(super) fn notes(models: &[Card]) -> Vec<String> {
    let ours = models.iter().map(|card| {
        let lineage = &card.lineage;
        let trainings: Vec<String> = lineage.trainings.iter().map(training).collect();
        let before = lineage.before.as_deref();
        let before = before.map_or(String::new(), |name| format!(" on from {name},"));
        format!("{}: {}. Trained{before} {}.", card.name, card.about, trainings.join(", then "))
    });
    [papers_kind(models)].into_iter().chain(ours).collect()
}

fn papers_kind(models: &[Card]) -> String {
    let alike = models.iter().filter(|card| card.is_of_the_papers_kind);
    let mut alike: Vec<&str> = alike.map(|card| card.name.as_str()).collect();
    alike.sort_unstable();
    let behind = match alike.split_last() {
        None => "No trained model of that kind stands behind any row of ours.".into(),
        Some((one, [])) => format!("Of ours, {one} is of that kind."),
        Some((last, others)) => {
            format!("Of ours, {} and {last} are of that kind.", others.join(", "))
        }
    };
    format!(
        "† The paper's numbers are of another kind: its network has five tokens a node, inputs in \
         RTN and torques as actions, and its optimiser and machine are others. {behind}"
    )
}

/// `3000 steps of 32 on s1000:90000 (euler; 1.1 epochs)`.
fn training(training: &Training) -> String {
    let Training { steps, learnt_from, integrator, .. } = training;
    let batch = training.batch.map_or(String::new(), |batch| format!(" of {batch}"));
    let epochs = match training.epochs() {
        Some(epochs) => format!("{epochs:.1} epochs"),
        None => "epochs unknown".into(),
    };
    format!("{steps} steps{batch} on {learnt_from} ({integrator}; {epochs})")
}

/// Explains equal numbers of steps for sets of different sizes, where sizes are compared; nothing where each
/// scenario was seen equally often.
pub(super) fn confounded(models: &[Card]) -> Option<String> {
    let epochs =
        |card: &Card| -> Option<f64> { card.lineage.trainings.iter().map(Training::epochs).sum() };
    let mut sizes: Vec<(u64, f64)> =
        models.iter().map(|card| Some((card.size(), epochs(card)?))).collect::<Option<_>>()?;
    sizes.sort_by_key(|(size, _)| *size);
    sizes.dedup_by_key(|(size, _)| *size);
    let most = sizes.iter().map(|(_, epochs)| *epochs).fold(0.0, f64::max);
    if sizes.iter().all(|(_, epochs)| *epochs > 0.9 * most) {
        return None;
    }
    let each: Vec<String> =
        sizes.iter().map(|(size, epochs)| format!("{epochs:.1} of {size}")).collect();
    let each = each.join(", ");
    Some(format!(
        "Size and epochs are confounded: the trainings had {each} scenarios, so that a smaller set \
         was seen more often."
    ))
}

#[cfg(test)]
mod tests {
    use super::super::{Decoder, card::tests::card, read_cards};
    use super::*;
    use std::path::{Path, PathBuf};

    #[test]
    fn ancestors_are_named_with_their_epochs() {
        let mut model = card(Decoder::Linear, 1, 2_500);
        let first = Training { learnt_from: "s1000:90000".into(), ..training_of(&model) };
        model.lineage.trainings.insert(0, first);
        let text = notes(&[model.clone()]).join("\n");
        assert!(text.contains("No trained model of that kind"), "{text}");
        let trained = "Trained 3000 steps of 32 on s1000:90000 (euler; 1.1 epochs), then 3000 \
                       steps of 32 on s1000:2500 (euler; 39.2 epochs).";
        assert!(text.ends_with(trained), "{text}");
        model.lineage.before = Some("6dafa5fd old.model".into());
        model.lineage.trainings[1].batch = None;
        model.is_of_the_papers_kind = true;
        let text = notes(&[model]).join("\n");
        assert!(text.contains("Of ours, linear-1-2500 is of that kind."), "{text}");
        assert!(text.contains("Trained on from 6dafa5fd old.model, 3000 steps"), "{text}");
        assert!(text.ends_with("3000 steps on s1000:2500 (euler; epochs unknown)."), "{text}");
    }

    fn training_of(card: &Card) -> Training {
        card.lineage.trainings[0].clone()
    }

    #[test]
    fn sizes_at_equal_steps_are_said_to_be_confounded() {
        let models = [90_000, 5_000, 10_000].map(|size| card(Decoder::Flow, 1, size));
        let text = confounded(&models).unwrap();
        assert!(text.contains("19.6 of 5000, 9.8 of 10000, 1.1 of 90000 scenarios"), "{text}");
        assert_eq!(confounded(&models[..1]), None);
        // A twentieth of the steps for a twentieth of the scenarios.
        let mut few = card(Decoder::Flow, 1, 5_000);
        few.lineage.trainings[0].steps = 167;
        assert_eq!(confounded(&[models[0].clone(), few]), None);
    }

    /// The pages were measured before they named their models: these lines were added to them.
    #[test]
    fn the_pages_say_what_this_program_says_of_their_models() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let cards = |folder: &str| read_cards(&root.join(folder)).unwrap();
        let (tables, built_in) = (cards("fixtures/models/tables"), cards("fixtures/models"));
        let ingredients = cards("fixtures/models/ingredients");
        let epochs = cards("fixtures/models/epochs");
        let papers = cards("fixtures/models/papers-epochs");
        let page =
            |name: &str| -> PathBuf { root.join("docs/lab/2026-11-27-reproduction").join(name) };
        let named = |cards: &[Card], names: &[&str]| -> Vec<Card> {
            let found = cards.iter().filter(|card| names.contains(&card.name.as_str()));
            let found: Vec<Card> = found.cloned().collect();
            assert_eq!(found.len(), names.len(), "{names:?}");
            found
        };
        let largest = ["flow-h1-90k", "flow-h5-90k", "linear-h1-90k", "linear-h5-90k"];
        let single: Vec<Card> = tables.iter().filter(|card| card.chunk == 1).cloned().collect();
        let sizes = |cards: &[Card]| -> Vec<String> {
            notes(cards).into_iter().chain(confounded(cards)).collect()
        };
        let papers_steps = cards("fixtures/models/papers-steps");
        for (name, expected) in [
            ("decoders.md", notes(&named(&tables, &largest))),
            ("feasibility.md", notes(&named(&tables, &["flow-h1-90k"]))),
            ("flow-steps.md", notes(&named(&tables, &["flow-h1-90k"]))),
            ("sample-efficiency.md", sizes(&single)),
            ("ingredients.md", notes(&ingredients)),
            ("equal-epochs.md", notes(&epochs)),
            ("papers-equal-epochs.md", notes(&papers)),
            ("papers-equal-steps.md", sizes(&papers_steps)),
            ("default-euler.md", notes(&named(&built_in, &["euler"]))),
            ("default-euler-feasibility.md", notes(&named(&built_in, &["euler"]))),
            ("default-rk4.md", notes(&named(&built_in, &["rk4"]))),
            ("single-precision.md", notes(&named(&built_in, &["euler"]))),
        ] {
            let text = std::fs::read_to_string(page(name)).unwrap();
            let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
            for note in expected {
                assert!(words(&text).contains(&words(&note)), "{name} lacks: {note}");
            }
            assert!(!text.contains("| paper |"), "{name}: unmarked numbers of the paper");
        }
    }
}
