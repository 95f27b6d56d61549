//! Whole plans.

use crate::Memory;
use crate::board::{Board, InstructionClock, instructions_of};
use crate::output::Line;
use remora_core::dynamics::Integrator;
use remora_core::model::{Mission, Scenario};
use remora_core::pair::Sequential;
use remora_core::planner::{
    self, Environment, Options, PhaseTimes, Report, StageEvidence, StageReport, Start,
};
use remora_core::stages::{LINKS, Mode};

/// Plans a scenario and prints result, residuals and the instructions of each phase.
pub fn run<B: Board>(
    board: &B,
    id: &str,
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    integrator: Integrator,
    memory: &mut Memory,
) {
    let options = Options::new(Mode::Optimal, integrator);
    let report = planner::plan(
        mission,
        scenario,
        &options,
        &mut Start::Heuristic,
        &mut memory.solver,
        &Environment { clock: &InstructionClock(board), pair: &Sequential },
        &mut memory.workspace,
    );
    print_result(board, id, mission, &report);
    print_phases(board, id, &report.times);
}

fn print_result<B: Board>(board: &B, id: &str, mission: &Mission<LINKS>, report: &Report) {
    let stage = |name: &str, stage: &StageReport, evidence: &StageEvidence| {
        Line::new(board, "stage")
            .text("scenario", id)
            .text("name", name)
            .number("status", stage.outcome.status.code().into())
            .number("iterations", evidence.iterations.into())
            .number("corrections", evidence.corrections.into())
            .number("qp_iterations", evidence.qp_iterations.into())
            .float("cost", stage.cost)
            .end();
    };
    let evidence = &report.evidence;
    stage("translation", &report.translation, &evidence.translation);
    stage("reorientation", &report.reorientation, &evidence.reorientation);
    Line::new(board, "plan")
        .text("scenario", id)
        .number("status", report.status.code().into())
        .number("verified", u64::from(evidence.is_verified))
        .bits("input", evidence.input)
        .bits("settings", evidence.settings)
        .bits("output", evidence.output)
        .end();
    for (name, value, _) in report.residuals.against(&mission.tolerances) {
        Line::new(board, "residual").text("scenario", id).float(name, value).end();
    }
}

/// Where the instructions went, by the planner's own phases.
fn print_phases<B: Board>(board: &B, id: &str, times: &PhaseTimes) {
    // The images start from the heuristic: no inference, which would be a part of the start.
    let PhaseTimes { start_s, inference_s: _, .. } = times;
    let PhaseTimes { translation_s, linearise_s, qp_s, step_s, verify_s, total_s, .. } = times;
    let named = start_s + translation_s + linearise_s + qp_s + step_s + verify_s;
    for (name, seconds) in [
        ("start", *start_s),
        ("translation", *translation_s),
        ("linearise", *linearise_s),
        ("qp", *qp_s),
        ("step", *step_s),
        ("verify", *verify_s),
        // Checksums, and what the loop does between the phases.
        ("rest", total_s - named),
        ("total", *total_s),
    ] {
        let line = Line::new(board, "phase").text("scenario", id).text("name", name);
        line.number("instructions", instructions_of(seconds)).end();
    }
}
