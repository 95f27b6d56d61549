//! The planner against the reference optima, and its promises: verified plans, small stacks, the
//! same bits whatever was planned before.

use crate::perturbation::disturb;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::executor::{ForkJoin, Sequential};
use remora_core::advanced::model::{Mission, Scenario};
use remora_core::advanced::planner::{
    EmbeddedSolver, Fallback, InitialGuess, Options, PlanSettings, Platform, Report, Workspace,
    output_checksum, plan, plan_reorientation,
};
use remora_core::advanced::qp::Validate;
use remora_core::advanced::scp::{Settings, Status};
use remora_core::advanced::stages::{Formulation, LINKS, Mode, NODES, Residuals, verify};
use remora_core::advanced::time::{Clock, Deadline};
use remora_host::backend::ClarabelQp;
use remora_host::formats::ScenarioSet;
use remora_host::memory::on_heap;
use remora_host::threads::Threads;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures");

/// Reference optima of Stage 1 in scenario order.
fn references() -> Vec<f64> {
    let text = std::fs::read_to_string(format!("{FIXTURES}/oracle/reference_public.json"));
    let json: serde_json::Value = serde_json::from_str(&text.unwrap()).unwrap();
    let cost = |case: &serde_json::Value| case["stage1"]["cost"].as_f64().unwrap();
    json["scenarios"].as_array().unwrap().iter().map(cost).collect()
}

fn public() -> ScenarioSet {
    ScenarioSet::read(Path::new(&format!("{FIXTURES}/scenarios/public.scenarios.json"))).unwrap()
}

struct Bench {
    mission: Mission<LINKS>,
    set: ScenarioSet,
    workspace: Box<Workspace>,
    solver: ClarabelQp,
}

impl Bench {
    fn new() -> Self {
        Self {
            mission: Mission::default(),
            set: public(),
            workspace: Box::new(Workspace::new()),
            solver: ClarabelQp::default(),
        }
    }

    fn scenario(&self, k: usize) -> Scenario {
        self.set.scenarios[k].scenario().resized()
    }

    fn plan(&mut self, scenario: usize, options: &PlanSettings) -> Report {
        self.plan_in(scenario, options, &Platform::BARE)
    }

    fn plan_in<P: ForkJoin>(
        &mut self,
        scenario: usize,
        options: &PlanSettings,
        platform: &Platform<P>,
    ) -> Report {
        let scenario = self.scenario(scenario);
        let solver = &mut self.solver;
        plan(
            &self.mission,
            &scenario,
            &Options::from_parts(*options, InitialGuess::Heuristic, *platform),
            solver,
            &mut self.workspace,
        )
    }
}

// Verifies REM-PLN-001.
#[test]
fn stage_1_finds_the_unique_optimum_of_every_public_scenario() {
    let mut bench = Bench::new();
    // Feasibility mode: Stage 2 is not the subject here.
    let options = PlanSettings::new(Mode::Feasible, Integrator::Euler);
    for (k, reference) in references().into_iter().enumerate() {
        let report = bench.plan(k, &options);
        assert_eq!(report.status, Status::Solved, "scenario {k}");
        let error = (report.translation.cost / reference - 1.0).abs();
        assert!(error < 1e-4, "scenario {k}: {error:e}");
    }
}

// Verifies REM-PLN-003.
#[test]
fn rk4_plans_satisfy_rk4_dynamics_and_not_eulers() {
    let mut bench = Bench::new();
    let integrator = Integrator::Rk4 { substeps: 8 };
    let report = bench.plan(0, &PlanSettings::new(Mode::Optimal, integrator));
    assert_eq!(report.status, Status::Solved);
    let scenario = bench.scenario(0);
    let (path, motion) = (bench.workspace.translation(), bench.workspace.reorientation());
    let (euler, deadline) = (Integrator::Euler, Deadline::never());
    let by_euler = verify(&bench.mission, &scenario, euler, path, motion, &deadline).residuals;
    assert!(by_euler.dynamics2 > 1e-3);
}

