//! Report of `remora fly` and `remora fly --rerun`.

use remora_flight::report::{endings, influences, nothing_stands_out, spread_table};
use remora_flight::results::Results;
use remora_flight::row::Row;
use std::fmt::Write;
use std::path::Path;

/// Shares, spreads, what to improve first, files.
pub fn flights_report(results: &Results) -> String {
    let summary = &results.summary;
    let mut out = String::new();
    if let ([row], Some(_)) = (results.rows.as_slice(), results.rows[0].flown.as_ref()) {
        out.push_str(&one(row));
    } else {
        let _ = writeln!(out, "{} runs", summary.runs);
        if summary.without_plan > 0 {
            let _ = writeln!(out, "{} of them had no plan to fly", summary.without_plan);
        }
        let _ = write!(out, "\n{}\n{}", endings(summary), spread_table(summary));
        if summary.replans[0] > 0 {
            let [made, verified] = summary.replans;
            let _ = writeln!(out, "\n{made} plans made in flight, {verified} of them verified");
        }
        let _ = match influences(summary) {
            None => writeln!(out, "\nwhat to improve first: {}", nothing_stands_out(summary)),
            Some(table) => write!(out, "\nwhat to improve first, with 95 % intervals\n{table}"),
        };
    }
    out.push('\n');
    for file in &results.files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

/// One run and its history.
pub fn rerun_report(row: &Row, history: &Path) -> String {
    format!("{}\nwritten: {}\n", one(row), history.display())
}

fn one(row: &Row) -> String {
    let Some(flown) = &row.flown else {
        return format!("run {}, {}: no plan to fly\n", row.run, row.scenario);
    };
    let mut out = format!(
        "run {}, {}: {} at {:.1} s\n  miss          {:.2} mm\n  angle         {:.3} deg\n  \
         speed         {:.3} mm/s\n  joint rate    {:.2} of its limit\n  tracking      {:.1} mm, \
         {:.2} deg after the first minute\n  impulse       {:.1} N s\n",
        row.run,
        row.scenario,
        flown.ending.name(),
        flown.time_s,
        1e3 * flown.arrival.miss_m,
        flown.arrival.angle_rad.to_degrees(),
        1e3 * flown.arrival.speed_m_s,
        flown.room.joint_rate,
        1e3 * flown.tracking[0],
        flown.tracking[1].to_degrees(),
        flown.impulse_n_s,
    );
    if flown.replans[0] > 0 {
        let [made, verified] = flown.replans;
        let _ = writeln!(out, "  planned again {made} times, {verified} verified");
    }
    if !flown.violations.is_empty() {
        let _ = writeln!(out, "  passed        {}", flown.violations.join(", "));
    }
    out
}
