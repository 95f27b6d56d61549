//! A campaign as a page for people, with pages of notable plans in three dimensions.

use super::{Align, Table, number, time};
use remora_host::campaign::{Results, Statistics};
use remora_host::error::Error;
use remora_host::formats::{PlanFile, Row, make_directory, write_atomically};
use remora_host::report::Page;
use remora_host::report::page::html;
use remora_host::report::plot::Distributions;
use remora_web::Shown;
use std::path::{Path, PathBuf};

/// Name of the page.
const PAGE: &str = "report.html";
/// Folder of the pages of single plans.
const PAGES: &str = "pages";

/// Most plans that are not flyable with a page of their own.
const MOST_FAILED: usize = 6;

/// Measure of a plan: the larger, the more extreme.
type Measure = fn(&Row) -> f64;

/// By what the extremes are chosen, in words.
const EXTREMES: [(Measure, &str); 5] = [
    (|row| row.stage2.iterations as f64, "most iterations"),
    (|row| row.stage2.cost, "largest cost of attitude and arm"),
    (|row| row.flight.delta_v_m_s, "largest change of velocity"),
    (|row| row.flight.target_rate_rad_s, "fastest tumble"),
    (|row| -smallest(row), "smallest distance of bodies"),
];

/// A plan that is worth a look, and why.
struct Notable<'a> {
    row: &'a Row,
    why: String,
}

/// Writes the page of a campaign whose plans stand in `out`, and those of its notable plans; the page.
///
/// # Errors
/// A plan that is gone, a file that cannot be written, a picture that cannot be drawn.
pub fn write_campaign_page(out: &Path, results: &Results) -> Result<PathBuf, Error> {
    let notable = notable(&results.rows);
    for Notable { row, .. } in &notable {
        write_page(out, &row.scenario)?;
    }
    let file = out.join(PAGE);
    let made = format!("{} scenarios", results.rows.len());
    let text = html("Remora: campaign", &made, &[page(results, &notable)?]);
    write_atomically(&file, text.as_bytes())?;
    Ok(file)
}

/// Writes the page of one plan.
fn write_page(out: &Path, scenario: &str) -> Result<(), Error> {
    let file = out.join("plans").join(format!("{scenario}.plan.json"));
    let plan = PlanFile::read(&file)?;
    let shown = Shown { plan: &plan, flights: Vec::new() };
    let text = remora_web::page(&[shown]).map_err(|failure| failure.error.at(&file))?;
    let folder = out.join(PAGES);
    make_directory(&folder)?;
    write_atomically(&folder.join(format!("{scenario}.html")), text.as_bytes())
}

/// Plans that are not flyable, then the extremes of those that are, each once.
fn notable(rows: &[Row]) -> Vec<Notable<'_>> {
    let planned = || rows.iter().filter(|row| !row.is_refused());
    let failed = planned().filter(|row| !row.is_verified()).take(MOST_FAILED);
    let failed = failed.map(|row| Notable { row, why: format!("not flyable: {}", row.reason) });
    let most = |of: Measure| {
        planned().filter(|row| row.is_verified()).max_by(|a, b| of(a).total_cmp(&of(b)))
    };
    let extremes = EXTREMES
        .into_iter()
        .filter_map(|(of, why)| most(of).map(|row| Notable { row, why: why.into() }));
    let mut notable: Vec<Notable<'_>> = Vec::new();
    for one in failed.chain(extremes) {
        match notable.iter_mut().find(|other| other.row.scenario == one.row.scenario) {
            Some(other) => other.why += &format!(", {}", one.why),
            None => notable.push(one),
        }
    }
    notable
}

/// The smallest distance of any two bodies, the end effector left out [m].
fn smallest(row: &Row) -> f64 {
    row.nearest.at.distance
}

fn page(results: &Results, notable: &[Notable<'_>]) -> Result<Page, Error> {
    let summary = &results.summary;
    let mut page = Page::new("campaign", "Campaign");
    page.text(format!(
        "{} scenarios, {} solved: {} mode, {} start, {}, {}.",
        summary.scenarios,
        summary.solved,
        summary.mode.name(),
        summary.warm_start.name(),
        summary.integrator,
        summary.qp.name(),
    ));
    page.table(verdicts(results));
    page.heading("Notable plans").text("Each in three dimensions over time, to be planned on.");
    page.table(notable_table(notable));
    let planned: Vec<&Row> = results.rows.iter().filter(|row| !row.is_refused()).collect();
    if !planned.is_empty() {
        page.heading("How they are spread").table(spreads(results));
        page.plot("times", "Times of the plans: shares", times(&planned)?);
    }
    Ok(page)
}

fn verdicts(results: &Results) -> Table {
    let mut table = Table::new([("verdict", Align::Left), ("plans", Align::Right)]);
    for (verdict, count) in &results.summary.by_verdict {
        table.row([verdict.to_string(), count.to_string()]);
    }
    for (reason, count) in &results.summary.by_reason {
        table.row([format!("by {reason}"), count.to_string()]);
    }
    table
}

fn notable_table(notable: &[Notable<'_>]) -> Table {
    let right = Align::Right;
    let mut table = Table::new([
        ("plan", Align::Left),
        ("why", Align::Left),
        ("iterations", right),
        ("cost", right),
        ("smallest distance [m]", right),
        ("time", right),
    ]);
    for Notable { row, why } in notable {
        let id = &row.scenario;
        table.row([
            format!("[{id}]({PAGES}/{id}.html)"),
            why.clone(),
            row.stage2.iterations.to_string(),
            number(row.stage2.cost),
            format!("{:.3} {}", smallest(row), row.nearest.pair),
            time(row.time_s),
        ]);
    }
    table
}

fn spreads(results: &Results) -> Table {
    let right = Align::Right;
    let mut table = Table::new([
        ("", Align::Left),
        ("mean", right),
        ("median", right),
        ("99 %", right),
        ("largest", right),
    ]);
    let summary = &results.summary;
    let mut row = |name: &str, s: &Statistics, show: fn(f64) -> String| {
        let [mean, median, p99, max] = [s.mean, s.median, s.p99, s.max].map(show);
        table.row([name.into(), mean, median, p99, max]);
    };
    row("iterations of stage 1", &summary.stage1.iterations, number);
    row("iterations of stage 2", &summary.stage2.iterations, number);
    row("cost of stage 2 (solved)", &summary.stage2.cost, number);
    row("time of a plan", &summary.time_s, time);
    table
}

fn times(planned: &[&Row]) -> Result<String, Error> {
    let of = |value: fn(&Row) -> f64| {
        planned.iter().map(|row| value(row)).filter(|x| *x > 0.0 && x.is_finite()).collect()
    };
    Distributions {
        title: "Times of the plans".into(),
        x_label: "time [ms]".into(),
        series: vec![
            ("stage 1".into(), of(|row| 1e3 * row.stage1.time_s)),
            ("stage 2".into(), of(|row| 1e3 * row.stage2.time_s)),
            ("whole plan".into(), of(|row| 1e3 * row.time_s)),
        ],
    }
    .svg()
}
