//! The planner of the host: one plan after the other.

use crate::approach::Approach;
use crate::engine::{AnyArmEngine, ArmSubproblem, Build, DefaultArmEngine, Engine, Task};
use crate::formats::{
    self, ArmClearances, EvidenceFile, Flight, Mission, NamedScenario, PlanFile, PlanGrid,
    PlanInputs, PlanStage1, PlanStage2, PlanTarget, Program, Row, StageEnd,
};
use crate::guess::Guess;
use crate::learned::{Learned, Memories};
use crate::memory::on_heap;
use crate::method::{Integrator, Method};
use crate::stopwatch::{Spent, Stopwatch};
use crate::threads::Threads;
use remora_core::advanced::model::Refusal;
use remora_core::advanced::planner::{PhaseTimes, Report, StageReport};
use remora_core::advanced::scp::IterationRecord;
use remora_core::advanced::stages::{LINKS, size};
use remora_core::advanced::time::Clock;
use std::time::Instant;

/// The clock of a desktop: seconds since it was made.
#[derive(Clone, Copy, Debug)]
pub struct WallClock(Instant);

impl WallClock {
    /// A clock that starts now.
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for WallClock {
    fn seconds(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
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
}

/// One subproblem of a plan for the built-in mission's arm with its solver's answer.
pub type Subproblem<'a> = ArmSubproblem<'a, { size::NX }, { size::NU }>;

/// A planner with its memory, for one plan after the other and arms of one to seven joints.
pub struct Planner {
    usual: DefaultArmEngine,
    /// For arms of other numbers of joints, once there was one.
    roomy: Option<Box<AnyArmEngine>>,
    threads: Threads,
    memories: Memories,
    is_scrubbed: bool,
}

impl Planner {
    /// A planner that has planned nothing yet. To be called with [`STACK_BYTES`](crate::memory::STACK_BYTES) of stack.
    pub fn new() -> Self {
        Self {
            usual: Engine::default(),
            roomy: None,
            threads: Threads::default(),
            memories: Memories::default(),
            is_scrubbed: false,
        }
    }

    /// Sets the number of threads for each plan; the plans stay the same.
    pub fn with_threads(self, threads: Threads) -> Self {
        Self { threads, ..self }
    }

    /// Sets whether planning holds constant data against checksums and verifies twice; the plans stay
    /// the same.
    pub fn scrubbing(self, is_scrubbed: bool) -> Self {
        Self { is_scrubbed, ..self }
    }

    /// Plans one scenario, with `model` for a learned start; none is the heuristic. The result
    /// does not depend on what was planned before.
    ///
    /// Where the status is other than solved, the file holds the best iterate.
    pub fn plan(
        &mut self,
        mission: &Mission,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
    ) -> PlanOutcome {
        self.plan_by(&WallClock::start(), mission, scenario, method, model)
    }

    /// Plans with the embedded solver and leaves the plan where it is: what flies, and nothing else.
    /// No memory is asked for once the same method has planned before.
    pub fn plan_in_place(
        &mut self,
        mission: &Mission,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
    ) -> Report {
        let clock = &WallClock::start();
        let scenario = &scenario.scenario();
        let Self { usual, roomy, threads, memories, is_scrubbed } = self;
        let is_scrubbed = *is_scrubbed;
        let guess = model.into();
        let task =
            Task { clock, threads, guess, joints: mission.joints(), memories, is_scrubbed, method };
        match mission.joints() {
            LINKS => usual.plan_in_place(mission, scenario, task),
            _ => room(roomy).plan_in_place(mission, scenario, task),
        }
    }

    /// Plans by another clock, which may count what it likes, and end the plan's time when it
    /// likes. The first it is asked is when the plan begins.
    pub fn plan_by(
        &mut self,
        clock: &dyn Clock,
        mission: &Mission,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
    ) -> PlanOutcome {
        self.plan_from(clock, mission, scenario, method, model.into())
    }

    /// Plans by another clock from any guess.
    pub fn plan_from(
        &mut self,
        clock: &dyn Clock,
        mission: &Mission,
        scenario: &NamedScenario,
        method: &Method,
        guess: Guess<'_>,
    ) -> PlanOutcome {
        let request = PlanRequest { mission, scenario, method, guess };
        let Self { usual, roomy, threads, memories, is_scrubbed } = self;
        let is_scrubbed = *is_scrubbed;
        let task =
            Task { clock, threads, guess, joints: mission.joints(), memories, is_scrubbed, method };
        match mission.joints() {
            LINKS => request.planned(usual, task, &mut |_| ()),
            _ => request.planned(room(roomy), task, &mut |_| ()),
        }
    }

    /// Plans for the built-in mission's arm by another clock; `watch` sees each subproblem once it is
    /// solved.
    ///
    /// # Panics
    /// An arm of another number of joints: callers refuse it before.
    pub fn plan_watched(
        &mut self,
        clock: &dyn Clock,
        mission: &Mission,
        scenario: &NamedScenario,
        method: &Method,
        guess: Guess<'_>,
        watch: &mut dyn FnMut(Subproblem<'_>),
    ) -> PlanOutcome {
        assert_eq!(mission.joints(), LINKS, "subproblems are watched for the built-in arm alone");
        let request = PlanRequest { mission, scenario, method, guess };
        let Self { usual, threads, memories, is_scrubbed, .. } = self;
        let is_scrubbed = *is_scrubbed;
        let task =
            Task { clock, threads, guess, joints: mission.joints(), memories, is_scrubbed, method };
        request.planned(usual, task, watch)
    }

    /// Plans Stage 1 alone: the approach as a guess of Stage 2 sees it.
    ///
    /// # Errors
    /// A scenario that is refused before planning.
    pub fn approach(
        &mut self,
        mission: &Mission,
        scenario: &NamedScenario,
        integrator: Integrator,
    ) -> Result<Approach, Refusal> {
        let (mission, scenario) = (*mission, scenario.scenario());
        match mission.joints() {
            LINKS => Approach::plan(&mut self.usual, mission, scenario, integrator),
            _ => Approach::plan(room(&mut self.roomy), mission, scenario, integrator),
        }
    }
}

/// The engine with room for any arm, made where there was no need of it yet.
fn room(roomy: &mut Option<Box<AnyArmEngine>>) -> &mut AnyArmEngine {
    roomy.get_or_insert_with(|| on_heap(Engine::default))
}

/// A plan that is asked for.
struct PlanRequest<'a> {
    mission: &'a Mission,
    scenario: &'a NamedScenario,
    method: &'a Method,
    guess: Guess<'a>,
}

impl PlanRequest<'_> {
    /// Has an engine plan, and puts the plan together.
    fn planned<const M: usize, const NX: usize, const NU: usize>(
        &self,
        engine: &mut Engine<M, NX, NU>,
        task: Task<'_>,
        watch: &mut dyn FnMut(ArmSubproblem<'_, NX, NU>),
    ) -> PlanOutcome
    where
        Engine<M, NX, NU>: Build<M, NX, NU>,
    {
        let Self { mission, scenario, method, guess } = *self;
        let watched = Stopwatch::start();
        let report = engine.plan(mission, &scenario.scenario(), task, watch);
        let spent = watched.spent();
        let file = self.file(engine, &report, &spent);
        let (translation, reorientation) = (&report.translation, &report.reorientation);
        let (log1, log2) = engine.workspace.logs();
        PlanOutcome {
            reason: file.residuals.worst(&mission.tolerances),
            flight: Flight::new(mission, scenario, &file),
            file,
            arm: report.arm,
            refusal: report.refusal,
            corrections: [translation, reorientation].map(|stage| stage.outcome.corrections as u64),
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

    /// The plan file of what the engine's workspace holds.
    fn file<const M: usize, const NX: usize, const NU: usize>(
        &self,
        engine: &Engine<M, NX, NU>,
        report: &Report,
        spent: &Spent,
    ) -> PlanFile {
        let Self { mission, scenario, method, .. } = *self;
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
}

impl Default for Planner {
    fn default() -> Self {
        Self::new()
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
