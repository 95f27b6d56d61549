//! One planner with everything that can be struck.

use super::case::{Case, Fault};
use super::class::{Claim, Judge, Plan};
use super::reference::{Ended, Reference};
use super::strike::{Met, Program, ProgramStrike, StruckSolver, flip_start};
use crate::formats::NamedScenario;
use crate::planning::{SEED, on_heap};
use remora_core::model::Mission;
use remora_core::nn::{Memory, Model, Network, Strike, Upset};
use remora_core::pair::Sequential;
use remora_core::planner::{
    self, EmbeddedSolver, Environment, Options, Report, Start, StartRecord, Workspace,
    output_checksum,
};
use remora_core::qp::InteriorPointSettings;
use remora_core::scp::{Log, Problem, Status};
use remora_core::stages::{
    Formulation, LINKS, NODES, Reorientation, ReorientationTrajectory, size, verify,
};
use remora_core::time::Deadline;
use remora_core::warmstart::{Scene, roll_out};
use std::time::Instant;

/// Memory of the network as it flies.
type Flight = Memory<3, 96, NODES>;
/// Its width and tokens.
pub(super) const MEMORY: (usize, usize) = (96, NODES);

/// What all plans have in common.
pub(super) struct Setup<'a> {
    pub mission: &'a Mission<LINKS>,
    pub scenarios: &'a [NamedScenario],
    pub options: Options,
    /// The model file, and the model in it.
    pub file: &'static [u8],
    pub model: &'a Model<'static>,
}

/// A planner's memory.
struct Machine {
    workspace: Box<Workspace>,
    solver: Box<EmbeddedSolver>,
    network: Box<Flight>,
    /// Where a program is struck.
    copy: Box<Program>,
}

/// A planner with a model file of its own.
pub(super) struct Worker {
    machine: Machine,
    file: Vec<u8>,
}

/// What became of a case.
pub(super) struct Ran {
    pub ended: Ended,
    /// How it ends without the fault.
    pub baseline: Ended,
    /// Whether a check refused what was struck.
    pub is_refused: bool,
}

impl Worker {
    pub fn new(setup: &Setup<'_>) -> Self {
        let machine = Machine {
            workspace: on_heap(Workspace::new),
            solver: on_heap(EmbeddedSolver::new),
            network: on_heap(Flight::new),
            copy: on_heap(|| Program::ZERO),
        };
        Self { machine, file: setup.file.to_vec() }
    }

    /// The loops' logs of the last plan.
    pub fn logs(&self) -> (&Log, &Log) {
        self.machine.workspace.logs()
    }

    /// Plans a case. The planner is then as good as new.
    pub fn run(&mut self, setup: &Setup<'_>, case: &Case, reference: &Reference) -> Ran {
        let (machine, index) = (&mut self.machine, case.scenario);
        let (ended, baseline, met) = match case.fault {
            Fault::File { checked, byte, bit, .. } => {
                let ended = self.run_file(setup, index, reference, (checked, byte, bit));
                (ended, reference.learned, None)
            }
            Fault::Memory { strike, .. } => {
                let flown = machine.learned(setup, index, setup.model, Some(strike), None);
                (flown.ended, reference.learned, None)
            }
            Fault::Start { accepted, field, node, element, bit } => {
                let start = if accepted { &reference.clipped } else { &reference.rolled };
                let mut start = **start;
                flip_start(&mut start, (field, node, element, bit));
                match accepted {
                    true => {
                        let ended = machine.plan_accepted(setup, index, reference, &start);
                        (ended, reference.accepted, None)
                    }
                    false => {
                        let flown = machine.fly(setup, index, &mut Start::Given(&start), None);
                        (flown.ended, reference.given, None)
                    }
                }
            }
            Fault::Program { solution, call, field, node, element, bit } => {
                let strike = ProgramStrike { solution, call, field, node, element, bit };
                let flown = machine.learned(setup, index, setup.model, None, Some(strike));
                (flown.ended, reference.learned, flown.met)
            }
        };
        let start = ended.start != baseline.start && refuses(ended.start);
        let rejected = met.is_some_and(|met| !met.usable || self.rejected(&met, &ended));
        let is_refused = start || (rejected && !ended.is_same(&baseline));
        Ran { ended, baseline, is_refused }
    }

