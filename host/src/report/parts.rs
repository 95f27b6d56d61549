//! Reports of the commands that make parts and gather them.

use super::campaign::summary_report;
use remora_flight::report::{endings, spread_table};
use remora_flight::statistics::Summary as Flights;
use remora_host::campaign::Summary;
use remora_host::parts::{Difference, GatheredParts, PartSummary};
use remora_learn::dataset::Gathered as Shards;
use serde::Serialize;
use std::fmt::Write;

/// Most missing parts and differences that are listed.
const MOST_LISTED: usize = 20;

/// Reports a part and its files.
pub fn part_report(made: &PartSummary) -> String {
    let PartSummary { part, rows, planned, files } = made;
    let mut out = format!("part {part}: {rows} rows, {planned} planned now\n");
    for file in files {
        let _ = writeln!(out, "written: {}", file.display());
    }
    out
}

/// A sample that was planned or flown again.
#[derive(Serialize)]
pub struct Again {
    /// Size of the sample, none where none was asked for.
    pub recomputed: Option<u64>,
    /// Differences from the first results.
    pub differences: Vec<Difference>,
}

/// Reports what is missing, the summary of all rows, and how a sample planned again differs.
pub fn gather_report(gathered: &GatheredParts<Summary>, again: &Again) -> String {
    let checksum = format!("checksum of all but times: {}\n", gathered.checksum);
    summary_report(&gathered.summary)
        + &parts(gathered)
        + &checksum
        + &differing(again, "planned", "part")
}

/// Reports gathered flights likewise.
pub fn gathered_flights(gathered: &GatheredParts<Flights>, again: &Again) -> String {
    let summary = &gathered.summary;
    let runs =
        format!("{} runs\n\n{}\n{}\n", summary.runs, endings(summary), spread_table(summary));
    let checksum = format!("checksum: {}\n", gathered.checksum);
    runs + &parts(gathered) + &checksum + &differing(again, "flown", "part")
}

/// Reports a gathered dataset likewise.
pub fn gathered_dataset(gathered: &Shards, again: &Again) -> String {
    let Shards { shards, tried, kept, missing: lacking } = gathered;
    let there = shards - lacking.len() as u64;
    let files = format!(
        "{tried} scenarios: {kept} trajectories kept\nfiles: {there} of {shards}\n{}",
        missing(lacking)
    );
    files + &differing(again, "planned", "file")
}

/// The parts that are there, and those that are missing.
fn parts<S>(gathered: &GatheredParts<S>) -> String {
    let lacking: Vec<u64> = gathered.missing.iter().map(|part| part.number()).collect();
    let there = gathered.parts - lacking.len() as u64;
    format!("parts: {there} of {}\n{}", gathered.parts, missing(&lacking))
}

/// Lists the differences of a sample that was planned or flown again, where there is one.
fn differing(again: &Again, done: &str, of: &str) -> String {
    let Some(sample) = again.recomputed else { return String::new() };
    let mut out = format!("{done} again: {sample}, of which {} differ\n", again.differences.len());
    for Difference { part, scenario, column } in again.differences.iter().take(MOST_LISTED) {
        let _ = writeln!(out, "  {of} {part}: {scenario}: {column}");
    }
    out + &more(again.differences.len())
}

/// Lists the missing numbers.
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
