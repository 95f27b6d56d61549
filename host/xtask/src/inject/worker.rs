//! One planner with everything that bits can flip in.

use super::bit_flip::{FaultySolver, Met, QpBitFlip, Strike};
use super::case::{Case, Fault};
use super::class::{Claim, Judge, Plan};
use super::draw::Work;
use super::ended::{Ended, Ran};
use super::fields::{Program, flip_start};
use super::flights::{self, Flights, Sortie};
use super::reference::Reference;
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::guidance::FlightPlan;
use remora_core::advanced::model::{Integrator, Mission, Scenario};
use remora_core::advanced::nn::{BitFlip, FaultyMemory, Model, Network};
use remora_core::advanced::planner::memory::NetworkMemory;
use remora_core::advanced::planner::{
    GuessRecord, InitialGuess, Options, PlanSettings, Platform, Report, Solver, Workspace,
};
use remora_core::advanced::qp::InteriorPointSettings;
use remora_core::advanced::scp::{Log, Problem};
use remora_core::advanced::stages::{
    Formulation, LINKS, MissionReorientation, NODES, ReorientationTrajectory,
};
use remora_core::advanced::time::NoClock;
use remora_core::advanced::warmstart::{NetworkPolicy, Scene, rollout};
use remora_host::engine::{SEED, embedded_solver, plan_with};
use remora_host::error::Error;
use remora_host::formats::NamedScenario;
use remora_host::memory::on_heap;
use remora_host::threads::Threads;
use std::time::Instant;

/// Memory of the network as it flies.
type Flight = NetworkMemory;
/// Its width and tokens.
pub(super) const MEMORY: (usize, usize) = (96, NODES);

/// Inputs that all plans share.
pub(super) struct Setup<'a> {
    pub mission: Mission<LINKS>,
    pub scenarios: &'a [NamedScenario],
    pub options: PlanSettings,
    /// The model file, and the model in it.
    pub file: &'static [u8],
    pub model: &'a Model<'static>,
    /// Whether guidance flies.
    pub flies: bool,
}

impl Setup<'_> {
    /// The scenario of that place.
    fn scenario(&self, index: usize) -> Scenario {
        self.scenarios[index].scenario().resized()
    }
}

/// A planner's memory.
struct Machine {
    workspace: Box<Workspace>,
    solver: Box<dyn Solver + Send>,
    network: Box<Flight>,
    /// Copy of a subproblem in which a bit flips.
    copy: Box<Program>,
}

/// A planner with a model file of its own.
pub(super) struct Worker {
    machine: Machine,
    file: Vec<u8>,
    flights: Flights,
}

impl Worker {
    pub fn new(setup: &Setup<'_>) -> Self {
        let machine = Machine {
            workspace: on_heap(Workspace::new),
            solver: embedded_solver(),
            network: on_heap(Flight::new),
            copy: on_heap(|| Program::ZERO),
        };
        Self { machine, file: setup.file.to_vec(), flights: Flights::default() }
    }

    /// The loops' logs of the last plan.
    pub fn logs(&self) -> (&Log, &Log) {
        self.machine.workspace.logs()
    }

