//! Table IV: stopping at the first feasible plan.

use super::findings::Findings;
use super::laboratory::{Laboratory, Run};
use super::measure::{self, Against, Measured};
use super::published::{self, FEASIBILITY};
use super::{Card, Decoder, card, models};
use remora_host::error::Error;
use remora_host::formats::Row;
use remora_host::method::Mode;
use remora_host::report::plot::Distributions;
use remora_host::report::{Table, number};
use serde::Serialize;

/// A row: a mode and a start.
#[derive(Serialize)]
struct Line<'a> {
    mode: Mode,
    model: Option<&'a Card>,
    measured: Measured,
    against_heuristic: Option<Against>,
    published: Option<published::Feasibility>,
}

const HOW_TO_READ: &str = "Each row of ours is followed by the paper's. Mean ± standard deviation \
                           over feasible plans; in brackets the 95 % interval. Times include \
                           inference.";

const MODES: [Mode; 2] = [Mode::Optimal, Mode::Feasible];

/// Compares both modes from the heuristic and from the models with a flow decoder and H = 1 that
/// were trained on most, the paper's choice; where there is none, from those with any decoder.
pub(super) fn reproduce(models: &[Card], lab: &mut dyn Laboratory) -> Result<Findings, Error> {
    let models = chosen(models)?;
    let starts = || [None].into_iter().chain(models.iter().map(Some));
    let asked: Vec<(Mode, Option<&Card>)> =
        MODES.into_iter().flat_map(|mode| starts().map(move |model| (mode, model))).collect();
    let run = |(mode, model): &(Mode, Option<&Card>)| match model {
        Some(card) => Run::model(*mode, card),
        None => Run::heuristic(*mode),
    };
    let rows = lab.plan(&asked.iter().map(run).collect::<Vec<_>>())?;

    let heuristic = |mode: Mode| {
        let mut all = asked.iter().zip(&rows);
        all.find(|(asked, _)| **asked == (mode, None)).map_or(&[][..], |(_, rows)| rows)
    };
    let line = |(mode, model): (Mode, Option<&'_ Card>), of: &[Row]| {
        (Measured::of(of), model.map(|_| Against::of(heuristic(mode), of)))
    };
    let lines: Vec<Line<'_>> = asked
        .iter()
        .zip(&rows)
        .map(|((mode, model), of)| {
            let (measured, against_heuristic) = line((*mode, *model), of);
            let published = FEASIBILITY
                .into_iter()
                .find(|row| (row.mode, row.is_learned) == (*mode, model.is_some()));
            Line { mode: *mode, model: *model, measured, against_heuristic, published }
        })
        .collect();
    let series = asked.iter().zip(&rows).map(|(asked, of)| (name(asked), measure::costs(of)));
    let plot = Distributions {
        title: "Cost of the plans".into(),
        x_label: "cost of Stage 2".into(),
        series: series.collect(),
    };
    Ok(Findings {
        title: "Feasibility and optimality (Table IV)",
        notes: [vec![HOW_TO_READ.into()], models::notes(&models)].concat(),
        tables: vec![
            ("Plans".into(), table(&lines)),
            ("Costs".into(), costs(&lines)),
            (
                "Against the heuristic in the same mode, scenario by scenario".into(),
                comparison(&lines),
            ),
        ],
        plots: vec![("feasibility-cost", plot.svg()?)],
        numbers: super::to_value(&lines)?,
    })
}

/// The models of the table: of one action a node where there are such, and of those with a flow decoder.
fn chosen(models: &[Card]) -> Result<Vec<Card>, Error> {
    let single: Vec<Card> = models.iter().filter(|card| card.chunk == 1).cloned().collect();
    let models = if single.is_empty() { models.to_vec() } else { single };
    let flow = card::largest(models.iter().filter(|card| card.decoder == Decoder::Flow).cloned());
    let models = if flow.is_empty() { card::largest(models.into_iter()) } else { flow };
    match models.is_empty() {
        true => Err(super::no_model("the integrator")),
        false => Ok(models),
    }
}