    /// Plans scenario `index` with the model and without a fault.
    pub fn sound(&mut self, setup: &Setup<'_>, index: usize) -> Ended {
        self.machine.learned(setup, index, setup.model, None, None).ended
    }

    /// With a flipped bit in the model file; its checksum made right again where that had been
    /// `checked` before the bit flipped.
    fn run_file(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        reference: &Reference,
        (checked, byte, bit): (bool, usize, u32),
    ) -> Ended {
        let Self { machine, file } = self;
        file.copy_from_slice(setup.file);
        if let Some(byte) = file.get_mut(byte) {
            *byte ^= 1 << (bit % 8);
        }
        if let (true, Some((covered, stored))) = (checked, file.split_last_chunk_mut::<4>()) {
            *stored = crc32fast::hash(covered).to_le_bytes();
        }
        match Model::open(file) {
            Ok(model) => machine.learned(setup, index, &model, None, None).ended,
            // Of a refused file nothing is used: the plan is the same whatever was struck.
            Err(_) => reference.refused,
        }
    }

    /// Whether the loop did not take the step of the program that was struck.
    fn rejected(&self, met: &Met, ended: &Ended) -> bool {
        let (one, two) = self.logs();
        let record = match (met.stage, met.solve) {
            // The first program of Stage 1 is its start, before the loop.
            (1, Some(solve)) => solve.checked_sub(1).and_then(|at| one.get(at)),
            // After a second try the log is that of the second.
            (2, Some(solve)) if ended.start != StartRecord::Unsolved => two.get(solve),
            _ => None,
        };
        record.is_some_and(|record| !record.accepted)
    }

    /// All plans of a scenario without a fault.
    pub fn reference(&mut self, setup: &Setup<'_>, index: usize) -> Reference {
        let machine = &mut self.machine;
        let mut time_s: f64 = 0.0;
        let mut begun = Instant::now();
        let mut lap = || {
            time_s = time_s.max(begun.elapsed().as_secs_f64());
            begun = Instant::now();
        };
        let flown = machine.learned(setup, index, setup.model, None, None);
        lap();
        let (rolled, clipped) = machine.roll_out(setup);
        let Workspace { target, translation, .. } = &*machine.workspace;
        let mut reference = Reference {
            learned: flown.ended,
            given: flown.ended,
            accepted: flown.ended,
            refused: flown.ended,
            programs: flown.programs,
            path: Box::new(translation.trajectory),
            target: Box::new(*target),
            rolled,
            clipped,
            time_s: 0.0,
        };
        reference.given =
            machine.fly(setup, index, &mut Start::Given(&reference.rolled), None).ended;
        lap();
        reference.accepted = machine.plan_accepted(setup, index, &reference, &reference.clipped);
        lap();
        // Last: a case whose file is refused leaves these logs.
        reference.refused = machine.fly(setup, index, &mut Start::Refused, None).ended;
        lap();
        reference.time_s = time_s;
        reference
    }
}

/// Whether the heuristic was used because a check refused what was to be used.
fn refuses(start: StartRecord) -> bool {
    matches!(start, StartRecord::Refused | StartRecord::NotFinite | StartRecord::Worse)
}

/// A plan that was made.
struct Flown {
    ended: Ended,
    /// What became of a program that was struck.
    met: Option<Met>,
    /// Programs that were solved.
    programs: u32,
}