#[test]
fn a_disturbed_plan_is_a_better_start_than_the_heuristic() {
    let mut bench = Bench::new();
    let options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    let (mut heuristic, mut disturbed) = (0, 0);
    for k in [0, 7, 21, 33, 48] {
        heuristic += bench.plan(k, &options).reorientation.outcome.iterations;
        let scenario = bench.scenario(k);
        let Workspace { translation, reorientation, .. } = &mut *bench.workspace;
        let (path, motion) = (&translation.trajectory, &mut reorientation.trajectory);
        let formulation = Formulation::new(&bench.mission, &scenario, options.integrator);
        disturb(&formulation, path, motion, 0.05, k as u64);
        let solver = &mut bench.solver;
        let again = plan_reorientation(
            &bench.mission,
            &scenario,
            &options,
            solver,
            &Platform::BARE,
            &mut bench.workspace,
        );
        assert_eq!(again.outcome.status, Status::Solved, "scenario {k}");
        disturbed += again.outcome.iterations;
    }
    assert!(disturbed < heuristic, "{disturbed} against {heuristic}");
}

// Verifies REM-MEM-002.
#[test]
fn all_memory_together_fits_a_mebibyte() {
    let (planner, solver) = (Workspace::BYTES, EmbeddedSolver::BYTES);
    println!("planner {planner}, solver {solver}, together {} bytes", planner + solver);
    assert!(planner + solver <= 1 << 20, "{planner} and {solver} bytes");
    assert_eq!((planner, solver), (size_of::<Workspace>(), size_of::<EmbeddedSolver>()));
}

// Verifies REM-MEM-003.
#[test]
fn planning_fits_a_stack_of_256_kib() {
    let mission = Mission::<LINKS>::default();
    let scenario = public().scenarios[3].scenario().resized();
    let mut workspace = Box::new(Workspace::new());
    let workspace = &mut *workspace;
    let status = std::thread::scope(|scope| {
        let planning = move || {
            let options = PlanSettings::new(Mode::Optimal, Integrator::Rk4 { substeps: 4 });
            let mut solver = ClarabelQp::default();
            plan(
                &mission,
                &scenario,
                &Options::from_parts(options, InitialGuess::Heuristic, Platform::BARE),
                &mut solver,
                workspace,
            )
            .status
        };
        let thread = std::thread::Builder::new().stack_size(256 << 10);
        thread.spawn_scoped(scope, planning).unwrap().join().unwrap()
    });
    assert_eq!(status, Status::Solved);
}

// Verifies REM-PLN-005.
#[test]
fn a_plan_does_not_depend_on_the_one_before() {
    let options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    let mut fresh = Bench::new();
    fresh.plan(4, &options);
    let mut used = Bench::new();
    used.plan(9, &PlanSettings::new(Mode::Feasible, Integrator::Euler));
    used.plan(4, &options);
    assert_eq!(fresh.workspace.translation(), used.workspace.translation());
    assert_eq!(fresh.workspace.reorientation(), used.workspace.reorientation());
}

/// Stage 1 works in the memory that Stage 2 of the plan before left, and with its solver: what can
/// be told of that plan there must not be.
// Verifies REM-PLN-005.
#[test]
fn with_the_embedded_solver_neither() {
    let (mission, set) = (Mission::<LINKS>::default(), public());
    let fresh = || (on_heap(Workspace::new), on_heap(EmbeddedSolver::new));
    let mut used = fresh();
    for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
        let options = PlanSettings::new(Mode::Optimal, integrator);
        for k in [9, 4, 31] {
            let scenario = set.scenarios[k].scenario().resized();
            let [again, first] = [&mut used, &mut fresh()].map(|(workspace, solver)| {
                plan(
                    &mission,
                    &scenario,
                    &Options::from_parts(options, InitialGuess::Heuristic, Platform::BARE),
                    &mut **solver,
                    workspace,
                )
            });
            assert_eq!(again, first, "scenario {k}");
            assert_eq!(first.status, Status::Solved);
        }
    }
}

