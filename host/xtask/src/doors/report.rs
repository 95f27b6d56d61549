//! Report of `cargo xtask replay`.

use super::replay::{Outcome, Replays, Row};
use remora_host::report::Table;

/// The doors, one a row.
pub fn replay_report(replays: &Replays) -> String {
    let mut table = Table::new("door | checksum |  | >time");
    for row in &replays.doors {
        let (checksum, said) = cells(row);
        table.row([row.door.into(), checksum, said, format!("{:.1} s", row.time_ms as f64 / 1e3)]);
    }
    let mut text = format!(
        "scenario {}, checksum of the file {}\n\n{table}",
        replays.scenario, replays.checksum
    );
    // Reasons are longer than a column.
    for row in &replays.doors {
        if let Some(reason) = &row.reason {
            text.push_str(&format!("\n{}: {reason}", row.door));
        }
    }
    if replays.doors.iter().any(|row| row.reason.is_some()) {
        text.push('\n');
    }
    text
}

fn cells(row: &Row) -> (String, String) {
    let said = match row.outcome {
        Outcome::Same => "same",
        Outcome::Differs => "DIFFERS",
        Outcome::Missing => "missing",
        Outcome::Failed => "FAILED",
    };
    (row.checksum.clone().unwrap_or_else(|| "-".into()), said.into())
}
