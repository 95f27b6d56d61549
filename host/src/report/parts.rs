//! What commands print that make parts and gather them.

use super::campaign::summary_report;
use remora_flight::parts::Gathered as Flights;
use remora_flight::report::{endings, spread_table};
use remora_host::parts::{Difference, Gathered, Made};
use remora_learn::dataset::Gathered as Shards;
use std::fmt::Write;

/// Most missing parts and differences that are listed.
const MOST_LISTED: usize = 20;

/// What a part is, and where.
pub fn part_report(made: &Made) -> String {
    let Made { part, rows, planned, files } = made;
    let mut out = format!("part {part}: {rows} rows, {planned} planned now\n");
    for file in files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

/// What is missing, what all rows come to, and what a sample that was planned again differs by.
pub fn gather_report(gathered: &Gathered, recomputed: Option<(u64, &[Difference])>) -> String {
    let mut out = summary_report(&gathered.summary);
    let there = gathered.parts - gathered.missing.len() as u64;
    let _ = writeln!(out, "parts: {there} of {}", gathered.parts);
    out += &missing(&gathered.missing.iter().map(|part| part.number()).collect::<Vec<_>>());
    let _ = writeln!(out, "checksum of all but times: {}", gathered.checksum);
    if let Some((sample, differing)) = recomputed {
        let _ = writeln!(out, "planned again: {sample}, of which {} differ", differing.len());
        out += &differences("part", differing);
    }
    out
}

/// The same of flights.
pub fn gathered_flights(gathered: &Flights, recomputed: Option<&[Difference]>) -> String {
    let summary = &gathered.summary;
    let mut out =
        format!("{} runs\n\n{}\n{}\n", summary.runs, endings(summary), spread_table(summary));
    let there = gathered.parts - gathered.missing.len() as u64;
    let _ = writeln!(out, "parts: {there} of {}", gathered.parts);
    out += &missing(&gathered.missing.iter().map(|part| part.number()).collect::<Vec<_>>());
    let _ = writeln!(out, "checksum: {}", gathered.checksum);
    if let Some(differing) = recomputed {
        let _ = writeln!(out, "flown again: {} differ", differing.len());
        out += &differences("part", differing);
    }
    out
}

/// The same of a dataset.
pub fn gathered_dataset(gathered: &Shards, recomputed: Option<&[Difference]>) -> String {
    let Shards { shards, tried, kept, missing: lacking } = gathered;
    let there = shards - lacking.len() as u64;
    let mut out = format!(
        "{tried} scenarios: {kept} trajectories kept\nfiles: {there} of {shards}\n{}",
        missing(lacking)
    );
    if let Some(differing) = recomputed {
        let _ = writeln!(out, "planned again: {} differ", differing.len());
        out += &differences("file", differing);
    }
    out
}

fn differences(of: &str, all: &[Difference]) -> String {
    let mut out = String::new();
    for Difference { part, scenario, column } in all.iter().take(MOST_LISTED) {
        let _ = writeln!(out, "  {of} {part}: {scenario}: {column}");
    }
    out + &more(all.len())
}

/// What is missing, by number.
fn missing(all: &[u64]) -> String {
    if all.is_empty() {
        return String::new();
    }
    let numbers: Vec<String> = all.iter().take(MOST_LISTED).map(u64::to_string).collect();
    format!("missing: {}\n{}", numbers.join(", "), more(all.len()))
}

fn more(count: usize) -> String {
    match count > MOST_LISTED {
        true => format!("  and {} more\n", count - MOST_LISTED),
        false => String::new(),
    }
}