// Verifies REM-SCP-001.
#[test]
fn a_start_that_is_not_a_number_is_not_a_success() {
    let mut bench = Bench::new();
    let options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    bench.plan(0, &options);
    bench.workspace.reorientation.trajectory.states[20].rate.x = f64::NAN;
    let (scenario, solver) = (bench.scenario(0), &mut bench.solver);
    let (mission, workspace) = (&bench.mission, &mut bench.workspace);
    let report =
        plan_reorientation(mission, &scenario, &options, solver, &Platform::BARE, workspace);
    assert_eq!(report.outcome.status, Status::NumericalFailure);
}

// Verifies REM-SCP-004.
#[test]
fn the_iteration_limit_is_said_to_be_one() {
    let mut bench = Bench::new();
    let mut options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    options.reorientation = Settings::with_max_iterations(&options.reorientation, 2);
    let report = bench.plan(0, &options);
    assert_eq!(report.status, Status::IterationLimit);
    assert_eq!(report.reorientation.outcome.iterations, 2);
}

// Verifies REM-PLN-006.
#[test]
fn two_threads_plan_the_same_bits_as_one() {
    let mut bench = Bench::new();
    let two = Platform { executor: &Threads::Two, clock: Platform::BARE.clock };
    for integrator in [Integrator::Euler, Integrator::Rk4 { substeps: 4 }] {
        let options = PlanSettings::new(Mode::Optimal, integrator);
        let alone = bench.plan(11, &options);
        assert_eq!(alone.status, Status::Solved);
        assert_eq!(bench.plan_in(11, &options, &two), alone);
    }
}

/// A clock that gains a second with each reading.
struct Ticking(AtomicU32);

impl Clock for Ticking {
    fn seconds(&self) -> f64 {
        f64::from(self.0.fetch_add(1, Ordering::Relaxed) + 1)
    }
}

/// Plans with so many readings of the clock to go.
fn plan_within(bench: &mut Bench, readings: f64) -> Report {
    let mut options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    options.deadline_s = readings;
    let clock = Ticking(AtomicU32::new(0));
    bench.plan_in(38, &options, &Platform { clock: &clock, executor: &Sequential })
}

// Verifies REM-PLN-008.
#[test]
fn a_plan_cut_short_is_told_from_one_to_fly() {
    cut_short(3 * 67);
}

#[test]
#[ignore = "nightly: 135 plans"]
fn a_plan_cut_short_anywhere_is_told_from_one_to_fly() {
    cut_short(67);
}

/// Cuts a plan short after every `step`-th reading of the clock, and holds it to what it says of itself.
fn cut_short(step: usize) {
    let mut bench = Bench::new();
    let scenario = bench.scenario(38);
    let (mut useful, mut earlier, mut last_cost) = (0, 0, f64::INFINITY);
    // The clock is read at every node of a linearisation, a retraction and the residuals.
    for readings in (1..9000).step_by(step) {
        let report = plan_within(&mut bench, f64::from(readings));
        let (path, motion) = (bench.workspace.translation(), bench.workspace.reorientation());
        let (euler, deadline) = (Integrator::Euler, Deadline::never());
        let residuals = verify(&bench.mission, &scenario, euler, path, motion, &deadline).residuals;
        // The verifier is within the deadline: where that is too near for it, nothing is claimed.
        if report.residuals == Residuals::UNFINISHED {
            assert_eq!((report.status, report.is_verified()), (Status::Deadline, false));
            assert_eq!(useful, 0, "{readings}");
            continue;
        }
        assert_eq!(residuals, report.residuals);
        assert_eq!(report.is_verified(), residuals.are_within(&bench.mission.tolerances));
        assert!(motion.states.iter().all(|x| x.is_finite()));
        if report.status == Status::Solved {
            assert!(report.is_verified());
            continue;
        }
        assert_eq!(report.status, Status::Deadline, "{readings}");
        earlier += i32::from(report.record.reorientation.fallback == Fallback::EarlierIterate);
        if report.is_verified() {
            useful += 1;
            // More time never makes it worse.
            assert!(report.reorientation.cost <= last_cost, "{readings}");
            last_cost = report.reorientation.cost;
        } else {
            assert_eq!(useful, 0, "{readings}");
        }
    }
    assert!(useful > 0 && earlier > 0, "{useful}, {earlier}");
}