    /// Plans a case. The planner is then as good as new.
    pub fn run(&mut self, setup: &Setup<'_>, case: &Case, reference: &Reference) -> Ran {
        let (machine, index) = (&mut self.machine, case.scenario);
        let mut tried_twice = false;
        let (ended, baseline, met) = match case.fault {
            Fault::Guidance { course, step, field, element, bit } => {
                let strike = flights::Strike { step, field, element, bit };
                let (sortie, without) = (reference.sortie.as_ref(), reference.learned);
                return self.flights.run(sortie, without, course, strike);
            }
            Fault::File { checked, byte, bit, .. } => {
                let ended = self.run_file(setup, index, reference, (checked, byte, bit));
                (ended, reference.learned, None)
            }
            Fault::Memory { bit_flip, .. } => {
                let flown = machine.learned(setup, index, setup.model, Some(bit_flip), None);
                (flown.ended, reference.learned, None)
            }
            Fault::Start { accepted, field, node, element, bit } => {
                let start = if accepted { &reference.clipped } else { &reference.rolled };
                let mut start = **start;
                flip_start(&mut start, (field, node, element, bit));
                let (guess, baseline) = match accepted {
                    true => (InitialGuess::Unchecked(&start), reference.accepted),
                    false => (InitialGuess::User(&start), reference.given),
                };
                (machine.fly(setup, index, &guess, None).ended, baseline, None)
            }
            Fault::Program { solution, call, field, node, element, bit } => {
                let bit_flip = QpBitFlip { solution, call, field, node, element, bit };
                let strike = Some(Strike::Program(bit_flip));
                let flown = machine.learned(setup, index, setup.model, None, strike);
                tried_twice = flown.tried_twice;
                (flown.ended, reference.learned, flown.met)
            }
            Fault::Loop(fault) => {
                let strike = Some(Strike::Loop(fault));
                let flown = machine.learned(setup, index, setup.model, None, strike);
                (flown.ended, reference.learned, None)
            }
        };
        let start = ended.start != baseline.start && refuses(ended.start);
        let rejected = met.is_some_and(|met| !met.usable || self.rejected(&met, &ended));
        let is_refused = start || tried_twice || (rejected && !ended.is_same(&baseline));
        Ran { ended, baseline, is_refused, ending: None }
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
        let Self { machine, file, .. } = self;
        file.copy_from_slice(setup.file);
        if let Some(byte) = file.get_mut(byte) {
            *byte ^= 1 << (bit % 8);
        }
        if let (true, Some((covered, stored))) = (checked, file.split_last_chunk_mut::<4>()) {
            *stored = crc32fast::hash(covered).to_le_bytes();
        }
        match Model::open(file) {
            Ok(model) => machine.learned(setup, index, &model, None, None).ended,
            // Nothing of a refused file is used: the plan is the same whatever was hit.
            Err(_) => reference.refused,
        }
    }

    /// Whether the loop did not take the step of the program that was hit.
    fn rejected(&self, met: &Met, ended: &Ended) -> bool {
        let (one, two) = self.logs();
        let record = match (met.stage, met.solve) {
            // The first program of Stage 1 is its start, before the loop.
            (1, Some(solve)) => solve.checked_sub(1).and_then(|at| one.get(at)),
            // After a second try the log is that of the second.
            (2, Some(solve)) if ended.start != GuessRecord::Unsolved => two.get(solve),
            _ => None,
        };
        record.is_some_and(|record| !record.accepted)
    }

    /// All plans of a scenario without a fault.
    ///
    /// # Errors
    /// Where one of them is not solved.
    pub fn reference(&mut self, setup: &Setup<'_>, index: usize) -> Result<Reference, Error> {
        let machine = &mut self.machine;
        let mut time_s: f64 = 0.0;
        let mut begun = Instant::now();
        let mut lap = || {
            time_s = time_s.max(begun.elapsed().as_secs_f64());
            begun = Instant::now();
        };
        let flown = machine.learned(setup, index, setup.model, None, None);
        lap();
        let (rolled, clipped) = machine.rollout(setup, index);
        let mut reference = Reference {
            learned: flown.ended,
            given: flown.ended,
            accepted: flown.ended,
            refused: flown.ended,
            work: Work {
                programs: flown.programs,
                iterations: flown.iterations,
                steps: Default::default(),
            },
            sortie: None,
            rolled,
            clipped,
            time_s: 0.0,
        };
        reference.given =
            machine.fly(setup, index, &InitialGuess::User(&reference.rolled), None).ended;
        lap();
        reference.accepted =
            machine.fly(setup, index, &InitialGuess::Unchecked(&reference.clipped), None).ended;
        lap();
        let sortie = setup.flies.then(|| machine.sortie(setup, index, &mut self.flights));
        lap();
        // Last: a case whose file is refused leaves these logs.
        reference.refused = machine.fly(setup, index, &InitialGuess::Refused, None).ended;
        lap();
        reference.time_s = time_s;
        if !reference.is_solved() {
            let id = &setup.scenarios[index].id;
            let reason = format!("scenario {id} is not solved without a fault");
            return Err(Error::argument("--scenarios", reason));
        }
        reference.sortie = sortie.transpose()?;
        if let Some(sortie) = &reference.sortie {
            reference.work.steps = sortie.steps();
        }
        Ok(reference)
    }
}

