//! Report of `remora export`.

use super::Table;
use remora_export::job::ExportSummary;

/// The files, one a row.
pub fn exported_report(exported: &ExportSummary) -> String {
    let mut table = Table::new("file | >rows | >bytes");
    for file in &exported.files {
        table.row([file.file.display().to_string(), file.rows.to_string(), file.bytes.to_string()]);
    }
    format!("scenario {}, {:.0} s\n\n{table}", exported.scenario, exported.duration_s)
}
