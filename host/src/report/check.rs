//! Report of `remora check`.

use super::{Table, clearance_table, residual_table};
use remora_host::checking::{Disagreement, PlanCheck, share};
use remora_host::formats::Verdict;
use std::fmt::Write;

/// All of one plan; of several a table, with what disagrees below it.
pub fn check_report(plans: &[PlanCheck]) -> String {
    match plans {
        [plan] => whole(plan),
        _ => overview(plans),
    }
}

fn whole(plan: &PlanCheck) -> String {
    let mut out = format!(
        "{}: scenario {}, {}\n\n{}\n{}\n",
        plan.file.display(),
        plan.scenario,
        plan.integrator,
        residual_table(&plan.residuals, &plan.tolerances),
        clearance_table(&plan.clearances),
    );
    for disagreement in &plan.disagreements {
        let _ = writeln!(out, "disagrees: {}: {}", disagreement.field, disagreement.reason);
    }
    let _ = writeln!(out, "verified: {}", if plan.is_verified { "yes" } else { "no" });
    match &plan.optimality {
        Some(found) => {
            let (one, two) = (share(found.stage1), share(found.stage2));
            let _ = writeln!(out, "locally optimal to: {one} in stage 1, {two} in stage 2");
        }
        None if plan.is_verified => out.push_str("no optimum was asked for: feasible mode\n"),
        None => {}
    }
    let _ = writeln!(out, "the file says: {}", plan.claimed);
    let why = plan
        .reason
        .map_or(String::new(), |residual| format!(", {residual} is farthest beyond its tolerance"));
    let but = if plan.disagreements.is_empty() { "" } else { ", but not what it says" };
    let _ = writeln!(out, "verdict: {}{why}{but}", found(plan));
    out
}

/// Verdict in words for the findings alone: the word optimal is the file's.
fn found(plan: &PlanCheck) -> String {
    match (plan.verdict, &plan.optimality) {
        (Verdict::Optimal, Some(_)) => "verified and locally optimal".into(),
        (Verdict::Optimal, None) => "verified and feasible".into(),
        (verdict, _) => verdict.to_string(),
    }
}

fn overview(plans: &[PlanCheck]) -> String {
    let mut table =
        Table::new("plan | verdict | integrator | nearest its tolerance | >of it | >arm | agrees");
    for plan in plans {
        let (name, share) = nearest(plan);
        let arm = plan.clearances.arm.distance;
        table.row([
            plan.file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into()),
            plan.verdict.to_string(),
            plan.integrator.to_string(),
            name.into(),
            if share == 0.0 { "0".into() } else { format!("{share:.1e}") },
            if arm.is_finite() { format!("{arm:.3} m") } else { "-".into() },
            if plan.disagreements.is_empty() { "yes" } else { "NO" }.into(),
        ]);
    }
    let mut out = format!("{table}\n");
    for plan in plans {
        for Disagreement { field, reason } in &plan.disagreements {
            let _ = writeln!(out, "disagrees: {}: {field}: {reason}", plan.file.display());
        }
    }
    let honest = plans.iter().filter(|plan| plan.disagreements.is_empty()).count();
    let count = |verdict| plans.iter().filter(|plan| plan.verdict == verdict).count();
    let counts = Verdict::ALL.map(|verdict| format!("{} {verdict}", count(verdict)));
    let _ = writeln!(
        out,
        "{} plans: {}; {honest} in agreement with what was recomputed",
        plans.len(),
        counts.join(", "),
    );
    out
}

/// The residual that comes nearest to its tolerance or passes it farthest, over that tolerance.
fn nearest(plan: &PlanCheck) -> (&'static str, f64) {
    let rows = plan.residuals.against(&plan.tolerances);
    let shares = rows.map(|(name, value, tolerance)| match value.is_nan() {
        true => (name, f64::INFINITY),
        false => (name, value / tolerance),
    });
    shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
}
