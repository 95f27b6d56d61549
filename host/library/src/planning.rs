//! From a scenario to a plan file: the only module that calls the core's planner.

use crate::backend::{ClarabelQp, Recorder, Solve};
use crate::error::Error;
use crate::formats::{
    self, EvidenceFile, Flight, NamedScenario, PlanFile, PlanGrid, PlanInputs, PlanStage1,
    PlanStage2, PlanTarget, Program, Row, StageEnd,
};
use crate::learned::{Learned, Memories};
use crate::memory::{on_heap, on_large_stack};
use crate::method::{Deadline, Method, Qp};
use crate::stopwatch::{Spent, Stopwatch};
use crate::threads::Threads;
use remora_core::advanced::model::{Mission, Refusal, Scenario};
use remora_core::advanced::planner::{
    self, EmbeddedSolver, Gain, InitialGuess, Options, PhaseTimes, PlanSettings, Platform, Report,
    Solver, StageReport, Workspace,
};
use remora_core::advanced::scp::IterationRecord;
use remora_core::advanced::stages::{LINKS, NODES, size};
use remora_core::advanced::time::Clock;
use std::path::PathBuf;
use std::time::Instant;

/// Seed of learned starts that draw.
pub const SEED: u64 = 0;

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
pub struct Planned {
    /// The plan.
    pub file: PlanFile,
    /// What a plan that is not flyable fails by: the residual farthest beyond its tolerance.
    pub reason: Option<&'static str>,
    /// Second-order corrections of stages 1 and 2.
    pub corrections: [u64; 2],
    /// How hard the scenario is and what the plan asks of the servicer.
    pub flight: Flight,
    /// Where the time went.
    pub times: PhaseTimes,
    /// The record to file with the plan, with the gains to track it.
    pub evidence: EvidenceFile,
    /// Iteration logs of stages 1 and 2.
    pub logs: [Vec<IterationRecord>; 2],
}

impl Planned {
    /// The campaign's row of this plan.
    pub fn row(&self) -> Row {
        Row::new(&self.file, self.corrections, self.reason, self.flight)
    }
}

/// One subproblem of a plan with its solver's answer.
pub type Subproblem<'a> = Solve<'a, NODES, { size::NX }, { size::NU }, { size::NG }>;

/// A planner with its memory, for one plan after the other. About 1 MiB on the heap with the
/// embedded solver, and a few more once Clarabel has planned.
pub struct Planner {
    workspace: Box<Workspace>,
    embedded: Box<EmbeddedSolver>,
    clarabel: ClarabelQp,
    threads: Threads,
    memories: Memories,
}

impl Planner {
    /// A planner that has planned nothing yet. To be called with [`STACK_BYTES`](crate::memory::STACK_BYTES) of stack.
    pub fn new() -> Self {
        Self {
            workspace: on_heap(Workspace::new),
            embedded: on_heap(EmbeddedSolver::new),
            clarabel: ClarabelQp::default(),
            threads: Threads::default(),
            memories: Memories::default(),
        }
    }

    /// The same with this many threads for each plan; the plans stay the same.
    pub fn with_threads(self, threads: Threads) -> Self {
        Self { threads, ..self }
    }

    /// Plans one scenario, with `model` for a learned start; none is the heuristic. The result
    /// does not depend on what was planned before.
    ///
    /// Where the status is other than solved, the file holds the best iterate.
    pub fn plan(
        &mut self,
        mission: &Mission<LINKS>,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
    ) -> Planned {
        self.plan_watched(mission, scenario, method, model, &mut |_| ())
    }

    /// Plans with the embedded solver and leaves the plan where it is: what flies, and nothing else.
    /// No memory is asked for once the same method has planned before.
    pub fn plan_in_place(
        &mut self,
        mission: &Mission<LINKS>,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
    ) -> Report {
        let Self { workspace, embedded, threads, memories, .. } = self;
        let clock = &WallClock::start();
        let place = Place { clock, threads, model, memories, workspace };
        run(mission, scenario, method, &mut **embedded, place)
    }

