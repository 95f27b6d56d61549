//! The planner against the reference optima, and its promises: verified plans, small stacks, the
//! same bits whatever was planned before.

use remora_core::dynamics::Integrator;
use remora_core::model::Mission;
use remora_core::planner::{Environment, Options, Report, Workspace, plan, plan_reorientation};
use remora_core::scp::Status;
use remora_core::stages::{LINKS, Mode, verify};
use remora_host::backend::ClarabelQp;
use remora_host::formats::ScenarioSet;
use remora_host::perturbation::disturb;
use std::path::Path;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures");

/// Reference optima of Stage 1 and Stage 2 (Euler) in scenario order.
fn references() -> Vec<(f64, f64)> {
    let text = std::fs::read_to_string(format!("{FIXTURES}/oracle/reference_public.json"));
    let json: serde_json::Value = serde_json::from_str(&text.unwrap()).unwrap();
    let cost = |case: &serde_json::Value, key: &str| case[key]["cost"].as_f64().unwrap();
    let cases = json["scenarios"].as_array().unwrap().iter();
    cases.map(|case| (cost(case, "stage1"), cost(case, "rate_limited"))).collect()
}

fn public() -> ScenarioSet {
    ScenarioSet::read(Path::new(&format!("{FIXTURES}/scenarios/public.scenarios.json"))).unwrap()
}

struct Bench {
    mission: Mission<LINKS>,
    set: ScenarioSet,
    workspace: Box<Workspace>,
    solvers: (ClarabelQp, ClarabelQp),
}

impl Bench {
    fn new() -> Self {
        Self {
            mission: Mission::default(),
            set: public(),
            workspace: Box::new(Workspace::new()),
            solvers: Default::default(),
        }
    }

    fn plan(&mut self, scenario: usize, options: &Options) -> Report {
        let scenario = self.set.scenarios[scenario].scenario();
        let solvers = (&mut self.solvers.0, &mut self.solvers.1);
        plan(&self.mission, &scenario, options, solvers, &Environment::BARE, &mut self.workspace)
    }
}

#[test]
fn stage_1_finds_the_unique_optimum_of_every_public_scenario() {
    let mut bench = Bench::new();
    // Feasibility mode: Stage 2 is not the subject here.
    let options = Options::new(Mode::Feasible, Integrator::Euler);
    for (k, (reference, _)) in references().into_iter().enumerate() {
        let report = bench.plan(k, &options);
        assert_eq!(report.status, Status::Solved, "scenario {k}");
        let error = (report.translation.cost / reference - 1.0).abs();
        assert!(error < 1e-4, "scenario {k}: {error:e}");
    }
}

#[test]
fn stage_2_is_near_the_reference_in_the_mean() {
    let mut bench = Bench::new();
    let options = Options::new(Mode::Optimal, Integrator::Euler);
    let (mut ours, mut theirs) = (0.0, 0.0);
    for (k, (_, reference)) in references().into_iter().enumerate().step_by(5) {
        let report = bench.plan(k, &options);
        assert_eq!(report.status, Status::Solved, "scenario {k}");
        assert!(report.residuals.are_within(&bench.mission.tolerances));
        ours += report.reorientation.cost;
        theirs += reference;
    }
    assert!(ours <= 1.05 * theirs, "{ours} against {theirs}");
}

#[test]
fn rk4_plans_satisfy_rk4_dynamics_and_not_eulers() {
    let mut bench = Bench::new();
    let integrator = Integrator::Rk4 { substeps: 8 };
    let report = bench.plan(0, &Options::new(Mode::Optimal, integrator));
    assert_eq!(report.status, Status::Solved);
    let scenario = bench.set.scenarios[0].scenario();
    let (path, motion) = (bench.workspace.path(), bench.workspace.motion());
    let by_euler = verify(&bench.mission, &scenario, Integrator::Euler, path, motion);
    assert!(by_euler.dynamics2 > 1e-3);
}

#[test]
fn a_disturbed_plan_is_a_better_start_than_the_heuristic() {
    let mut bench = Bench::new();
    let options = Options::new(Mode::Optimal, Integrator::Euler);
    let (mut heuristic, mut disturbed) = (0, 0);
    for k in [0, 7, 21, 33, 48] {
        heuristic += bench.plan(k, &options).reorientation.outcome.iterations;
        let Workspace { translation, reorientation, .. } = &mut *bench.workspace;
        let (path, motion) = (&translation.trajectory, &mut reorientation.trajectory);
        disturb(&bench.mission, options.integrator, path, motion, 0.05, k as u64);
        let solver = &mut bench.solvers.1;
        let again = plan_reorientation(
            &bench.mission,
            &options,
            solver,
            &Environment::BARE,
            &mut bench.workspace,
        );
        assert_eq!(again.outcome.status, Status::Solved, "scenario {k}");
        disturbed += again.outcome.iterations;
    }
    assert!(disturbed < heuristic, "{disturbed} against {heuristic}");
}

#[test]
fn planning_fits_a_stack_of_256_kib() {
    let mission = Mission::<LINKS>::default();
    let scenario = public().scenarios[3].scenario();
    let mut workspace = Box::new(Workspace::new());
    let workspace = &mut *workspace;
    let status = std::thread::scope(|scope| {
        let planning = move || {
            let options = Options::new(Mode::Optimal, Integrator::Rk4 { substeps: 4 });
            let (mut one, mut two) = (ClarabelQp::default(), ClarabelQp::default());
            plan(&mission, &scenario, &options, (&mut one, &mut two), &Environment::BARE, workspace)
                .status
        };
        let thread = std::thread::Builder::new().stack_size(256 << 10);
        thread.spawn_scoped(scope, planning).unwrap().join().unwrap()
    });
    assert_eq!(status, Status::Solved);
}

#[test]
fn a_plan_does_not_depend_on_the_one_before() {
    let options = Options::new(Mode::Optimal, Integrator::Euler);
    let mut fresh = Bench::new();
    fresh.plan(4, &options);
    let mut used = Bench::new();
    used.plan(9, &Options::new(Mode::Feasible, Integrator::Euler));
    used.plan(4, &options);
    assert_eq!(fresh.workspace.path(), used.workspace.path());
    assert_eq!(fresh.workspace.motion(), used.workspace.motion());
}

#[test]
fn a_start_that_is_not_a_number_is_not_a_success() {
    let mut bench = Bench::new();
    let options = Options::new(Mode::Optimal, Integrator::Euler);
    bench.plan(0, &options);
    bench.workspace.reorientation.trajectory.states[20].rate.x = f64::NAN;
    let solver = &mut bench.solvers.1;
    let report = plan_reorientation(
        &bench.mission,
        &options,
        solver,
        &Environment::BARE,
        &mut bench.workspace,
    );
    assert_eq!(report.outcome.status, Status::NumericalFailure);
}

#[test]
fn the_iteration_limit_is_said_to_be_one() {
    let mut bench = Bench::new();
    let mut options = Options::new(Mode::Optimal, Integrator::Euler);
    options.reorientation.max_iterations = 2;
    let report = bench.plan(0, &options);
    assert_eq!(report.status, Status::IterationLimit);
    assert_eq!(report.reorientation.outcome.iterations, 2);
}
