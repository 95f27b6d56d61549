//! Table II: steps of the flow.

use super::findings::Findings;
use super::laboratory::{Laboratory, Run};
use super::measure::{self, Against, Measured};
use super::published::{self, FLOW_STEPS};
use super::{Card, Decoder, card, models};
use remora_host::error::Error;
use remora_host::method::Mode;
use remora_host::report::plot::{Lines, Series};
use remora_host::report::{Table, number};
use remora_host::statistics::Mean;
use serde::Serialize;

/// A row: one model with so many steps.
#[derive(Serialize)]
struct Line<'a> {
    model: &'a Card,
    steps: u16,
    measured: Measured,
    /// End effector from the port at the end of the rollout [m].
    ee_error_m: Mean,
    against_heuristic: Against,
    published: published::FlowSteps,
}

const HOW_TO_READ: &str = "Each row of ours is followed by the paper's. Mean ± standard deviation \
                           over what was solved; in brackets the 95 % interval.";

/// Sweeps the steps of the flow models with H = 1 that were trained on most.
pub(super) fn reproduce(models: &[Card], lab: &mut dyn Laboratory) -> Result<Findings, Error> {
    let flow = models.iter().filter(|card| card.decoder == Decoder::Flow && card.chunk == 1);
    let models = card::largest(flow.cloned());
    if models.is_empty() {
        return Err(super::no_model("a flow decoder and H = 1"));
    }
    let mut runs = vec![Run::heuristic(Mode::Optimal)];
    let sweep = |card| FLOW_STEPS.map(|row| Run::flow(Mode::Optimal, card, row.steps));
    runs.extend(models.iter().flat_map(sweep));
    let rows = lab.plan(&runs)?;
    let misses = lab.misses(&runs[1..])?;

    let asked = models.iter().flat_map(|model| FLOW_STEPS.map(|row| (model, row)));
    let lines: Vec<Line<'_>> = asked
        .zip(rows[1..].iter().zip(&misses))
        .map(|((model, published), (of, misses))| Line {
            model,
            steps: published.steps,
            measured: Measured::of(of),
            ee_error_m: Mean::of(misses),
            against_heuristic: Against::of(&rows[0], of),
            published,
        })
        .collect();
    let heuristic = Measured::of(&rows[0]);
    Ok(Findings {
        title: "Steps of the flow (Table II)",
        notes: [vec![HOW_TO_READ.into()], models::notes(&models)].concat(),
        tables: vec![("Roll-out and plan".into(), table(&lines, &heuristic))],
        plots: vec![
            ("flow-steps", plot(&lines, &models, &heuristic).svg()?),
            ("flow-steps-error", error_plot(&lines, &models).svg()?),
        ],
        numbers: super::to_value(&(&heuristic, &lines))?,
    })
}

fn table(lines: &[Line<'_>], heuristic: &Measured) -> Table {
    let mut table = Table::new(
        "model | >n | >inference | >EE error [m] | >iterations | >change [%] | >success [%]",
    );
    let none = || measure::NONE.to_string();
    table.row([
        "heuristic".into(),
        none(),
        none(),
        none(),
        measure::of(&heuristic.iterations),
        none(),
        measure::rate(&heuristic.success),
    ]);
    for Line { model, steps, measured, ee_error_m, against_heuristic, published } in lines {
        table.row([
            model.name.clone(),
            steps.to_string(),
            measure::of_time(&measured.inference_s),
            measure::of(ee_error_m),
            measure::of(&measured.iterations),
            measure::change(&against_heuristic.iterations),
            measure::rate(&measured.success),
        ]);
        table.row([
            models::PAPER_ROW.into(),
            published.steps.to_string(),
            measure::published_time(published.inference_s),
            measure::published(published.ee_error_m),
            measure::published(published.iterations),
            none(),
            measure::percent(published.success),
        ]);
    }
    table
}

/// A line a model.
fn series(lines: &[Line<'_>], models: &[Card], of: fn(&Line<'_>) -> Mean) -> Vec<Series> {
    let points = |model: &Card| {
        let own = lines.iter().filter(|line| line.model == model);
        own.enumerate().map(|(x, line)| (x, of(line).mean)).collect()
    };
    models.iter().map(|model| Series { name: model.name.clone(), points: points(model) }).collect()
}

fn steps() -> Vec<String> {
    FLOW_STEPS.iter().map(|row| row.steps.to_string()).collect()
}

fn plot(lines: &[Line<'_>], models: &[Card], heuristic: &Measured) -> Lines {
    Lines {
        title: "Iterations over steps of the flow".into(),
        x_label: "steps of the flow".into(),
        y_label: "iterations of Stage 2 (mean, 95 %)".into(),
        x: steps(),
        series: series(lines, models, |line| line.measured.iterations),
        reference: Some(("heuristic".into(), heuristic.iterations.mean)),
    }
}

fn error_plot(lines: &[Line<'_>], models: &[Card]) -> Lines {
    let published = FLOW_STEPS.map(|row| number(row.ee_error_m.mean)).join(", ");
    Lines {
        title: format!("End effector after the roll-out (paper: {published} m)"),
        x_label: "steps of the flow".into(),
        y_label: "distance from the port [m] (mean, 95 %)".into(),
        x: steps(),
        series: series(lines, models, |line| line.ee_error_m),
        reference: None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::card::tests::card;
    use super::super::laboratory::tests::Invented;
    use super::*;

    #[test]
    fn the_largest_flow_models_are_swept() {
        let models = [
            card(Decoder::Flow, 1, 5_000),
            card(Decoder::Flow, 1, 90_000),
            card(Decoder::Flow, 5, 90_000),
            card(Decoder::Linear, 1, 90_000),
        ];
        let mut lab = Invented::default();
        let findings = reproduce(&models, &mut lab).unwrap();
        assert_eq!(lab.asked.len(), 6);
        assert!(lab.asked[1..].iter().all(|key| key.starts_with("optimal-flow-1-90k-")));
        let text = findings.text();
        // Iterations 7 and 9 with one step, 10 and 12 with four or more.
        assert!(text.contains("8.00 ± 1.03"), "{text}");
        assert!(text.contains("-27.3 ["), "{text}");
        assert!(text.contains("13.4 ± 6.0"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        assert_eq!(findings.numbers[1][0]["steps"], 1);
        let error = reproduce(&models[2..], &mut lab).err().unwrap().to_string();
        assert_eq!(error, "--models: no model there has a flow decoder and H = 1");
    }
}