/// Whether the heuristic was used because a check refused what was to be used.
fn refuses(start: GuessRecord) -> bool {
    matches!(start, GuessRecord::Refused | GuessRecord::NotFinite | GuessRecord::Worse)
}

/// A plan that was made.
struct Flown {
    ended: Ended,
    /// Solve of the subproblem that was hit, where one was.
    met: Option<Met>,
    /// Programs that were solved.
    programs: u32,
    /// Iterations of either stage's loop.
    iterations: [u32; 2],
    /// Whether Stage 1's first program was solved twice.
    tried_twice: bool,
}

impl Machine {
    /// Plans from a model's roll-out.
    fn learned(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        model: &Model<'_>,
        memory: Option<BitFlip>,
        program: Option<Strike>,
    ) -> Flown {
        let Self { workspace, solver, network, copy } = self;
        let mut faulty = FaultyMemory::new(&mut **network, memory);
        let network = Network::new(model, &mut faulty).ok();
        let policy = network.and_then(|network| NetworkPolicy::new(network).ok());
        let start = match &policy {
            Some(policy) => InitialGuess::Learned { policy, seed: SEED },
            None => InitialGuess::Refused,
        };
        let solver = FaultySolver::new(&mut **solver, copy, program);
        fly(setup, index, &start, solver, workspace)
    }

    /// Plans from any start.
    fn fly(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        start: &InitialGuess<'_>,
        program: Option<Strike>,
    ) -> Flown {
        let Self { workspace, solver, copy, .. } = self;
        fly(setup, index, start, FaultySolver::new(&mut **solver, copy, program), workspace)
    }

    /// The plan that guidance flies, and its flight without a fault: by the settings' integrator, where its
    /// plans can be flown.
    fn sortie(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
        flights: &mut Flights,
    ) -> Result<Sortie, Error> {
        let named = &setup.scenarios[index];
        let unflyable = |reason: String| Error::Scenario { id: named.id.clone(), reason };
        let integrator = match setup.options.integrator {
            flown if flown.is_flown() => flown,
            _ => Integrator::Rk4 { substeps: flights::SUBSTEPS },
        };
        let (mission, scenario) = (&setup.mission, setup.scenario(index));
        let options = PlanSettings::new(setup.options.mode, integrator);
        let options = Options::from_parts(options, InitialGuess::Heuristic, BARE);
        let Self { workspace, solver, .. } = self;
        let report = plan_with(mission, &scenario, &options, &mut **solver, workspace);
        if !report.is_verified() {
            return Err(unflyable("has no plan that can be flown".into()));
        }
        let (path, motion) = (workspace.translation(), workspace.reorientation());
        let plan = FlightPlan::new(mission, &scenario, integrator, path, motion)
            .map_err(|error| unflyable(error.to_string()))?;
        flights.sortie(mission, &scenario, (plan, integrator), index as u64).map_err(unflyable)
    }

    /// The roll-out along the path in the workspace, as it comes and as the loop takes it.
    fn rollout(
        &mut self,
        setup: &Setup<'_>,
        index: usize,
    ) -> (Box<ReorientationTrajectory<NODES, LINKS>>, Box<ReorientationTrajectory<NODES, LINKS>>)
    {
        let Self { workspace, network, .. } = self;
        let Workspace { target, translation, .. } = &**workspace;
        let (mission, options) = (&setup.mission, &setup.options);
        let scenario = setup.scenario(index);
        let path = &translation.trajectory;
        let mut rolled = Box::new(ReorientationTrajectory::ZERO);
        let scene = Scene::new(mission, &scenario, path, target, options.integrator);
        let network = Network::new(setup.model, &mut **network).ok();
        if let Some(policy) = network.and_then(|network| NetworkPolicy::new(network).ok()) {
            rollout(&scene, &policy, SEED, &mut rolled);
        }
        let mut clipped = rolled.clone();
        let problem = MissionReorientation::new(
            &Formulation::new(mission, &scenario, options.integrator),
            path,
            target,
            options.mode,
            &Sequential,
        );
        problem.project(&mut clipped);
        (rolled, clipped)
    }
}

