//! What `remora check` prints.

use super::{clearance_table, residual_table};
use remora_core::advanced::model::Tolerances;
use remora_host::checking::Verdict;
use std::fmt::Write;

/// A table and a verdict for each plan, and a count where there are several.
pub fn check_report(verdicts: &[Verdict], tolerances: &Tolerances) -> String {
    let mut out = String::new();
    for verdict in verdicts {
        let _ = writeln!(
            out,
            "{}: scenario {}, {}, says {}\n\n{}\n{}",
            verdict.file.display(),
            verdict.scenario,
            verdict.integrator,
            verdict.claimed,
            residual_table(&verdict.residuals, tolerances),
            clearance_table(&verdict.clearances),
        );
        for disagreement in &verdict.disagreements {
            let _ = writeln!(out, "disagrees: {}: {}", disagreement.field, disagreement.reason);
        }
        let word = if verdict.feasible { "feasible" } else { "NOT feasible" };
        let but = if verdict.disagreements.is_empty() { "" } else { ", but not what it says" };
        let _ = writeln!(out, "verdict: {word}{but}\n");
    }
    if verdicts.len() > 1 {
        let feasible = verdicts.iter().filter(|verdict| verdict.feasible).count();
        let honest = verdicts.iter().filter(|v| v.disagreements.is_empty()).count();
        let _ = writeln!(
            out,
            "{} plans: {feasible} feasible, {honest} in agreement with what was recomputed",
            verdicts.len(),
        );
    }
    out
}
