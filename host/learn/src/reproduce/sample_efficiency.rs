//! The sample efficiency figure: decoders over the size of the training set.

use super::findings::Findings;
use super::laboratory::{Laboratory, Run};
use super::measure::{self, Against, Measured};
use super::published::{DECODERS, SAMPLE_FLOW_ITERATIONS, SAMPLE_SIZES, Spread};
use super::{Card, Decoder, card, models};
use remora_host::error::Error;
use remora_host::method::Mode;
use remora_host::report::plot::{Lines, Series};
use remora_host::report::{Table, number};
use remora_host::statistics::Estimate;
use serde::Serialize;
use std::collections::BTreeSet;

/// A point of the figure.
#[derive(Serialize)]
struct Point<'a> {
    model: &'a Card,
    size: u64,
    measured: Measured,
    against_heuristic: Against,
}

const HOW_TO_READ: &str = "Mean ± standard deviation over what was solved; in brackets the 95 % \
                           interval. Of the figure the paper's text gives only that flow matching \
                           stays at approximately 13 iterations; its values at 90k are those of \
                           Table III.";

/// Compares the models with H = 1 over the sizes of their training sets.
pub(super) fn reproduce(models: &[Card], lab: &mut dyn Laboratory) -> Result<Findings, Error> {
    let mut models: Vec<Card> = models.iter().filter(|card| card.chunk == 1).cloned().collect();
    if models.is_empty() {
        return Err(super::no_model("H = 1"));
    }
    models.sort_by_key(|card| (card.decoder, card.network.clone(), card.size()));
    let mut runs = vec![Run::heuristic(Mode::Optimal)];
    runs.extend(models.iter().map(|card| Run::model(Mode::Optimal, card)));
    let rows = lab.plan(&runs)?;

    let heuristic = Measured::of(&rows[0]);
    let points: Vec<Point<'_>> = models
        .iter()
        .zip(&rows[1..])
        .map(|(model, of)| Point {
            model,
            size: model.size(),
            measured: Measured::of(of),
            against_heuristic: Against::of(&rows[0], of),
        })
        .collect();
    let plots = vec![
        (
            "sample-efficiency-iterations",
            plot(&points, &heuristic, "iterations", |of| of.iterations.mean),
        ),
        (
            "sample-efficiency-time",
            plot(&points, &heuristic, "time of Stage 2 [s]", |of| of.time_s.mean),
        ),
    ];
    let mut notes = [vec![HOW_TO_READ.into()], models::notes(&models)].concat();
    notes.extend(models::confounded(&models));
    Ok(Findings {
        title: "Sample efficiency (figure)",
        notes,
        tables: vec![(
            "Decoders and sizes of the training set, H = 1".into(),
            table(&points, &heuristic),
        )],
        plots: plots
            .into_iter()
            .map(|(name, plot)| plot.svg().map(|svg| (name, svg)))
            .collect::<Result<_, _>>()?,
        numbers: super::to_value(&(&heuristic, &points))?,
    })
}

/// Iterations that the paper gives for a decoder at a size.
fn published(decoder: Decoder, size: u64) -> String {
    let row = DECODERS.into_iter().find(|row| row.decoder == Some((decoder, 1)));
    match (decoder, row) {
        (_, Some(row)) if size == SAMPLE_SIZES[2] => measure::published(row.iterations),
        (Decoder::Flow, _) if SAMPLE_SIZES.contains(&size) => {
            format!("about {SAMPLE_FLOW_ITERATIONS}")
        }
        _ => measure::NONE.into(),
    }
}

fn table(points: &[Point<'_>], heuristic: &Measured) -> Table {
    let head = format!(
        "start | >size | >iterations | >{} | >change [%] | >time | >success [%]",
        models::PAPER_COLUMN
    );
    let mut table = Table::new(head.as_str());
    let Spread { mean, std } = DECODERS[0].iterations;
    table.row([
        "heuristic".into(),
        measure::NONE.into(),
        measure::of(&heuristic.iterations),
        measure::spread(mean, std),
        measure::NONE.into(),
        measure::of_time(&heuristic.time_s),
        measure::rate(&heuristic.success),
    ]);
    for Point { model, size, measured, against_heuristic } in points {
        table.row([
            model.name.clone(),
            card::thousands(*size),
            measure::of(&measured.iterations),
            published(model.decoder, *size),
            measure::change(&against_heuristic.iterations),
            measure::of_time(&measured.time_s),
            measure::rate(&measured.success),
        ]);
    }
    table
}

/// A line for each decoder and network.
fn plot(
    points: &[Point<'_>],
    heuristic: &Measured,
    what: &str,
    of: fn(&Measured) -> Estimate,
) -> Lines {
    let sizes: Vec<u64> =
        points.iter().map(|p| p.size).collect::<BTreeSet<_>>().into_iter().collect();
    let place = |size: u64| sizes.iter().position(|other| *other == size).unwrap_or_default();
    let alike = |a: &Point<'_>, b: &Point<'_>| {
        (a.model.decoder, &a.model.network) == (b.model.decoder, &b.model.network)
    };
    let series = points.chunk_by(alike).map(|points| Series {
        name: format!("{}, {}", points[0].model.decoder, points[0].model.network),
        points: points.iter().map(|p| (place(p.size), of(&p.measured))).collect(),
    });
    let [linear, flow] = [Decoder::Linear, Decoder::Flow].map(|decoder| {
        let row = DECODERS.into_iter().find(|row| row.decoder == Some((decoder, 1)));
        row.map_or(measure::NONE.into(), |row| number(row.iterations.mean))
    });
    Lines {
        title: match what {
            "iterations" => {
                format!("Sample efficiency (paper at 90k: linear {linear}, flow {flow})")
            }
            _ => "Sample efficiency".into(),
        },
        x_label: "scenarios of the training set".into(),
        y_label: format!("{what} (mean, 95 %)"),
        x: sizes.iter().map(|size| card::thousands(*size)).collect(),
        series: series.collect(),
        reference: Some(("heuristic".into(), of(heuristic))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::card::tests::card;
    use super::super::laboratory::tests::Invented;
    use super::*;

    #[test]
    fn sizes_stand_in_their_order_with_what_the_paper_says() {
        let mut models: Vec<Card> = [90_000, 5_000, 10_000]
            .into_iter()
            .flat_map(|size| [Decoder::Flow, Decoder::Linear].map(|d| card(d, 1, size)))
            .collect();
        models.push(card(Decoder::Linear, 5, 90_000));
        let mut lab = Invented::default();
        let findings = reproduce(&models, &mut lab).unwrap();
        assert_eq!(lab.asked.len(), 7);
        let asked: Vec<&str> = lab.asked.iter().map(|key| &key[..key.len() - 9]).collect();
        assert_eq!(asked[1], "optimal-linear-1-5k");
        assert_eq!(asked[6], "optimal-flow-1-90k");
        let text = findings.text();
        assert_eq!(text.matches("about 13").count(), 2, "{text}");
        assert!(text.contains("13.4 ± 6.0") && text.contains("14.6 ± 5.9"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        assert_eq!(findings.plots.len(), 2);
        assert!(findings.plots[0].1.contains("linear, 3 x 96"));
    }
}
