//! Report of `remora plan`.

use super::{Table, clearance_table, number, overlap_warning, residual_table, time};
use remora_core::advanced::model::Refusal;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Mission, PlanFile, Status, Verdict, is_named_packet, json};
use remora_host::planning::PlanOutcome;
use remora_host::stopwatch::busy_share;
use std::path::Path;

/// Reports a scenario that was refused before planning, or because something was damaged meanwhile.
pub fn refusal_report(scenario: &str, refusal: &Refusal) -> String {
    let is_damaged = matches!(refusal, Refusal::Damaged { .. });
    let what = if is_damaged { "refused" } else { "infeasible" };
    format!("scenario {scenario}: {what}\nverdict: not flyable, {refusal}\nno plan was made\n")
}

/// Verdict, stages, residuals, clearances and the path of the file.
pub fn plan_report(planned: &PlanOutcome, mission: &Mission, file: &Path) -> String {
    let plan = &planned.file;
    let (translation, reorientation) = (&plan.stage1, &plan.stage2);
    let mut stages = Table::new("stage | status | >iterations | >corrections | >cost | >time");
    let mut stage = |name: &str, status: Status, counts: [u64; 2], cost: f64, time_s: f64| {
        let [iterations, corrections] = counts.map(|n| n.to_string());
        let cells = [name.into(), status.to_string(), iterations, corrections, number(cost)];
        let [name, status, iterations, corrections, cost] = cells;
        stages.row([name, status, iterations, corrections, cost, time(time_s)]);
    };
    let [c1, c2] = planned.corrections;
    stage(
        "1 translation",
        translation.status,
        [translation.iterations, c1],
        translation.cost,
        translation.time_s,
    );
    stage(
        "2 reorientation",
        reorientation.status,
        [reorientation.iterations, c2],
        reorientation.cost,
        reorientation.time_s,
    );
    format!(
        "scenario {}: {}\nverdict: {}\n{} mode, {}, {}, {}\n{}\n{stages}{}\n{}\n{}\nwritten: {}\n",
        plan.scenario,
        plan.status,
        verdict(planned),
        plan.mode.name(),
        start(planned),
        plan.integrator,
        plan.qp,
        recovered(planned, mission),
        spent(plan),
        residual_table(&plan.residuals, &mission.tolerances),
        clearances(planned, mission),
        file.display(),
    )
}

/// Sizes of a plan that was written as a packet, and of the same as JSON; nothing where it was not.
///
/// # Errors
/// None, as long as the tests pass.
pub fn packet_report(planned: &PlanOutcome, file: &Path) -> Result<String, Error> {
    if !is_named_packet(file) {
        return Ok(String::new());
    }
    let PlanOutcome { file: plan, evidence, .. } = planned;
    let failed = |error: FieldError| error.at(file);
    Ok(format!(
        "sizes: plan {} bytes, {} as JSON; evidence {} bytes, {} as JSON\n",
        plan.to_packet().map_err(failed)?.len(),
        json::to_text(plan).map_err(|error| Error::output(file, &error.into()))?.len(),
        evidence.to_packet().map_err(failed)?.len(),
        json::to_text(evidence).map_err(|error| Error::output(file, &error.into()))?.len(),
    ))
}

/// The limits that the start violates, and until when.
fn recovered(planned: &PlanOutcome, mission: &Mission) -> String {
    match planned.evidence.recovered.as_slice() {
        [] => String::new(),
        limits => {
            let time = mission.approach.recovery_s;
            format!("start beyond limits, led back: {} (within {time} s)\n", limits.join(", "))
        }
    }
}

/// Time of the whole plan, and whether something else was running on the machine.
fn spent(plan: &PlanFile) -> String {
    let Some(wall_s) = plan.time_s else { return String::new() };
    let Some(cpu_s) = plan.cpu_time_s else { return format!("whole plan: {}\n", time(wall_s)) };
    let busy = busy_share(wall_s, cpu_s).map_or(String::new(), |share| {
        format!("; the machine was busy: the plan had {:.0} % of a core", 100.0 * share)
    });
    format!("whole plan: {}, processor time {}{busy}\n", time(wall_s), time(cpu_s))
}

/// The verdict in words, and what a plan that is not flyable fails by.
fn verdict(planned: &PlanOutcome) -> String {
    let verdict = planned.file.verdict.unwrap_or(Verdict::NotFlyable);
    match planned.reason {
        None => verdict.to_string(),
        Some(residual) => {
            format!("{verdict}, {residual} is farthest beyond its tolerance")
        }
    }
}

/// How near bodies come to each other, with a warning where that is too near and not judged.
fn clearances(planned: &PlanOutcome, mission: &Mission) -> String {
    let plan = &planned.file;
    let Some(clearances) = &plan.clearances else { return String::new() };
    let mut out = clearance_table(clearances).to_string();
    if !mission.approach.clearance.is_on(plan.integrator)
        && let Some(warning) = overlap_warning(clearances)
    {
        out.push_str(&warning);
        out.push('\n');
    }
    out
}

/// Names the initial guess of Stage 2, and why it is not the one asked for.
fn start(planned: &PlanOutcome) -> String {
    let evidence = &planned.evidence;
    let Some(model) = &evidence.model else { return "heuristic start".into() };
    let reason = model.refused.as_deref().or(evidence.start.why());
    match reason {
        None => format!("start from {}", model.name),
        Some(reason) => format!("heuristic start instead of {}: {reason}", model.name),
    }
}

/// Where the time went, and the record of evidence, a line each.
pub fn evidence(planned: &PlanOutcome) -> String {
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