    /// The same, with somebody who looks at each subproblem once it has been solved.
    pub fn plan_watched(
        &mut self,
        mission: &Mission<LINKS>,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
        watch: &mut dyn FnMut(Subproblem<'_>),
    ) -> Planned {
        self.plan_by(&WallClock::start(), mission, scenario, method, model, watch)
    }

    /// The same by another clock, which may count what it likes, and end the plan's time when it
    /// likes. The first it is asked is when the plan begins.
    pub fn plan_by(
        &mut self,
        clock: &dyn Clock,
        mission: &Mission<LINKS>,
        scenario: &NamedScenario,
        method: &Method,
        model: Option<&Learned>,
        watch: &mut dyn FnMut(Subproblem<'_>),
    ) -> Planned {
        let Self { workspace, embedded, clarabel, threads, memories } = self;
        let place = Place { clock, threads, model, memories, workspace };
        let watched = Stopwatch::start();
        let solver: &mut dyn Solver = match method.qp {
            Qp::Embedded => &mut **embedded,
            Qp::Clarabel => clarabel,
        };
        let mut solver = Recorder::new(solver, watch);
        let report = run(mission, scenario, method, &mut solver, place);
        let last = mission.grid(&scenario.scenario()).last();
        let gains = gains(mission, last, &report, &solver);
        let spent = watched.spent();
        let file = self.file(mission, scenario, method, &report, &spent);
        let (translation, reorientation) = (&report.translation, &report.reorientation);
        let (log1, log2) = self.workspace.logs();
        Planned {
            reason: file.residuals.worst(&mission.tolerances),
            flight: Flight::new(mission, scenario, &file),
            file,
            corrections: [translation, reorientation].map(|stage| stage.outcome.corrections as u64),
            times: report.times,
            evidence: EvidenceFile::new(
                &scenario.id,
                method.qp.name(),
                model.map(Learned::record),
                &report.record,
                gains,
            ),
            logs: [log1.to_vec(), log2.to_vec()],
        }
    }

    /// The plan file of what the workspace holds.
    fn file(
        &self,
        mission: &Mission<LINKS>,
        scenario: &NamedScenario,
        method: &Method,
        report: &Report,
        spent: &Spent,
    ) -> PlanFile {
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
            inputs: Some(PlanInputs::new(mission, scenario, method.integrator)),
            grid: Some(grid),
            frames: Some(formats::frames()),
            stage1: PlanStage1::new(end(translation), nodes, self.workspace.translation()),
            stage2: PlanStage2::new(
                end(reorientation),
                report.times.inference_s,
                nodes,
                self.workspace.reorientation(),
            ),
            target: PlanTarget::from(&self.workspace.target[..nodes]),
            residuals: report.residuals,
            clearances: Some(report.clearances),
        }
    }
}

/// Where a plan is made.
struct Place<'a> {
    clock: &'a dyn Clock,
    threads: &'a Threads,
    model: Option<&'a Learned>,
    memories: &'a mut Memories,
    workspace: &'a mut Workspace,
}

/// The solver that flies, on the heap and called through a pointer: its code, too, is compiled once.
pub fn embedded_solver() -> Box<dyn Solver + Send> {
    on_heap(EmbeddedSolver::new)
}

/// [`planner::plan`] with a solver known at run time: its code is compiled once for all solvers.
pub fn plan_with(
    mission: &Mission<LINKS>,
    scenario: &Scenario,
    options: &Options<'_, Threads>,
    mut solver: &mut dyn Solver,
    workspace: &mut Workspace,
) -> Report {
    planner::plan(mission, scenario, options, &mut solver, workspace)
}

/// The call into the core.
fn run(
    mission: &Mission<LINKS>,
    scenario: &NamedScenario,
    method: &Method,
    solver: &mut dyn Solver,
    place: Place<'_>,
) -> Report {
    place.threads.prepare();
    let platform = Platform { clock: place.clock, executor: place.threads };
    let mut planned = |start: &InitialGuess<'_>| {
        let options = Options::from_parts(options(method), *start, platform);
        plan_with(mission, &scenario.scenario(), &options, solver, place.workspace)
    };
    match place.model {
        None => planned(&InitialGuess::Heuristic),
        Some(model) => model.at_work(place.memories, |policy| match policy {
            None => planned(&InitialGuess::Refused),
            Some(policy) => planned(&InitialGuess::Learned { policy, seed: SEED }),
        }),
    }
}

impl Default for Planner {
    fn default() -> Self {
        Self::new()
    }
}

/// The gains of all intervals, where the solver has them.
fn gains(
    mission: &Mission<LINKS>,
    intervals: usize,
    report: &Report,
    solver: &dyn Solver,
) -> Option<Vec<Gain>> {
    // Where Stage 2 solved nothing, the solver's last program was Stage 1's.
    if report.reorientation.outcome.iterations == 0 {
        return None;
    }
    (0..intervals).map(|k| planner::feedback_gain(mission, solver, k)).collect()
}

fn end(stage: &StageReport) -> StageEnd {
    StageEnd {
        status: stage.outcome.status,
        iterations: stage.outcome.iterations as u64,
        cost: stage.cost,
        time_s: stage.time_s,
    }
}

/// What makes a scenario impossible to plan, as far as that is known before planning.
///
/// # Errors
/// A scenario that is no input at all, by its id.
pub fn refusal(
    mission: &Mission<LINKS>,
    scenario: &NamedScenario,
    method: &Method,
) -> Result<Option<Refusal>, Error> {
    match mission.check::<NODES>(&scenario.scenario(), method.integrator) {
        Ok(()) => Ok(None),
        Err(refusal) if refusal.is_invalid_input() => {
            Err(Error::Scenario { id: scenario.id.clone(), reason: refusal.to_string() })
        }
        Err(refusal) => Ok(Some(refusal)),
    }
}