fn name((mode, model): &(Mode, Option<&Card>)) -> String {
    format!("{}, {}", mode.name(), model.map_or("heuristic", |card| &card.name))
}

fn table(lines: &[Line<'_>]) -> Table {
    let mut table = Table::new("mode, start | >feasible [%] | >iterations | >time | >inference");
    for line in lines {
        let Measured { success, iterations, time_s, inference_s, .. } = &line.measured;
        table.row([
            name(&(line.mode, line.model)),
            measure::rate(success),
            measure::of(iterations),
            measure::of_time(time_s),
            measure::of_time(inference_s),
        ]);
        if let Some(row) = line.published {
            table.row([
                models::PAPER_ROW.into(),
                measure::percent(row.success),
                measure::published(row.iterations),
                measure::published_time(row.time_s),
                measure::NONE.into(),
            ]);
        }
    }
    table
}

fn costs(lines: &[Line<'_>]) -> Table {
    let mut table =
        Table::new("mode, start | >mean | >median | >p99 | >95 % | >of the optimal p99");
    let ratio = |value: f64, best: Option<f64>| match best {
        Some(best) => format!("{:.2}", value / best),
        None => measure::NONE.into(),
    };
    for line in lines {
        let same = |other: &&Line<'_>| other.mode == Mode::Optimal && other.model == line.model;
        let best = lines.iter().find(same);
        let Measured { cost, cost_median, cost_p99, .. } = &line.measured;
        table.row([
            name(&(line.mode, line.model)),
            measure::of(cost),
            number(cost_median.value),
            number(cost_p99.value),
            measure::interval(cost_p99),
            ratio(cost_p99.value, best.map(|line| line.measured.cost_p99.value)),
        ]);
        if let Some(row) = line.published {
            let best = best.and_then(|line| line.published);
            table.row([
                models::PAPER_ROW.into(),
                measure::published(row.cost),
                number(row.cost_median),
                number(row.cost_p99),
                measure::NONE.into(),
                ratio(row.cost_p99, best.map(|row| row.cost_p99)),
            ]);
        }
    }
    table
}

fn comparison(lines: &[Line<'_>]) -> Table {
    let mut table = Table::new("mode, start | >iterations [%] | >time [%] | >cost, median [1e-3]");
    for line in lines {
        let Some(against) = &line.against_heuristic else { continue };
        table.row([
            name(&(line.mode, line.model)),
            measure::change(&against.iterations),
            measure::change(&against.time),
            measure::difference(&against.cost_median),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::card::tests::card;
    use super::super::laboratory::tests::Invented;
    use super::*;

    #[test]
    fn the_tail_of_the_heuristic_is_seen() {
        let models = [card(Decoder::Linear, 1, 90_000), card(Decoder::Flow, 1, 90_000)];
        let mut lab = Invented::default();
        let findings = reproduce(&models, &mut lab).unwrap();
        assert_eq!(lab.asked.len(), 4);
        assert_eq!(lab.asked[2], "feasible-heuristic");
        let numbers = &findings.numbers;
        assert!(numbers[2]["measured"]["cost_p99"]["value"].as_f64().unwrap() > 5.0);
        assert!(numbers[3]["measured"]["cost_p99"]["value"].as_f64().unwrap() < 0.5);
        let text = findings.text();
        for published in ["0.93 ± 1.98", "10.94", "16.06", "8.90 ± 2.52", "0.7930"] {
            assert!(text.contains(published), "{published}\n{text}");
        }
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        // Without a flow decoder the linear one is better than nothing.
        reproduce(&models[..1], &mut lab).unwrap();
        assert!(lab.asked[5].starts_with("optimal-linear-1-90k"), "{:?}", lab.asked);
    }
}
