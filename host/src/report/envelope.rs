//! Report of `remora campaign envelope`.

use super::Table;
use remora_host::envelope::{EnvelopeResult, Map};
use std::fmt::Write;

/// Head, a line a vehicle and horizon, files.
pub fn envelope_report(made: &EnvelopeResult) -> String {
    let map = &made.map;
    let (plans, optimal) = map.totals();
    let mut out = format!(
        "{} cells of {} scenarios: {optimal} of {plans} plans verified and optimal\n\
         {}, start {}, seed {}; {} planned in {:.1} s, {} taken from the journal\n\n",
        map.cells.len(),
        map.count,
        map.integrator,
        map.warm_start.name(),
        map.seed,
        made.planned,
        made.wall_s,
        made.resumed,
    );
    // Writing to a string cannot fail.
    let _ = write!(out, "{}", overview(map));
    for file in &made.files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

fn overview(map: &Map) -> Table {
    let mut table = Table::new(
        "vehicle | >horizon | >cells | >planned | >impossible | >no start | >refused | >all optimal | >success",
    );
    for vehicle in &map.vehicles {
        for horizon in &map.horizons_s {
            let cells: Vec<_> = map.rows(&vehicle.name, *horizon).into_iter().flatten().collect();
            let count = |name: &str| cells.iter().filter(|c| c.state.name() == name).count();
            let shares: Vec<f64> = cells.iter().filter_map(|cell| cell.success()).collect();
            let mean = shares.iter().sum::<f64>() / shares.len() as f64;
            let all = shares.iter().filter(|share| **share == 1.0).count();
            let none = shares.is_empty();
            table.row([
                vehicle.name.clone(),
                format!("{horizon} s"),
                cells.len().to_string(),
                count("planned").to_string(),
                count("impossible").to_string(),
                count("no start").to_string(),
                count("refused").to_string(),
                if none { "-".into() } else { all.to_string() },
                if none { "-".into() } else { format!("{:.0} %", 100.0 * mean) },
            ]);
        }
    }
    table
}
