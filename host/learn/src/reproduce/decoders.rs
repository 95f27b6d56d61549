//! Table III: decoders and chunk lengths.

use super::findings::Findings;
use super::laboratory::{Laboratory, Run};
use super::measure::{self, Against, Measured};
use super::published::{self, DECODERS};
use super::{Card, card, models};
use remora_host::error::Error;
use remora_host::method::Mode;
use remora_host::report::Table;
use remora_host::report::plot::{Lines, Series};
use serde::Serialize;

/// A row: the heuristic, or a model.
#[derive(Serialize)]
struct Line<'a> {
    model: Option<&'a Card>,
    measured: Measured,
    against_heuristic: Option<Against>,
    published: Option<published::Decoders>,
}

impl Line<'_> {
    fn name(&self) -> String {
        self.model.map_or("heuristic".into(), |card| card.name.clone())
    }
}

const HOW_TO_READ: &str = "Each row of ours is followed by the paper's. Mean ± standard deviation \
                           over what was solved; in brackets the 95 % interval. Times include \
                           inference.";

/// Compares the models that were trained on most.
pub(super) fn reproduce(models: &[Card], lab: &mut dyn Laboratory) -> Result<Findings, Error> {
    let mut models = card::largest(models.iter().cloned());
    if models.is_empty() {
        return Err(super::no_model("the integrator"));
    }
    models.sort_by_key(|card| (card.decoder, card.chunk));
    let mut runs = vec![Run::heuristic(Mode::Optimal)];
    runs.extend(models.iter().map(|card| Run::model(Mode::Optimal, card)));
    let rows = lab.plan(&runs)?;

    let all = [None].into_iter().chain(models.iter().map(Some));
    let lines: Vec<Line<'_>> = all
        .zip(&rows)
        .map(|(model, of)| Line {
            model,
            measured: Measured::of(of),
            against_heuristic: model.map(|_| Against::of(&rows[0], of)),
            published: DECODERS
                .into_iter()
                .find(|row| row.decoder == model.map(|card| (card.decoder, card.chunk))),
        })
        .collect();
    Ok(Findings {
        title: "Decoders and chunk lengths (Table III)",
        notes: [vec![HOW_TO_READ.into()], models::notes(&models)].concat(),
        tables: vec![("Each start".into(), table(&lines)), (COMPARISON.into(), comparison(&lines))],
        plots: vec![
            ("decoders-iterations", plot(&lines, "iterations", |of| of.iterations.mean).svg()?),
            ("decoders-time", plot(&lines, "time of Stage 2 [s]", |of| of.time_s.mean).svg()?),
        ],
        numbers: super::to_value(&lines)?,
    })
}

fn table(lines: &[Line<'_>]) -> Table {
    let mut table =
        Table::new("start | >H | >success [%] | >cost | >iterations | >time | >inference");
    for line in lines {
        let Measured { success, iterations, time_s, inference_s, cost, .. } = &line.measured;
        let chunk = line.model.map_or(measure::NONE.into(), |card| card.chunk.to_string());
        table.row([
            line.name(),
            chunk.clone(),
            measure::rate(success),
            measure::of(cost),
            measure::of(iterations),
            measure::of_time(time_s),
            measure::of_time(inference_s),
        ]);
        if let Some(row) = line.published {
            table.row([
                models::PAPER_ROW.into(),
                chunk,
                measure::percent(row.success),
                measure::published(row.cost),
                measure::published(row.iterations),
                measure::published_time(row.time_s),
                row.inference_s.map_or(measure::NONE.into(), measure::published_time),
            ]);
        }
    }
    table
}

/// Change of one of the paper's means from its heuristic's, in per cent.
fn published_change(
    row: Option<published::Decoders>,
    of: fn(&published::Decoders) -> published::Spread,
) -> String {
    row.map_or(measure::NONE.into(), |row| {
        format!("{:+.1}", 100.0 * (of(&row).mean / of(&DECODERS[0]).mean - 1.0))
    })
}

const COMPARISON: &str = "Against the heuristic, scenario by scenario: changes of the means, mean \
                          and median of the differences of cost";

fn comparison(lines: &[Line<'_>]) -> Table {
    let paper = models::PAPER_COLUMN;
    let head = format!(
        "model | >iterations [%] | >{paper} | >time [%] | >{paper} | >cost [1e-3] | >median"
    );
    let mut table = Table::new(head.as_str());
    for line in lines {
        let Some(against) = &line.against_heuristic else { continue };
        table.row([
            line.name(),
            measure::change(&against.iterations),
            published_change(line.published, |row| row.iterations),
            measure::change(&against.time),
            published_change(line.published, |row| row.time_s),
            measure::difference(&against.cost),
            format!("{:+.2}", 1e3 * against.cost_median.value),
        ]);
    }
    table
}

fn plot(
    lines: &[Line<'_>],
    what: &str,
    of: fn(&Measured) -> remora_host::statistics::Estimate,
) -> Lines {
    let points = lines[1..].iter().enumerate().map(|(x, line)| (x, of(&line.measured)));
    Lines {
        title: format!("Decoders: {what}"),
        x_label: "model".into(),
        y_label: format!("{what} (mean, 95 %)"),
        x: lines[1..].iter().map(Line::name).collect(),
        series: vec![Series { name: "learned start".into(), points: points.collect() }],
        reference: Some(("heuristic".into(), of(&lines[0].measured))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Decoder;
    use super::super::card::tests::card;
    use super::super::laboratory::tests::Invented;
    use super::*;

    #[test]
    fn each_model_stands_beside_its_published_row() {
        let models = [
            card(Decoder::Flow, 5, 90_000),
            card(Decoder::Linear, 1, 90_000),
            card(Decoder::Flow, 1, 90_000),
            card(Decoder::Flow, 1, 5_000),
        ];
        let mut lab = Invented::default();
        let findings = reproduce(&models, &mut lab).unwrap();
        assert_eq!(lab.asked[0], "optimal-heuristic");
        assert_eq!(lab.asked.len(), 4);
        let text = findings.text();
        let names: Vec<&str> =
            text.lines().filter_map(|line| line.split_whitespace().next()).collect();
        let at = |name| names.iter().position(|other| *other == name).unwrap();
        assert!(at("linear-1-90k") < at("flow-1-90k") && at("flow-1-90k") < at("flow-5-90k"));
        for published in ["18.5 ± 8.4", "14.6 ± 5.9", "13.4 ± 6.0", "15.3 ± 6.2", "-27.6"] {
            assert!(text.contains(published), "{published}\n{text}");
        }
        assert!(!text.contains("17.7 ± 7.2"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        let markdown = findings.markdown();
        assert!(markdown.contains("| linear-1-90k | 1 | 100 [83.9, 100] |"), "{markdown}");
        assert!(markdown.contains("![decoders-time](decoders-time.svg)"), "{markdown}");
        let error = reproduce(&[], &mut lab).err().unwrap().to_string();
        assert_eq!(error, "--models: no model there has the integrator");
    }
}
