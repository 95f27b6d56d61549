//! Report of `remora export --format qp`.

use super::Table;
use remora_host::export::QpExport;
use std::path::Path;

/// Reports what was written, and how well its solver did.
pub fn export_report(exported: &QpExport, directory: &Path) -> String {
    let plan = &exported.planned.file;
    let mut table =
        Table::new("stage | >programs | >corrections | >unsolved | >largest KKT residual");
    for (name, stage) in ["1 translation", "2 reorientation"].into_iter().zip(&exported.stages) {
        table.row([
            name.into(),
            stage.programs.to_string(),
            stage.corrections.to_string(),
            stage.unsolved.to_string(),
            format!("{:.1e}", stage.kkt.worst()),
        ]);
    }
    format!(
        "scenario {}: {}\n{} mode, {} start, {}, {}\n\n{table}\nwritten: {}\n",
        plan.scenario,
        plan.status,
        plan.mode.name(),
        plan.warm_start,
        plan.integrator,
        plan.qp,
        directory.display(),
    )
}
