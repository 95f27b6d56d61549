//! Flights as one page that loads nothing: pictures first, then tables.

use crate::flight::Ending;
use crate::flights_file::FlightsFile;
use crate::history::Sample;
use crate::pilot::Bounds;
use crate::results::Results;
use crate::row::{FlightRow, Row};
use crate::run::PAGES;
use crate::statistics::{Influence, Summary};
use remora_core::advanced::guidance::FlightMode;
use remora_host::error::Error;
use remora_host::report::page::html;
use remora_host::report::plot::{Cloud, Distributions, Panel, Scatter, Sheet};
use remora_host::report::{Align, Page, Table, number};

/// Miss of a capture at most [m], for the picture.
fn capture_radius(asked: &FlightsFile) -> f64 {
    asked.options.settings().criteria.miss_m
}

/// A run that is shown over time.
pub struct Notable {
    /// Its number.
    pub run: u64,
    /// Its history.
    pub samples: Vec<Sample>,
    /// Limits of its mission.
    pub bounds: Bounds,
}

/// The page of some flights, with notable runs over time.
///
/// # Errors
/// Where a picture cannot be drawn.
pub fn page(asked: &FlightsFile, results: &Results, notable: &[Notable]) -> Result<String, Error> {
    let mut page = Page::new("flights", "Flights");
    page.text(headline(&results.summary));
    if results.rows.iter().any(|row| row.flown.is_some()) {
        page.plot("miss", "Where the end effector is at the port's plane", miss(asked, results)?);
        page.plot("cdf", "Miss, angle and speed: shares of the flights", spreads(results)?);
    }
    page.heading("How they ended").table(endings(&results.summary));
    page.heading("How they are spread").table(spread_table(&results.summary));
    page.heading("What to improve first");
    match influences(&results.summary) {
        None => page.text(format!("Here {}.", nothing_stands_out(&results.summary))),
        Some(table) => page
            .text(
                "Rank correlation (Spearman) of the miss with how far each drawn number is from its \
                 median, with its 95 % interval. Listed is what differs from chance at 95 % after \
                 correction for the number of errors (Holm).",
            )
            .table(table),
    };
    let mut runs = Page::new("runs", "Notable runs");
    for Notable { run, samples, bounds } in notable {
        let row = results.rows.iter().find(|row| row.run == *run);
        runs.heading(format!("Run {run}"));
        let said = row.map_or(String::new(), described);
        runs.text(format!(
            "{said} [Planned against flown, in three dimensions]({PAGES}/{run}.html)"
        ));
        let caption = format!("Run {run} over time");
        runs.plot(&format!("run-{run}"), &caption, over_time(&caption, samples, bounds)?);
    }
    let made = format!(
        "{} runs, errors drawn with seed {}, {} Hz",
        results.rows.len(),
        asked.seed,
        asked.options.rate_hz
    );
    Ok(html("Remora: flights", &made, &[page, runs]))
}

fn headline(summary: &Summary) -> String {
    let captured = summary.endings.iter().find(|(name, _)| *name == Ending::Captured.name());
    match captured {
        None => format!("{} runs, none of which had a plan to fly.", summary.runs),
        Some((_, share)) => format!(
            "{} of {} flights captured; with 95 % confidence at least {:.2} %.",
            share.count,
            share.of,
            100.0 * share.at_least
        ),
    }
}

fn flown(results: &Results) -> impl Iterator<Item = &FlightRow> {
    results.rows.iter().filter_map(|row| row.flown.as_ref())
}

fn miss(asked: &FlightsFile, results: &Results) -> Result<String, Error> {
    let cloud = |(name, colour, is_captured): (&str, usize, bool)| {
        let wanted = flown(results).filter(|row| (row.ending == Ending::Captured) == is_captured);
        let points = wanted.map(|row| row.arrival.miss_target_m);
        let points = points.map(|[x, y, _]| (1e3 * x, 1e3 * y)).collect();
        Cloud { name: name.into(), colour, is_crossed: !is_captured, points }
    };
    let series = [("captured", 0, true), ("not captured", 1, false)].map(cloud);
    let series = series.into_iter().filter(|cloud| !cloud.points.is_empty()).collect();
    Scatter {
        title: "Miss in the port's plane, ellipses of two deviations".into(),
        axes: ("target's x [mm]".into(), "target's y [mm]".into()),
        series,
        circle: Some(("capture".into(), 1e3 * capture_radius(asked))),
        ellipses: true,
    }
    .svg()
}

fn spreads(results: &Results) -> Result<String, Error> {
    let positive = |of: fn(&FlightRow) -> f64| {
        flown(results).map(of).filter(|x| *x > 0.0 && x.is_finite()).collect::<Vec<_>>()
    };
    Distributions {
        title: "Distributions at the port".into(),
        x_label: "miss [mm], angle [deg], speed [mm/s]".into(),
        series: vec![
            ("miss [mm]".into(), positive(|row| 1e3 * row.arrival.miss_m)),
            ("angle [deg]".into(), positive(|row| row.arrival.angle_rad.to_degrees())),
            ("speed [mm/s]".into(), positive(|row| 1e3 * row.arrival.speed_m_s)),
        ],
    }
    .svg()
}