/// The core's options for a method.
fn options(method: &Method) -> PlanSettings {
    let deadline_s = method.deadline.map_or(f64::INFINITY, Deadline::seconds);
    PlanSettings { deadline_s, ..PlanSettings::new(method.mode, method.integrator) }
}

/// All settings that a method stands for, as text: two runs with the same text plan the same,
/// as far as no deadline passes.
pub fn settings_text(method: &Method) -> String {
    format!("{:?}", options(method))
}

/// One plan to be made and written: the input of `remora plan`.
#[derive(Clone, Debug)]
pub struct PlanJob {
    /// The scenario.
    pub scenario: NamedScenario,
    /// The mission; valid.
    pub mission: Mission<LINKS>,
    /// How to plan.
    pub method: Method,
    /// Model of a learned start; none is the heuristic.
    pub model: Option<Learned>,
    /// How many threads work on it; the plan stays the same.
    pub threads: Threads,
    /// Where to write the plan.
    pub out: PathBuf,
}

impl PlanJob {
    /// What makes the plan impossible, if it is; then there is nothing to run.
    ///
    /// # Errors
    /// A scenario that is no input at all.
    pub fn refusal(&self) -> Result<Option<Refusal>, Error> {
        refusal(&self.mission, &self.scenario, &self.method)
    }

    /// Makes the plan and writes its file, whatever its status, and its evidence beside it.
    ///
    /// # Errors
    /// Where a file cannot be written; that is found out before planning.
    pub fn run(&self) -> Result<Planned, Error> {
        let evidence = formats::evidence_path(&self.out);
        formats::check_writable(&self.out)?;
        formats::check_writable(&evidence)?;
        let planned = self.plan()?;
        planned.evidence.write(&evidence)?;
        planned.file.write(&self.out)?;
        Ok(planned)
    }

    /// Makes the plan and writes nothing.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn plan(&self) -> Result<Planned, Error> {
        on_large_stack(|| {
            let mut planner = Planner::new().with_threads(self.threads);
            planner.plan(&self.mission, &self.scenario, &self.method, self.model.as_ref())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::draw;
    use crate::formats::{ScenarioSet, Verdict};
    use crate::method::Integrator;

    #[test]
    fn nothing_that_can_be_planned_is_refused() {
        let mission = Mission::default();
        let public = ScenarioSet::built_in().unwrap().scenarios;
        let drawn = draw(300, 1, &mission).unwrap().scenarios;
        for integrator in [Integrator::Euler, Integrator::RK4] {
            let method = Method { integrator, ..Method::default() };
            for scenario in public.iter().chain(&drawn) {
                let refusal = refusal(&mission, scenario, &method).unwrap();
                assert_eq!(refusal, None, "{}", scenario.id);
            }
        }
    }

    /// Missions a little beyond a bound are refused, and the planner does not solve them either.
    #[test]
    fn what_is_refused_is_not_solved() {
        let scenario = ScenarioSet::built_in().unwrap().scenarios[0].clone();
        let euler = Method { integrator: Integrator::Euler, ..Method::default() };
        let integrator = euler.integrator;
        let needs = Mission::default().needs::<NODES>(&scenario.scenario(), integrator).unwrap();
        let time =
            Mission::default().time_to_preset(euler.integrator, &Mission::default().own_grid());
        let travel = 0.877_268_9;
        type Change<'a> = &'a dyn Fn(&mut Mission<LINKS>);
        let cases: [(&str, Change<'_>); 4] = [
            ("joint_rate", &|m| m.servicer.max_joint_rate.fill(0.98 * travel / time)),
            ("force", &|m| m.servicer.max_force.fill(0.98 * needs.force)),
            ("keep_out", &|m| m.approach.keep_out_far = 9.0),
            // Angles that the pointing tolerance lets pass are not refused.
            ("field_of_view", &|m| {
                m.approach.field_of_view_half_angle = 1e-3;
                m.tolerances.pointing = 1e-9;
            }),
        ];
        for (name, change) in cases {
            let mut mission = Mission::default();
            change(&mut mission);
            let refusal = refusal(&mission, &scenario, &euler).unwrap().expect(name);
            assert!([name, "capture_view"].contains(&refusal.name()), "{refusal}");
            let plan = || Planner::new().plan(&mission, &scenario, &euler, None);
            let planned = on_large_stack(plan).unwrap();
            assert_eq!(planned.file.verdict, Some(Verdict::NotFlyable), "{refusal}");
            assert!(planned.reason.is_some());
        }
    }
}
