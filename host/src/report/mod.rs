//! Reports that the commands print: tables for the terminal, at most 100 columns wide; and the page of a campaign.

mod campaign;
mod campaign_page;
mod check;
mod dataset;
mod envelope;
mod export;
mod exported;
mod flight;
mod import;
mod parts;
mod plan;
mod safety;
mod vehicle;

pub use campaign::campaign_report;
pub use campaign_page::write_campaign_page;
pub use check::check_report;
pub use dataset::dataset_report;
pub use envelope::envelope_report;
pub use export::export_report;
pub use exported::exported_report;
pub use flight::{flights_report, rerun_report};
pub use import::{import_report, refused_import};
pub use parts::{Again, gather_report, gathered_dataset, gathered_flights, part_report};
pub use plan::{evidence, packet_report, plan_report, refusal_report};
pub use safety::safety_report;
pub use vehicle::vehicle_report;

use remora_core::advanced::model::Tolerances;
use remora_core::advanced::stages::Residuals;
use remora_host::formats::Clearances;
use remora_host::report::{Align, Table, number, time};

/// Residuals against their tolerances.
fn residual_table(residuals: &Residuals, tolerances: &Tolerances) -> Table {
    let mut table = Table::new("residual | >value | >tolerance |  | unit");
    let rows = residuals.against(tolerances);
    for ((name, value, tolerance), unit) in rows.into_iter().zip(Residuals::UNITS) {
        let mark = if value <= tolerance { "ok" } else { "TOO LARGE" };
        table.row([
            name.to_string(),
            if value == 0.0 { "0".into() } else { format!("{value:.1e}") },
            format!("{tolerance:.0e}"),
            mark.into(),
            unit.into(),
        ]);
    }
    table
}

/// How near bodies come to each other.
fn clearance_table(clearances: &Clearances) -> Table {
    let mut table = Table::new("smallest distance | >m | >at | ");
    let pairs = ["arm to target", "bus to target", "arm to own bus"];
    for ((name, closest), pair) in clearances.named().into_iter().zip(pairs) {
        let (distance, at, by) = match closest.distance.is_finite() {
            false => ("-".into(), "-".into(), String::new()),
            true => {
                let by = if name == "bus" { String::new() } else { body(closest.body) };
                (format!("{:.3}", closest.distance), format!("{:.0} s", closest.time_s), by)
            }
        };
        table.row([pair.into(), distance, at, by]);
    }
    table
}

/// A body of the servicer by its number.
fn body(number: u32) -> String {
    if number == 0 { "bus".into() } else { format!("link {number}") }
}

/// A line for bodies that overlap though nothing forbids it.
fn overlap_warning(clearances: &Clearances) -> Option<String> {
    let overlaps = clearances.named().into_iter().filter_map(|(name, closest)| {
        let overlap = -closest.distance;
        let line = || format!("{name} by {overlap:.3} m at {:.0} s", closest.time_s);
        (overlap > 0.0).then(line)
    });
    let overlaps: Vec<String> = overlaps.collect();
    (!overlaps.is_empty()).then(|| {
        format!("warning: bodies overlap, clearance is not in force: {}", overlaps.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_host::formats::Closest;

    #[test]
    fn overlaps_are_told_and_distances_have_a_body_and_a_time() {
        let mut clearances = Clearances::NONE;
        assert_eq!(overlap_warning(&clearances), None);
        clearances.arm = Closest { distance: -0.0123, time_s: 612.4, body: 3 };
        clearances.bus = Closest { distance: 0.5, time_s: 1200.0, body: 0 };
        let warning = overlap_warning(&clearances).unwrap();
        assert!(warning.ends_with("not in force: arm by 0.012 m at 612 s"), "{warning}");
        let table = clearance_table(&clearances).to_string();
        let arm = table.lines().find(|line| line.starts_with("arm to target")).unwrap();
        let cells: Vec<&str> = arm.split_whitespace().skip(3).collect();
        assert_eq!(cells, ["-0.012", "612", "s", "link", "3"]);
        // By cells, as above: the distance's column is as wide as the longest of them.
        let bus = table.lines().find(|line| line.starts_with("bus to target")).unwrap();
        let cells: Vec<&str> = bus.split_whitespace().skip(3).collect();
        assert_eq!(cells, ["0.500", "1200", "s"]);
    }
}