impl Machine {
    /// Plans from a model's roll-out.
    fn learned(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        model: &Model<'_>,
        memory: Option<Strike>,
        program: Option<ProgramStrike>,
    ) -> Flown {
        let Self { workspace, solver, network, copy } = self;
        let mut upset = Upset::new(&mut **network, memory);
        let mut network = Network::new(model, &mut upset).ok();
        let mut start = match &mut network {
            Some(policy) => Start::Learned { policy, seed: SEED },
            None => Start::Refused,
        };
        let solver = StruckSolver::new(solver, copy, program);
        fly(setup, index, &mut start, solver, workspace)
    }

    /// Plans from any start.
    fn fly(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        start: &mut Start<'_>,
        program: Option<ProgramStrike>,
    ) -> Flown {
        let Self { workspace, solver, copy, .. } = self;
        fly(setup, index, start, StruckSolver::new(solver, copy, program), workspace)
    }

    /// Stage 2 from a start that nobody looks at any more, along the path of the reference; the
    /// whole plan from the heuristic where that is not solved, as the planner does it.
    fn plan_accepted(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        reference: &Reference,
        start: &ReorientationTrajectory<NODES, LINKS>,
    ) -> Ended {
        let Self { workspace, solver, .. } = self;
        let (mission, options) = (setup.mission, &setup.options);
        workspace.target = *reference.target;
        workspace.translation.trajectory = *reference.path;
        workspace.reorientation.trajectory = *start;
        let settings = Options { reorientation: options.learned, ..*options };
        let environment = Environment::BARE;
        let report =
            planner::plan_reorientation(mission, &settings, &mut **solver, &environment, workspace);
        // Stage 1 is the reference's.
        let Ended { iterations: [one, _], costs: [cost, _], .. } = reference.learned;
        let iterations = [one, report.outcome.iterations];
        if report.outcome.status != Status::Solved {
            let mut ended = self.fly(setup, index, &mut Start::Heuristic, None).ended;
            ended.start = StartRecord::Unsolved;
            ended.iterations[1] += iterations[1];
            return ended;
        }
        let (path, motion) = (workspace.path(), workspace.motion());
        let scenario = &setup.scenarios[index].scenario();
        let (integrator, deadline) = (options.integrator, Deadline::never());
        let residuals = verify(mission, scenario, integrator, path, motion, &deadline).residuals;
        let is_verified = residuals.are_within(&mission.tolerances);
        let status = if is_verified { Status::Solved } else { Status::NumericalFailure };
        let output = output_checksum(path, motion);
        let claim = Claim { status, is_verified, residuals, output };
        let judge = Judge { mission, scenario, integrator: options.integrator };
        let is_wrong = judge.is_wrong(&claim, Plan { path, motion });
        let costs = [cost, report.cost];
        let is_bounded = iterations[1] <= options.learned.max_iterations;
        Ended {
            status,
            is_verified,
            start: StartRecord::Given,
            iterations,
            costs,
            output,
            is_wrong,
            is_bounded,
        }
    }

    /// The roll-out along the path in the workspace, as it comes and as the loop takes it.
    fn roll_out(
        &mut self,
        setup: &Setup<'_>,
    ) -> (Box<ReorientationTrajectory<NODES, LINKS>>, Box<ReorientationTrajectory<NODES, LINKS>>)
    {
        let Self { workspace, network, .. } = self;
        let Workspace { target, translation, .. } = &**workspace;
        let (mission, options) = (setup.mission, &setup.options);
        let path = &translation.trajectory;
        let mut rolled = Box::new(ReorientationTrajectory::ZERO);
        let scene = Scene::new(mission, path, target, options.integrator);
        if let Ok(mut policy) = Network::new(setup.model, &mut **network) {
            roll_out(&scene, &mut policy, SEED, &mut rolled);
        }
        let mut clipped = rolled.clone();
        let problem = Reorientation::<_, NODES, LINKS, { size::NX }, { size::NU }>::new(
            &Formulation::new(mission, options.integrator),
            path,
            target,
            options.mode,
            &Sequential,
        );
        problem.clip(&mut clipped);
        (rolled, clipped)
    }
}

