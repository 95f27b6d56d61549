//! A campaign as a page for people, with pages of notable plans in three dimensions.

use super::{Align, Table, number, time};
use remora_host::campaign::{Results, Statistics};
use remora_host::error::Error;
use remora_host::formats::{PlanFile, Row, Verdict, make_directory, write_atomically};
use remora_host::report::Page;
use remora_host::report::page::html;
use remora_host::report::plot::{Cloud, Distributions, Points};
use remora_host::statistics::{Estimate, exact};
use remora_web::Shown;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the page.
const PAGE: &str = "report.html";
/// Folder of the pages of single plans.
const PAGES: &str = "pages";

/// Most plans that are not flyable with a page of their own.
const MOST_FAILED: usize = 6;
/// Most links of a reason.
const MOST_LINKED: usize = 12;

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
    let rows = &results.rows;
    let mut page = Page::new("campaign", "Campaign");
    page.text(headline(results)).table(verdicts(results));
    if !rows.is_empty() {
        page.heading("Where it fails").plot("map", "Each scenario by its start", map(rows)?);
    }
    if rows.iter().any(|row| !row.is_verified()) {
        page.heading("Failures by reason").text(
            "A plan's name leads to its page in three dimensions where it has one, otherwise to its file. \
             `results.parquet` has a row a scenario.",
        );
        page.table(failures(rows, notable));
    }
    let verified: Vec<&Row> = rows.iter().filter(|row| row.is_verified()).collect();
    if !verified.is_empty() {
        page.heading("What plans cost");
        let tumbles = costs(&verified, "tumble [deg/s]", tumble_deg_s)?;
        page.plot("cost-tumble", "Cost of attitude and arm over the tumble", tumbles);
        let distances = costs(&verified, "distance at the start [m]", distance_m)?;
        page.plot("cost-distance", "Cost of attitude and arm over the distance", distances);
    }
    page.heading("Notable plans").text("Each in three dimensions over time, to be planned on.");
    page.table(notable_table(notable));
    let planned: Vec<&Row> = rows.iter().filter(|row| !row.is_refused()).collect();
    if !planned.is_empty() {
        page.heading("How they are spread").table(spreads(results));
        page.plot("times", "Times of the plans: shares", times(&planned)?);
    }
    Ok(page)
}

/// Verified plans with the interval of their share, and the method.
fn headline(results: &Results) -> String {
    let Results { summary, rows, .. } = results;
    let count = |is: fn(&Row) -> bool| rows.iter().filter(|row| is(row)).count();
    let verified = count(Row::is_verified);
    let optimal = count(|row| row.verdict == Verdict::Optimal);
    let Estimate { value, low, high } = exact(verified as u64, rows.len() as u64);
    let [value, low, high] = [value, low, high].map(|share| format!("{:.1}", 100.0 * share));
    format!(
        "**{verified} of {} plans are verified**, {optimal} of them optimal. Verified are {value} %, with a 95 % \
         interval of {low} to {high} %. Method: {} mode, {} start, {}, {}.",
        rows.len(),
        summary.mode.name(),
        summary.warm_start.name(),
        summary.integrator,
        summary.qp.name(),
    )
}

fn verdicts(results: &Results) -> Table {
    let mut table = Table::new([("verdict", Align::Left), ("plans", Align::Right)]);
    for (verdict, count) in &results.summary.by_verdict {
        table.row([verdict.to_string(), count.to_string()]);
    }
    table
}

fn tumble_deg_s(row: &Row) -> f64 {
    row.flight.target_rate_rad_s.to_degrees()
}

fn distance_m(row: &Row) -> f64 {
    row.flight.start_distance_m
}

/// Name, colour and mark of an outcome, and the rows that have it.
type Outcome = (&'static str, usize, bool, fn(&Row) -> bool);

const OUTCOMES: [Outcome; 4] = [
    ("optimal", 0, false, |row| row.verdict == Verdict::Optimal),
    ("verified, not converged", 2, false, |row| row.verdict == Verdict::Verified),
    ("not flyable", 1, true, |row| row.verdict == Verdict::NotFlyable && !row.is_refused()),
    ("refused before planning", 3, true, Row::is_refused),
];

/// A cloud of points for each outcome that there is.
fn clouds<'a>(rows: impl Iterator<Item = &'a Row> + Clone, at: &Place<'_>) -> Vec<Cloud> {
    let cloud = |(name, colour, is_crossed, has): Outcome| {
        let points: Vec<_> = rows.clone().filter(|row| has(row)).map(at).collect();
        Cloud { name: format!("{name}: {}", points.len()), colour, is_crossed, points }
    };
    OUTCOMES.map(cloud).into_iter().filter(|cloud| !cloud.points.is_empty()).collect()
}

/// Place of a row in a plot.
type Place<'a> = dyn Fn(&Row) -> (f64, f64) + 'a;

fn map(rows: &[Row]) -> Result<String, Error> {
    Points {
        title: "Outcome over distance and tumble".into(),
        x_label: "distance at the start [m]".into(),
        y_label: "tumble [deg/s]".into(),
        series: clouds(rows.iter(), &|row| (distance_m(row), tumble_deg_s(row))),
    }
    .svg()
}

fn costs(verified: &[&Row], label: &str, of: fn(&Row) -> f64) -> Result<String, Error> {
    Points {
        title: "Cost of attitude and arm".into(),
        x_label: label.into(),
        y_label: "cost".into(),
        series: clouds(verified.iter().copied(), &|row| (of(row), row.stage2.cost)),
    }
    .svg()
}

/// A row a reason, the most frequent first.
fn failures(rows: &[Row], notable: &[Notable<'_>]) -> Table {
    let mut reasons: BTreeMap<(&str, bool), Vec<&Row>> = BTreeMap::new();
    for row in rows.iter().filter(|row| !row.is_verified()) {
        reasons.entry((row.reason.as_str(), row.is_refused())).or_default().push(row);
    }
    let mut reasons: Vec<_> = reasons.into_iter().collect();
    reasons.sort_by_key(|(_, rows)| Reverse(rows.len()));
    let mut table = Table::new([
        ("reason", Align::Left),
        ("scenarios", Align::Right),
        ("share [%]", Align::Right),
        ("which", Align::Left),
    ]);
    for ((reason, is_refused), failed) in reasons {
        let when = if is_refused { ", refused before planning" } else { "" };
        let share = 100.0 * failed.len() as f64 / rows.len() as f64;
        let mut which: Vec<String> =
            failed.iter().take(MOST_LINKED).map(|row| linked(row, notable)).collect();
        if failed.len() > MOST_LINKED {
            which.push(format!("and {} more", failed.len() - MOST_LINKED));
        }
        let reason = format!("`{reason}`{when}");
        table.row([reason, failed.len().to_string(), format!("{share:.1}"), which.join(", ")]);
    }
    table
}

/// The name of a scenario with a link to what there is of its plan.
fn linked(row: &Row, notable: &[Notable<'_>]) -> String {
    let id = &row.scenario;
    if row.is_refused() {
        id.clone()
    } else if notable.iter().any(|notable| notable.row.scenario == *id) {
        format!("[{id}]({PAGES}/{id}.html)")
    } else {
        format!("[{id}](plans/{id}.plan.json)")
    }
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
            distance(row),
            time(row.time_s),
        ]);
    }
    table
}

/// The smallest distance and its pair, where it is judged.
fn distance(row: &Row) -> String {
    let metres = smallest(row);
    if metres.is_finite() { format!("{metres:.3} {}", row.nearest.pair) } else { "-".into() }
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
