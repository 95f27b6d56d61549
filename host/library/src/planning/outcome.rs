//! A plan that was made, with what its file does not hold.

use crate::engine::{ArmSubproblem, Build, Engine};
use crate::error::Error;
use crate::formats::{
    self, ArmClearances, EvidenceFile, Flight, NamedScenario, PlanFile, PlanGrid, PlanInputs,
    PlanStage1, PlanStage2, PlanTarget, Program, Row, StageEnd, evidence_path,
};
use crate::learned::Learned;
use crate::request::PlanRequest;
use crate::stopwatch::{Spent, Stopwatch};
use remora_core::advanced::model::Refusal;
use remora_core::advanced::planner::{PhaseTimes, Report, StageReport};
use remora_core::advanced::scp::IterationRecord;
use remora_core::advanced::time::Clock;
use std::path::Path;

/// Finds out before planning whether a plan and its evidence could be written.
///
/// # Errors
/// The file that cannot be, with the reason.
pub fn check_writable(plan: &Path) -> Result<(), Error> {
    formats::check_writable(plan)?;
    formats::check_writable(&evidence_path(plan))
}

/// A plan with what its file does not hold.
#[derive(Clone, Debug)]
pub struct PlanOutcome {
    /// The plan.
    pub file: PlanFile,
    /// Reason why there is none, where damage was found while it was made.
    pub refusal: Option<Refusal>,
    /// Residual farthest beyond its tolerance, where the plan is not flyable.
    pub reason: Option<&'static str>,
    /// Second-order corrections of stages 1 and 2.
    pub corrections: [u64; 2],
    /// How hard the scenario is and what the plan asks of the servicer.
    pub flight: Flight,
    /// Smallest distance of each part of the arm from the target.
    pub arm: ArmClearances,
    /// Where the time went.
    pub times: PhaseTimes,
    /// The record to file with the plan.
    pub evidence: EvidenceFile,
    /// Iteration logs of stages 1 and 2.
    pub logs: [Vec<IterationRecord>; 2],
}

impl PlanOutcome {
    /// The campaign's row of this plan.
    pub fn row(&self) -> Row {
        let row = Row::new(&self.file, self.corrections, self.reason, self.flight, &self.arm);
        Row { plan_checksum: self.evidence.output.clone(), ..row }
    }

    /// Writes the plan, whatever its status, and its evidence beside it; nothing of a plan that was refused
    /// because something was damaged.
    ///
    /// # Errors
    /// The file that cannot be written, with the reason; then neither is.
    pub fn write(&self, plan: &Path) -> Result<(), Error> {
        match self.refusal {
            Some(_) => Ok(()),
            None => self.evidence.write_with(&self.file, plan),
        }
    }

    /// Has an engine plan, and puts the plan together.
    pub(super) fn make<const M: usize, const NX: usize, const NU: usize>(
        engine: &mut Engine<M, NX, NU>,
        clock: &dyn Clock,
        request: &PlanRequest,
        scenario: &NamedScenario,
        watch: &mut dyn FnMut(ArmSubproblem<'_, NX, NU>),
    ) -> Self
    where
        Engine<M, NX, NU>: Build<M, NX, NU>,
    {
        let watched = Stopwatch::start();
        let report = engine.run(clock, request, &scenario.scenario(), watch);
        let file = file(engine, request, scenario, &report, &watched.spent());
        let PlanRequest { mission, method, guess, .. } = request;
        let stages = [&report.translation, &report.reorientation];
        let (log1, log2) = engine.workspace.logs();
        Self {
            reason: file.residuals.worst(&mission.tolerances),
            flight: Flight::new(mission, scenario, &file),
            file,
            arm: report.arm,
            refusal: report.refusal,
            corrections: stages.map(|stage| stage.outcome.corrections as u64),
            times: report.times,
            evidence: EvidenceFile::new(
                &scenario.id,
                method.qp.name(),
                guess.model().map(Learned::record),
                &report.record,
            ),
            logs: [log1.to_vec(), log2.to_vec()],
        }
    }
}

/// The plan file of what the engine's workspace holds.
fn file<const M: usize, const NX: usize, const NU: usize>(
    engine: &Engine<M, NX, NU>,
    request: &PlanRequest,
    scenario: &NamedScenario,
    report: &Report,
    spent: &Spent,
) -> PlanFile {
    let PlanRequest { mission, method, .. } = request;
    let (translation, reorientation) = (&report.translation, &report.reorientation);
    let grid = PlanGrid::of(mission, &scenario.scenario());
    let nodes = grid.nodes;
    PlanFile {
        format: formats::PLAN_FORMAT.into(),
        program: Some(Program::this()),
        scenario: scenario.id.clone(),
        status: report.status,
        verdict: Some(report.verdict()),
        mode: method.mode,
        warm_start: report.record.start.in_tables().into(),
        qp: method.qp.name().into(),
        integrator: method.integrator,
        time_s: Some(spent.wall_s),
        cpu_time_s: spent.cpu_s,
        inputs: PlanInputs::new(mission, scenario, method.integrator),
        grid,
        frames: Some(formats::frames()),
        stage1: PlanStage1::new(end(translation), nodes, engine.workspace.translation()),
        stage2: PlanStage2::new(
            end(reorientation),
            report.times.inference_s,
            nodes,
            mission.joints(),
            &engine.reorientation(),
        ),
        target: PlanTarget::from(&engine.workspace.target[..nodes]),
        residuals: report.residuals,
        clearances: Some(report.clearances),
    }
}

fn end(stage: &StageReport) -> StageEnd {
    StageEnd {
        status: stage.outcome.status,
        iterations: stage.outcome.iterations as u64,
        cost: stage.cost,
        time_s: stage.time_s,
    }
}