// Verifies REM-PLN-008.
#[test]
fn no_time_at_all_leaves_the_starts() {
    let mut bench = Bench::new();
    let report = plan_within(&mut bench, 0.0);
    assert_eq!(report.status, Status::Deadline);
    assert_eq!(report.translation.outcome.status, Status::Deadline);
    assert_eq!(report.reorientation.outcome.status, Status::Deadline);
    assert_eq!(report.reorientation.outcome.iterations, 0);
    let evidence = &report.record;
    assert_eq!(evidence.translation.fallback, Fallback::Start);
    assert_eq!(evidence.reorientation.fallback, Fallback::Start);
    assert!(!report.is_verified());
    assert!(bench.workspace.reorientation().states.iter().all(|x| x.is_finite()));
}

// Verifies REM-PLN-009.
#[test]
fn evidence_follows_what_it_is_evidence_of() {
    let mut bench = Bench::new();
    let options = PlanSettings::new(Mode::Feasible, Integrator::Euler);
    let first = bench.plan(2, &options).record;
    assert_eq!(
        first.output,
        output_checksum(NODES, bench.workspace.translation(), bench.workspace.reorientation())
    );
    assert!(first.is_verified && first.translation.qp_iterations > 0);
    assert_eq!(first.reorientation.qp_unsolved, 0);
    assert_eq!(bench.plan(2, &options).record, first);

    // Another scenario, another mission, other settings.
    let other = bench.plan(3, &options).record;
    assert!(other.input != first.input && other.output != first.output);
    assert_eq!(other.settings, first.settings);
    bench.mission.servicer.links[2].inertia_kg_m2[(1, 1)] *= 1.0 + f64::EPSILON;
    assert_ne!(bench.plan(2, &options).record.input, first.input);
    let changed = |change: fn(&mut PlanSettings)| {
        let mut options = options;
        change(&mut options);
        options
    };
    bench.mission = Mission::default();
    for options in [
        changed(|o| o.deadline_s = 1e9),
        changed(|o| o.translation = Settings { grow: 2.5, ..*o.translation }.validated().unwrap()),
        changed(|o| {
            let one = Settings { max_corrections: 1, ..*o.reorientation };
            o.reorientation = one.validated().unwrap();
        }),
        PlanSettings::new(Mode::Optimal, Integrator::Euler),
        PlanSettings::new(Mode::Feasible, Integrator::Rk4 { substeps: 4 }),
    ] {
        let other = bench.plan(2, &options).record;
        assert_ne!(other.settings, first.settings, "{options:?}");
        assert_eq!(other.input, first.input);
    }
}

#[test]
fn phases_add_up_to_the_whole() {
    let mut bench = Bench::new();
    let options = PlanSettings::new(Mode::Feasible, Integrator::Euler);
    let clock = Ticking(AtomicU32::new(0));
    let report = bench.plan_in(0, &options, &Platform { clock: &clock, executor: &Sequential });
    let t = report.times;
    let phases = [t.start_s, t.translation_s, t.linearise_s, t.qp_s, t.step_s, t.verify_s];
    assert!(phases.iter().all(|phase| *phase > 0.0), "{t:?}");
    assert!(phases.iter().sum::<f64>() <= t.total_s);
    assert_eq!(bench.plan(0, &options).times, Default::default());
}
