//! Whole plans.

use crate::board::{Board, InstructionClock, instructions_of};
use crate::output::Line;
use crate::{Memory, kernels};
use remora_core::dynamics::Integrator;
use remora_core::model::{Mission, Scenario};
use remora_core::planner::{self, Options, Report, StageReport};
use remora_core::qp::EmbeddedQp;
use remora_core::scp::Log;
use remora_core::stages::{LINKS, Mode, NODES, reorientation_size as two, translation_size as one};

/// Solver of Stage 1's subproblems.
pub type OneSolver = EmbeddedQp<NODES, { one::NX }, { one::NU }, { one::NR }>;
/// Solver of Stage 2's subproblems.
pub type TwoSolver = EmbeddedQp<NODES, { two::NX }, { two::NU }, { two::NR }>;

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
    let before = board.instructions();
    let report = planner::plan(
        mission,
        scenario,
        &options,
        (&mut memory.translation, &mut memory.reorientation),
        &InstructionClock(board),
        &mut memory.workspace,
    );
    let total = board.instructions().wrapping_sub(before);
    print_result(board, id, mission, &report, memory);
    print_phases(board, id, &report, memory.workspace.logs(), total);
}

fn print_result<B: Board>(
    board: &B,
    id: &str,
    mission: &Mission<LINKS>,
    report: &Report,
    memory: &Memory,
) {
    let stage = |name: &str, stage: &StageReport| {
        Line::new(board, "plan")
            .text("scenario", id)
            .text("stage", name)
            .number("status", stage.outcome.status.code().into())
            .number("iterations", stage.outcome.iterations as u64)
            .number("corrections", stage.outcome.corrections as u64)
            .float("cost", stage.cost)
            .end();
    };
    stage("translation", &report.translation);
    stage("reorientation", &report.reorientation);
    Line::new(board, "plan")
        .text("scenario", id)
        .number("status", report.status.code().into())
        .bits("path", kernels::path(memory.workspace.path()).value())
        .bits("motion", kernels::motion(memory.workspace.motion()).value())
        .end();
    for (name, value, _) in report.residuals.against(&mission.tolerances) {
        Line::new(board, "residual").text("scenario", id).float(name, value).end();
    }
}

/// Where the instructions went: the two stages' subproblems, what is around them, and the rest
/// (target's tumble, heuristic start, verifier).
fn print_phases<B: Board>(board: &B, id: &str, report: &Report, logs: (&Log, &Log), total: u64) {
    let solver = |log: &Log| instructions_of(log.iter().map(|record| record.qp_time_s).sum());
    let phase = |name: &str, instructions: u64| {
        let line = Line::new(board, "phase").text("scenario", id).text("name", name);
        line.number("instructions", instructions).end();
    };
    let (one, two) =
        (instructions_of(report.translation.time_s), instructions_of(report.reorientation.time_s));
    let (solver1, solver2) = (solver(logs.0), solver(logs.1));
    phase("translation_solver", solver1);
    phase("translation_rest", one.saturating_sub(solver1));
    phase("reorientation_solver", solver2);
    phase("reorientation_rest", two.saturating_sub(solver2));
    phase("other", total.saturating_sub(one).saturating_sub(two));
    phase("total", total);
}