/// Plans, and has the plan judged.
fn fly(
    setup: &Setup<'_>,
    index: usize,
    start: &mut Start<'_>,
    mut solver: StruckSolver<'_>,
    workspace: &mut Workspace,
) -> Flown {
    let (mission, scenario) = (setup.mission, &setup.scenarios[index].scenario());
    let environment = Environment::BARE;
    let report = planner::plan(
        mission,
        scenario,
        &setup.options,
        start,
        &mut solver,
        &environment,
        workspace,
    );
    let (one, two, evidence) = (&report.translation, &report.reorientation, &report.evidence);
    let claim = Claim {
        status: report.status,
        is_verified: report.is_verified(),
        residuals: report.residuals,
        output: evidence.output,
    };
    let judge = Judge { mission, scenario, integrator: setup.options.integrator };
    let plan = Plan { path: workspace.path(), motion: workspace.motion() };
    let ended = Ended {
        status: report.status,
        is_verified: report.is_verified(),
        start: evidence.start,
        iterations: [one.outcome.iterations, two.outcome.iterations],
        costs: [one.cost, two.cost],
        output: evidence.output,
        is_wrong: judge.is_wrong(&claim, plan) || evidence.status != report.status,
        is_bounded: is_bounded(&setup.options, &report, solver.calls),
    };
    Flown { ended, met: solver.met, programs: solver.calls }
}

/// Whether a plan took no more work than its settings allow: Stage 1 its start besides, Stage 2 a
/// second try, each iteration some corrections.
fn is_bounded(options: &Options, report: &Report, programs: u32) -> bool {
    let Options { translation, reorientation, learned, .. } = options;
    let (one, two) = (&report.evidence.translation, &report.evidence.reorientation);
    let most = [
        1 + translation.max_iterations as u32,
        (learned.max_iterations + reorientation.max_iterations) as u32,
    ];
    let each = InteriorPointSettings::default().max_iterations;
    one.iterations <= most[0]
        && two.iterations <= most[1]
        && programs <= one.iterations + one.corrections + two.iterations + two.corrections
        && one.corrections <= translation.max_corrections * most[0]
        && two.corrections <= learned.max_corrections.max(reorientation.max_corrections) * most[1]
        && u64::from(one.qp_iterations + two.qp_iterations) <= u64::from(each) * u64::from(programs)
}

#[cfg(test)]
mod tests {
    use super::super::case::{Drawn, Layout, Site};
    use super::*;
    use crate::formats::ScenarioSet;
    use crate::learned::Learned;
    use crate::method::Integrator;
    use remora_core::stages::Mode;

    /// The memory's uses are counted as the cases count them: no strike misses.
    #[test]
    fn every_strike_of_the_networks_memory_hits() {
        let (mission, integrator) = (Mission::default(), Integrator::EULER);
        let learned = Learned::built_in(integrator);
        let model = learned.model().unwrap();
        let file = Learned::built_in_file(integrator);
        let scenarios = &ScenarioSet::built_in().unwrap().scenarios[..1];
        let options = Options::new(Mode::Feasible, integrator.core());
        let setup = Setup { mission: &mission, scenarios, options, file, model };
        let layout = Layout::new(model, file.len(), MEMORY).unwrap();
        let Machine { mut workspace, mut solver, mut network, .. } = Worker::new(&setup).machine;
        let mut strike = |number| {
            let case = Drawn::new(3, number, 1).case(10, &layout);
            let Fault::Memory { strike, .. } = case.fault else { return };
            let mut upset = Upset::new(&mut *network, Some(strike));
            let mut policy = Network::new(model, &mut upset).unwrap();
            planner::plan(
                &mission,
                &scenarios[0].scenario(),
                &options,
                &mut Start::Learned { policy: &mut policy, seed: SEED },
                &mut *solver,
                &Environment::BARE,
                &mut workspace,
            );
            assert!(upset.is_struck(), "{case:?}");
        };
        let sites = [Site::Activations, Site::KvCache];
        (0..400).filter(|number| sites.contains(&Site::of(*number))).for_each(&mut strike);
    }
}
