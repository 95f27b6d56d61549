//! What `remora plan` prints.

use super::{Align, Table, clearance_table, number, overlap_warning, residual_table, time};
use crate::formats::{PlanStatus, PlanVerdict};
use crate::planning::Planned;
use remora_core::model::{Mission, Refusal};
use remora_core::scp::IterationRecord;
use remora_core::stages::LINKS;
use std::path::Path;

/// What is said of a scenario that was refused before planning.
pub fn refusal_report(scenario: &str, refusal: &Refusal) -> String {
    format!("scenario {scenario}: infeasible\nverdict: not flyable, {refusal}\nno plan was made\n")
}

/// Verdict, stages, residuals, clearances and the path of the file.
pub fn plan_report(planned: &Planned, mission: &Mission<LINKS>, file: &Path) -> String {
    let plan = &planned.file;
    let (one, two) = (&plan.stage1, &plan.stage2);
    let mut stages = Table::new([
        ("stage", Align::Left),
        ("status", Align::Left),
        ("iterations", Align::Right),
        ("corrections", Align::Right),
        ("cost", Align::Right),
        ("time", Align::Right),
    ]);
    let mut stage = |name: &str, status: PlanStatus, counts: [u64; 2], cost: f64, time_s: f64| {
        let [iterations, corrections] = counts.map(|n| n.to_string());
        let cells = [name.into(), status.to_string(), iterations, corrections, number(cost)];
        let [name, status, iterations, corrections, cost] = cells;
        stages.row([name, status, iterations, corrections, cost, time(time_s)]);
    };
    let (c1, c2) = planned.corrections;
    stage("1 translation", one.status, [one.iterations, c1], one.cost, one.time_s);
    stage("2 reorientation", two.status, [two.iterations, c2], two.cost, two.time_s);
    format!(
        "scenario {}: {}\nverdict: {}\n{} mode, {}, {}, {}\n\n{stages}\n{}\n{}\nwritten: {}\n",
        plan.scenario,
        plan.status,
        verdict(planned),
        plan.mode.name(),
        start(planned),
        plan.integrator,
        plan.qp,
        residual_table(&plan.residuals, &mission.tolerances),
        clearances(planned, mission),
        file.display(),
    )
}

/// The verdict in words, and what a plan that is not flyable fails by.
fn verdict(planned: &Planned) -> String {
    let verdict = planned.file.verdict.unwrap_or(PlanVerdict::NotFlyable);
    match planned.reason {
        None => verdict.words().into(),
        Some(residual) => {
            format!("{}, {residual} is farthest beyond its tolerance", verdict.words())
        }
    }
}

/// How near bodies come to each other, with a warning where that is too near and not judged.
fn clearances(planned: &Planned, mission: &Mission<LINKS>) -> String {
    let plan = &planned.file;
    let Some(clearances) = &plan.clearances else { return String::new() };
    let mut out = clearance_table(clearances).to_string();
    if !mission.approach.clearance.is_on(plan.integrator.core())
        && let Some(warning) = overlap_warning(clearances)
    {
        out.push_str(&warning);
        out.push('\n');
    }
    out
}

/// What Stage 2 started from, and why not from what was asked for.
fn start(planned: &Planned) -> String {
    let evidence = &planned.evidence;
    let Some(model) = &evidence.model else { return "heuristic start".into() };
    let reason = model.refused.as_deref().or(evidence.start.why());
    match reason {
        None => format!("start from {}", model.name),
        Some(reason) => format!("heuristic start instead of {}: {reason}", model.name),
    }
}

/// The iteration log of a stage, a line an iteration.
pub fn iteration_log(title: &str, log: &[IterationRecord]) -> String {
    let right = Align::Right;
    let mut table = Table::new([
        ("it", right),
        ("cost", right),
        ("penalty", right),
        ("ratio", right),
        ("radius", right),
        ("weight", right),
        ("worst", right),
        ("", Align::Left),
        ("QP it", right),
        ("corr", right),
        ("QP status", Align::Left),
        ("time", right),
    ]);
    for (i, record) in log.iter().enumerate() {
        table.row([
            (i + 1).to_string(),
            number(record.cost),
            format!("{:.1e}", record.penalty),
            ratio(record.ratio),
            format!("{:.1e}", record.radius),
            format!("{:.0e}", record.weight),
            format!("{:.1e}", record.violation),
            if record.accepted { "+" } else { "-" }.into(),
            record.qp_iterations.to_string(),
            record.corrections.to_string(),
            words(&format!("{:?}", record.qp_status)),
            time(record.time_s),
        ]);
    }
    format!("{title} (+ step taken; worst: largest violation over its tolerance)\n{table}\n")
}

/// Where the time went, and the record of evidence, a line each.
pub fn evidence(planned: &Planned) -> String {
    let (t, e) = (&planned.times, &planned.evidence);
    let phases = [
        ("start", t.start_s),
        ("of it inference", t.inference_s),
        ("stage 1", t.translation_s),
        ("linearise", t.linearise_s),
        ("qp", t.qp_s),
        ("steps", t.step_s),
        ("verify", t.verify_s),
        ("total", t.total_s),
    ];
    let phases = phases.map(|(name, seconds)| format!("{name} {}", time(seconds))).join(", ");
    format!(
        "time: {phases}\nversions: core {}, host {}\nchecksums: input {}, settings {}, output {}\n\n",
        e.core_version, e.host_version, e.input, e.settings, e.output,
    )
}

fn ratio(ratio: f64) -> String {
    if ratio.abs() < 1000.0 { format!("{ratio:.3}") } else { format!("{ratio:.1e}") }
}

/// `ReducedAccuracy` as `reduced accuracy`.
fn words(camel: &str) -> String {
    let mut out = String::new();
    for c in camel.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push(' ');
        }
        out.extend(c.to_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_statuses_become_words() {
        assert_eq!(words("ReducedAccuracy"), "reduced accuracy");
        assert_eq!(words("Solved"), "solved");
    }

    #[test]
    fn the_log_fits_a_hundred_columns() {
        let record = IterationRecord {
            cost: -1.234e-12,
            penalty: 1.5e-10,
            ratio: -1000.5,
            radius: 1e-3,
            weight: 1e6,
            violation: 1e10,
            accepted: true,
            qp_iterations: 300,
            qp_status: remora_core::qp::QpStatus::NumericalFailure,
            time_s: 0.1234,
            ..Default::default()
        };
        let text = iteration_log("Stage 1", &[record]);
        assert!(text.lines().all(|line| line.len() <= 100), "{text}");
    }
}