/// A flight over time, with the limits of its mission.
///
/// # Errors
/// Where there is nothing to draw.
pub fn over_time(title: &str, history: &[Sample], bounds: &Bounds) -> Result<String, Error> {
    let line = |name: &str, of: &dyn Fn(&Sample) -> f64| {
        let points = history.iter().map(|sample| (sample.time_s, of(sample))).collect();
        (name.to_string(), points)
    };
    let rows = |which: usize, scale: f64| {
        let count = history.first().map_or(0, |sample| sample.joints[which].len());
        (0..count)
            .map(|i| line(&format!("{}", i + 1), &|sample| scale * sample.joints[which][i]))
            .collect::<Vec<_>>()
    };
    let panel = |title: &str, limits, lines| {
        let moment = history.iter().find(|s| s.mode == FlightMode::Abort as u32).map(|s| s.time_s);
        Panel { title: title.into(), lines, limits, moment }
    };
    let both = |scale: f64, most: &[f64]| -> Vec<f64> {
        most.iter().flat_map(|x| [-scale * x, scale * x]).collect()
    };
    let [least, most] = &bounds.joint_angle;
    let stops = least.iter().chain(most).map(|x| x.to_degrees()).collect();
    let distance = |sample: &Sample| sample.tip_target_m.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let wheels = ["x", "y", "z"].iter().enumerate();
    let wheels =
        wheels.map(|(i, axis)| line(axis, &move |sample| 1e3 * sample.bus_torque_n_m[i])).collect();
    let panels = vec![
        panel("end effector from the port [m]", Vec::new(), vec![line("distance", &distance)]),
        panel(
            "approach axis [deg]",
            Vec::new(),
            vec![line("angle", &|s| s.angle_rad.to_degrees())],
        ),
        panel("joint angles [deg]", stops, rows(0, 1.0_f64.to_degrees())),
        panel("joint rates [mrad/s]", both(1e3, &bounds.joint_rate), rows(1, 1e3)),
        panel("joint torques [mN m]", both(1e3, &bounds.joint_torque), rows(2, 1e3)),
        panel("bus torque [mN m]", both(1e3, &[bounds.bus_torque]), wheels),
        panel("force [mN]", Vec::new(), vec![line("size", &|s| 1e3 * size(&s.force_n))]),
        panel(
            "tracking",
            Vec::new(),
            vec![
                line("position [mm]", &|s| 1e3 * s.tracking[0]),
                line("attitude [mrad]", &|s| 1e3 * s.tracking[1]),
            ],
        ),
    ];
    Sheet::panels_svg(title, panels)
}

fn described(row: &Row) -> String {
    let Some(flown) = &row.flown else { return "No plan to fly.".into() };
    let passed = match flown.violations.as_slice() {
        [] => String::new(),
        names => format!("; passed: {}", names.join(", ")),
    };
    format!(
        "{}, scenario {}: miss {:.1} mm, {:.2} deg, {:.2} mm/s{passed}.",
        flown.ending.name(),
        row.scenario,
        1e3 * flown.arrival.miss_m,
        flown.arrival.angle_rad.to_degrees(),
        1e3 * flown.arrival.speed_m_s
    )
}

/// How flights ended, with bounds of the shares.
pub fn endings(summary: &Summary) -> Table {
    let mut table = Table::new([
        ("ended", Align::Left),
        ("flights", Align::Right),
        ("share [%]", Align::Right),
        ("at least [%]", Align::Right),
        ("at most [%]", Align::Right),
    ]);
    for (name, share) in &summary.endings {
        table.row([
            (*name).into(),
            share.count.to_string(),
            format!("{:.2}", 100.0 * share.share),
            format!("{:.2}", 100.0 * share.at_least),
            format!("{:.2}", 100.0 * share.at_most),
        ]);
    }
    for (name, count) in &summary.violations {
        let none = String::new;
        table.row([format!("passed: {name}"), count.to_string(), none(), none(), none()]);
    }
    table
}

/// How quantities are spread.
pub fn spread_table(summary: &Summary) -> Table {
    let mut table = Table::new([
        ("", Align::Left),
        ("mean", Align::Right),
        ("median", Align::Right),
        ("95 %", Align::Right),
        ("99.73 %", Align::Right),
        ("worst", Align::Right),
    ]);
    for spread in &summary.spreads {
        let numbers = [spread.mean, spread.median, spread.p95, spread.p99_73, spread.worst];
        let (name, unit) = readable(spread.name);
        let [mean, median, p95, p99_73, worst] = numbers.map(|x| number(x / unit));
        table.row([name.into(), mean, median, p95, p99_73, worst]);
    }
    table
}

/// Name of a quantity for people, and the unit in which they read it.
fn readable(name: &str) -> (&str, f64) {
    match name {
        "miss_m" => ("miss [mm]", 1e-3),
        "angle_deg" => ("angle [deg]", 1.0),
        "speed_m_s" => ("speed [mm/s]", 1e-3),
        "joint_rate_over_limit" => ("joint rate, of its limit", 1.0),
        "tracking_position_m" => ("tracking error, position [mm]", 1e-3),
        "tracking_attitude_deg" => ("tracking error, attitude [deg]", 1.0),
        "impulse_n_s" => ("impulse [N s]", 1.0),
        other => (other, 1.0),
    }
}

/// Errors that correlate with the miss more than by chance; none if there are none.
pub fn influences(summary: &Summary) -> Option<Table> {
    let right = Align::Right;
    let columns = [("error", Align::Left), ("correlation", right), ("from", right), ("to", right)];
    let mut table = Table::new(columns);
    for Influence { name, correlation, low, high } in &summary.influences {
        let [correlation, low, high] = [correlation, low, high].map(|x| format!("{x:.2}"));
        table.row([name.clone(), correlation, low, high]);
    }
    (!summary.influences.is_empty()).then_some(table)
}

/// Text if no error stands out.
pub fn nothing_stands_out(summary: &Summary) -> String {
    let runs = summary.runs - summary.without_plan;
    format!(
        "nothing stands out in {runs} runs: no drawn error correlates with the miss more than by chance"
    )
}
