//! Whole plans.

use crate::board::{Board, InstructionClock, instructions_of};
use crate::output::{Line, print_stack};
use crate::start::with_start;
use crate::{Memory, Request, scenarios};
use core::hint::black_box;
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::model::Mission;
use remora_core::advanced::planner::{
    self, Options, PhaseTimes, PlanSettings, Platform, Report, StageReport, StageSolveRecord,
};
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::stages::{self, LINKS, Mode, Residuals};
use remora_core::advanced::time::Deadline;

/// Parts that plans are made with, in optimal mode with the tuned settings.
pub struct Plans<'a, B> {
    /// The board.
    pub board: &'a B,
    /// How they are to be made.
    pub request: Request,
    /// The learned start's model.
    pub file: &'a [u8],
    /// Working memory of planning.
    pub memory: &'a mut Memory,
}

impl<B: Board> Plans<'_, B> {
    /// Plans a scenario and prints result, residuals, the instructions of each phase and the stack. Then
    /// verifies the plan again and accepts it where input and residuals are those of planning's claim. Returns none
    /// where there is no such scenario.
    ///
    /// Both make mission and scenario anew, and planning its settings and the opened model too: damage to them
    /// ends with it.
    pub fn run(&mut self, index: usize) -> Option<()> {
        let claimed = self.plan(index)?;
        self.verify(index, claimed)
    }

    #[inline(never)]
    fn plan(&mut self, index: usize) -> Option<u64> {
        let Request { integrator, start, is_scrubbed, .. } = self.request;
        let Memory { workspace, solver, network, .. } = &mut *self.memory;
        let (id, scenario) = scenarios::all().nth(index)?;
        let board = self.board;
        let mission = scenarios::mission();
        let settings = PlanSettings::new(Mode::Optimal, integrator);
        Some(with_start(board, start, self.file, network, |start| {
            board.start_watchdog();
            board.paint_stack();
            let clock = InstructionClock::new(board);
            let platform = Platform { clock: &clock, executor: &Sequential };
            let options = Options::from_parts(settings, *start, platform).scrubbing(is_scrubbed);
            let report = planner::plan(&mission, &scenario, &options, solver, workspace);
            let longest = clock.longest_slice();
            print_stack(board, "plan");
            print_result(board, id, &mission, &report);
            print_longest_slice(board, id, longest);
            print_phases(board, id, &report.times);
            claim(&mission, report.record.input, &report.residuals)
        }))
    }

    #[inline(never)]
    fn verify(&self, index: usize, claimed: u64) -> Option<()> {
        let (id, scenario) = scenarios::all().nth(index)?;
        let board = self.board;
        let mission = scenarios::mission();
        let Memory { workspace, .. } = &*self.memory;
        let (path, motion) = (workspace.translation(), workspace.reorientation());
        board.paint_stack();
        let (integrator, deadline) = (black_box(self.request.integrator), Deadline::never());
        let again =
            stages::verify(&mission, &scenario, integrator, path, motion, &deadline).residuals;
        print_stack(board, "verify");
        let found = claim(&mission, planner::input_checksum(&mission, &scenario), &again);
        let line = Line::about(board, "verified", id).bits("claim", found);
        line.text("accepted", if claimed == found { "yes" } else { "no" }).end();
        Some(())
    }
}

/// The checksum of what a plan is said to be: for which input, and with which residuals.
fn claim(mission: &Mission<LINKS>, input: u64, residuals: &Residuals) -> u64 {
    let mut sum = Checksum::new();
    sum.integer(input);
    for (_, value, _) in residuals.against(&mission.tolerances) {
        sum.integer(value.to_bits());
    }
    sum.value()
}

fn print_result<B: Board>(board: &B, id: &str, mission: &Mission<LINKS>, report: &Report) {
    let stage = |name: &str, stage: &StageReport, evidence: &StageSolveRecord| {
        Line::about(board, "stage", id)
            .text("name", name)
            .number("status", stage.outcome.status.code().into())
            .number("iterations", evidence.iterations.into())
            .number("corrections", evidence.corrections.into())
            .number("qp_iterations", evidence.qp_iterations.into())
            .float("cost", stage.cost)
            .end();
    };
    let evidence = &report.record;
    stage("translation", &report.translation, &evidence.translation);
    stage("reorientation", &report.reorientation, &evidence.reorientation);
    Line::about(board, "plan", id)
        .number("status", report.status.code().into())
        .number("verified", u64::from(evidence.is_verified))
        .number("start", evidence.start.code().into())
        .bits("input", evidence.input)
        .bits("settings", evidence.settings)
        .bits("output", evidence.output)
        .end();
    for (name, value, _) in report.residuals.against(&mission.tolerances) {
        Line::about(board, "residual", id).float(name, value).end();
    }
}

/// The most instructions between two of the pauses in which a step of guidance could be made.
fn print_longest_slice<B: Board>(board: &B, id: &str, instructions: u32) {
    let line = Line::about(board, "most", id).text("name", "slice");
    line.number("calls", 1).number("instructions", instructions.into()).end();
}

/// Where the instructions went, by the planner's own phases.
fn print_phases<B: Board>(board: &B, id: &str, times: &PhaseTimes) {
    let PhaseTimes { start_s, inference_s, translation_s, linearise_s, .. } = times;
    let PhaseTimes { qp_s, step_s, verify_s, total_s, .. } = times;
    let named = start_s + translation_s + linearise_s + qp_s + step_s + verify_s;
    for (name, seconds) in [
        ("translation", *translation_s),
        // The tumble, and the heuristic where no model was asked.
        ("start", start_s - inference_s),
        ("inference", *inference_s),
        ("linearise", *linearise_s),
        ("qp", *qp_s),
        ("step", *step_s),
        ("verify", *verify_s),
        // Checksums, and what the loop does between the phases.
        ("rest", total_s - named),
        ("total", *total_s),
    ] {
        let line = Line::about(board, "phase", id).text("name", name);
        line.number("instructions", instructions_of(seconds)).end();
    }
}