/// One thread, and no clock: no deadline ever passes.
const BARE: Platform<'static, Threads> = Platform { clock: &NoClock, executor: &Threads::One };

/// Plans, and has the plan judged.
fn fly(
    setup: &Setup<'_>,
    index: usize,
    start: &InitialGuess<'_>,
    mut solver: FaultySolver<'_>,
    workspace: &mut Workspace,
) -> Flown {
    let (mission, scenario) = (&setup.mission, &setup.scenario(index));
    let options = Options::from_parts(setup.options, *start, BARE);
    let report = plan_with(mission, scenario, &options, &mut solver, workspace);
    let (one, two, evidence) = (&report.translation, &report.reorientation, &report.record);
    let claim = Claim {
        status: report.status,
        is_verified: report.is_verified(),
        residuals: report.residuals,
        output: evidence.output,
    };
    let judge = Judge { mission, scenario, integrator: setup.options.integrator };
    let plan = Plan { path: workspace.translation(), motion: workspace.reorientation() };
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
    let FaultySolver { met, calls: programs, iterations, tried_twice, .. } = solver;
    Flown { ended, met, programs, iterations, tried_twice }
}

/// Whether a plan took no more work than its settings allow: Stage 1 three more where it
/// begins again, Stage 2 a second try, each iteration some corrections.
fn is_bounded(options: &PlanSettings, report: &Report, programs: u32) -> bool {
    let PlanSettings { translation, reorientation, learned, .. } = options;
    let (one, two) = (&report.record.translation, &report.record.reorientation);
    let most = [
        3 + translation.max_iterations as u32,
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
    use super::super::draw::{Drawn, Layout};
    use super::super::site::Site;
    use super::*;
    use remora_core::advanced::stages::Mode;
    use remora_host::formats::ScenarioSet;
    use remora_host::learned::Learned;

    /// The memory's uses are counted as the cases count them: no bit flip misses.
    #[test]
    fn every_strike_of_the_networks_memory_hits() {
        let (mission, integrator) = (Mission::default(), Integrator::Euler);
        let learned = Learned::built_in(integrator);
        let model = learned.model().unwrap();
        let file = Learned::built_in_file(integrator);
        let scenarios = &ScenarioSet::built_in().unwrap().scenarios[..1];
        let options = PlanSettings::new(Mode::Feasible, integrator);
        let setup = Setup { mission, scenarios, options, file, model, flies: false };
        let layout = Layout::new(model, file.len(), MEMORY).unwrap();
        let Machine { mut workspace, mut solver, mut network, .. } = Worker::new(&setup).machine;
        let work = Work { programs: 10, iterations: [4, 4], steps: Default::default() };
        let mut bit_flip = |number| {
            let case = Drawn::new(3, number, 1).case(work, &layout);
            let Fault::Memory { bit_flip, .. } = case.fault else { return };
            let mut faulty = FaultyMemory::new(&mut *network, Some(bit_flip));
            let policy = NetworkPolicy::new(Network::new(model, &mut faulty).unwrap()).unwrap();
            let guess = InitialGuess::Learned { policy: &policy, seed: SEED };
            let options = Options::from_parts(options, guess, BARE);
            plan_with(&mission, &setup.scenario(0), &options, &mut *solver, &mut workspace);
            assert!(faulty.is_injected(), "{case:?}");
        };
        let sites = [Site::Activations, Site::Block, Site::KvCache];
        (0..600).filter(|number| sites.contains(&Site::of(*number))).for_each(&mut bit_flip);
    }
}
