//! Plans that begin in the middle of a motion: what is left of a plan, from where a disturbed state is.

use crate::perturbation::{normal, uniform};
use nalgebra::Vector3;
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use remora_core::advanced::dynamics::State;
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::{
    Integrator, Mission, Scenario, TargetState, initial_bus_attitude,
};
use remora_core::advanced::planner::{
    EmbeddedSolver, InitialGuess, Nominal, Options, PlanSettings, Platform, Report, Workspace, plan,
};
use remora_core::advanced::stages::{LINKS, Mode, NODES, TranslationTrajectory};
use remora_core::prelude::{GuessRecord, Start, Status, Validate};
use remora_host::formats::{ScenarioSet, recovered};
use remora_host::memory::on_heap;
use remora_host::planning::WallClock;

/// Errors of a state: centre of mass [m, m/s], bus [rad, rad/s], joints [rad].
const DISTURBANCE: [f64; 5] = [1e-2, 2e-3, 2.0 * DEGREE, 0.02 * DEGREE, DEGREE];
const DEGREE: f64 = std::f64::consts::PI / 180.0;

struct Bench {
    mission: Mission<LINKS>,
    set: ScenarioSet,
    workspace: Box<Workspace>,
    solver: Box<EmbeddedSolver>,
}

/// What was planned, as the next plan begins from it.
struct InForce {
    nominal: Nominal,
    translation: Box<TranslationTrajectory<NODES>>,
    target: Box<[TargetState; NODES]>,
    report: Report,
}

fn direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    let normal = Vector3::from_fn(|_, _| normal(random));
    normal / normal.norm()
}

impl InForce {
    /// The scenario of what is left at a node, from the planned state.
    fn rest(&self, node: usize) -> Scenario {
        let target = &self.target[node];
        let to_body = quaternion::rotation_matrix(&target.attitude).transpose();
        let (duration, nodes) = self.nominal.left(self.nominal.time(node));
        Scenario {
            target_attitude: target.attitude,
            target_rate: to_body * target.rate,
            position: self.translation.position[node],
            velocity: self.translation.velocity[node],
            start: self.nominal.reorientation.states[node].as_start(),
            duration: Some(duration),
            nodes: Some(nodes),
        }
    }

    /// The scenario of what is left at a node, from a disturbed state.
    fn left(&self, node: usize, random: &mut ChaCha8Rng) -> Scenario {
        let [position, velocity, turn, rate, joint] = DISTURBANCE;
        let planned = self.nominal.reorientation.states[node];
        let tilt = quaternion::exp(&(direction(random) * turn));
        let state = State {
            attitude: quaternion::normalized(&quaternion::product(&tilt, &planned.attitude)),
            rate: planned.rate + direction(random) * rate,
            joint_angle: planned.joint_angle.map(|a| a + joint * (2.0 * uniform(random) - 1.0)),
            ..planned
        };
        let rest = self.rest(node);
        Scenario {
            position: rest.position + direction(random) * position,
            velocity: rest.velocity + direction(random) * velocity,
            start: state.as_start(),
            ..rest
        }
    }
}

impl Bench {
    fn new() -> Self {
        Self {
            mission: Mission::default(),
            set: ScenarioSet::built_in().unwrap(),
            workspace: on_heap(Workspace::new),
            solver: on_heap(EmbeddedSolver::new),
        }
    }

    fn plan(&mut self, scenario: &Scenario, integrator: Integrator, guess: InitialGuess) -> Report {
        let settings = PlanSettings::new(Mode::Optimal, integrator);
        let platform = Platform { clock: &WallClock::start(), executor: &Sequential };
        let options = Options::from_parts(settings, guess, platform);
        let Self { mission, workspace, solver, .. } = self;
        plan(mission, scenario, &options, &mut **solver, workspace)
    }

    fn in_force(&mut self, k: usize, integrator: Integrator) -> InForce {
        let scenario = self.set.scenarios[k].scenario().resized();
        let report = self.plan(&scenario, integrator, InitialGuess::Heuristic);
        let duration = self.mission.approach.duration_s;
        InForce {
            nominal: Nominal {
                reorientation: *self.workspace.reorientation(),
                nodes: NODES,
                duration,
            },
            translation: Box::new(*self.workspace.translation()),
            target: Box::new(self.workspace.target),
            report,
        }
    }
}

/// What became of plans from what is left of others.
#[derive(Default)]
struct Tally {
    count: usize,
    verified: usize,
    iterations: Vec<usize>,
    /// The same from the heuristic.
    heuristic: Vec<usize>,
    stage_2_s: Vec<f64>,
    failed: Vec<String>,
}

/// Replans from disturbed states at some nodes of the plans of some scenarios, from the plan in force.
fn replanned(
    scenarios: impl Iterator<Item = usize>,
    nodes: &[usize],
    integrator: Integrator,
) -> Tally {
    let mut bench = Bench::new();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut tally = Tally::default();
    for k in scenarios {
        let plan = bench.in_force(k, integrator);
        assert!(plan.report.is_verified());
        for &node in nodes {
            let scenario = plan.left(node, &mut random).validated().unwrap();
            let elapsed = plan.nominal.time(node);
            let guess = InitialGuess::Nominal { plan: &plan.nominal, elapsed };
            let report = bench.plan(&scenario, integrator, guess);
            let heuristic = bench.plan(&scenario, integrator, InitialGuess::Heuristic);
            tally.heuristic.push(heuristic.reorientation.outcome.iterations);
            tally.count += 1;
            tally.iterations.push(report.reorientation.outcome.iterations);
            tally.stage_2_s.push(report.reorientation.time_s);
            if report.is_verified() {
                tally.verified += 1;
                continue;
            }
            let worst = report.residuals.worst(&bench.mission.tolerances);
            let start = report.record.start;
            let why = format!("{k} from node {node}: {:?}, {worst:?}, {start:?}", report.status);
            tally.failed.push(why);
        }
    }
    tally.iterations.sort_unstable();
    tally.stage_2_s.sort_by(f64::total_cmp);
    tally
}

const RK4: Integrator = Integrator::Rk4 { substeps: 4 };

// Verifies REM-PLN-017.
#[test]
fn what_is_left_of_a_plan_is_planned_from_where_a_disturbed_state_is() {
    for integrator in [Integrator::Euler, RK4] {
        let tally = replanned([0, 20, 40].into_iter(), &[10, 25, 50], integrator);
        assert_eq!(tally.verified, tally.count, "{:?}", tally.failed);
        let sum = |iterations: &[usize]| iterations.iter().sum::<usize>();
        let (nominal, heuristic) = (sum(&tally.iterations), sum(&tally.heuristic));
        assert!(nominal < heuristic, "{nominal} {heuristic}");
    }
}

/// The whole of it, for the documents: `cargo test --release --test all moving -- --ignored --nocapture`.
#[test]
#[ignore = "nightly: 1320 plans"]
fn what_is_left_of_every_plan_is_planned() {
    for integrator in [Integrator::Euler, RK4] {
        let nodes: Vec<usize> = (5..=55).step_by(5).collect();
        let mut tally = replanned(0..60, &nodes, integrator);
        let Tally { count, verified, .. } = tally;
        println!("{integrator:?}: {verified} of {count} verified");
        tally.heuristic.sort_unstable();
        let [nominal, heuristic] = [&tally.iterations, &tally.heuristic].map(|all| all[count / 2]);
        println!("iterations of Stage 2: median {nominal}, from the heuristic {heuristic}");
        println!("time of Stage 2: median {:.1} ms", 1e3 * tally.stage_2_s[count / 2]);
        tally.failed.iter().for_each(|line| println!("  {line}"));
        assert!(verified * 100 >= count * 98, "{verified} of {count}");
    }
}

/// A scenario that starts as the first public one but for its bus and arm.
fn starting(change: impl FnOnce(&mut Start)) -> Scenario {
    let mut scenario: Scenario = ScenarioSet::built_in().unwrap().scenarios[0].scenario().resized();
    change(&mut scenario.start);
    scenario.validated().unwrap();
    scenario
}

// Verifies REM-PLN-016.
#[test]
fn a_joint_measured_beyond_its_stop_is_no_reason_to_have_no_plan() {
    let mut bench = Bench::new();
    let stop = bench.mission.servicer.max_joint_angle_rad[1];
    let beyond = starting(|start| start.joint_angle = Some([-0.3, stop + 1e-4, 0.0].into()));
    let report = bench.plan(&beyond, RK4, InitialGuess::Heuristic);
    assert!(report.is_verified(), "{:?}", report.residuals);
    assert_eq!(recovered(report.record.recovery), ["joint"]);
    // Behind recovery, 80 s, it is within the stop.
    for state in &bench.workspace.reorientation().states[4..] {
        assert!(state.joint_angle[1] <= stop);
    }
    let far = starting(|start| start.joint_angle = Some([-0.3, stop + 0.5, 0.0].into()));
    let report = bench.plan(&far, RK4, InitialGuess::Heuristic);
    assert_eq!((report.status, report.refusal.unwrap().name()), (Status::Infeasible, "joint"));
}

// Verifies REM-PLN-016.
#[test]
fn a_start_too_fast_or_out_of_view_is_led_back_and_the_record_says_so() {
    let mut bench = Bench::new();
    let limit = bench.mission.servicer.joint_rate_limit_rad_s[2];
    let fast = starting(|start| start.joint_rate[2] = 1.5 * limit);
    let report = bench.plan(&fast, RK4, InitialGuess::Heuristic);
    assert!(report.is_verified(), "{:?}", report.residuals);
    assert_eq!(recovered(report.record.recovery), ["joint_rate"]);
    for state in &bench.workspace.reorientation().states[4..] {
        assert!(state.joint_rate[2].abs() <= limit);
    }

    let scenario = starting(|_| ());
    let aside = quaternion::exp(&Vector3::new(0.0, 24.0 * DEGREE, 0.0));
    let attitude = initial_bus_attitude(&scenario.position);
    let attitude = quaternion::normalized(&quaternion::product(&attitude, &aside));
    let unseen = starting(|start| start.bus_attitude = Some(attitude));
    assert!(bench.mission.pointing_at_start(&unseen) < (20.0 * DEGREE).cos());
    let report = bench.plan(&unseen, RK4, InitialGuess::Heuristic);
    assert!(report.is_verified(), "{:?}", report.residuals);
    assert_eq!(recovered(report.record.recovery), ["pointing"]);
    // A start that is not given is refused for the same.
    let usual = bench.plan(&scenario, RK4, InitialGuess::Heuristic);
    assert_eq!((usual.refusal, usual.record.recovery), (None, 0));
}

// Verifies REM-PLN-017.
#[test]
fn the_plan_in_force_is_its_own_best_guess() {
    let mut bench = Bench::new();
    let plan = bench.in_force(7, RK4);
    for elapsed_nodes in [12, 30] {
        let scenario = plan.rest(elapsed_nodes);
        let elapsed = plan.nominal.time(elapsed_nodes);
        let guess = InitialGuess::Nominal { plan: &plan.nominal, elapsed };
        let nominal = bench.plan(&scenario, RK4, guess);
        assert_eq!((nominal.status, nominal.record.start), (Status::Solved, GuessRecord::Nominal));
        assert_eq!(nominal.record.recovery, 0);
        let heuristic = bench.plan(&scenario, RK4, InitialGuess::Heuristic);
        let (ours, theirs) = (nominal.reorientation, heuristic.reorientation);
        assert!(ours.outcome.iterations < theirs.outcome.iterations);
        assert!(ours.outcome.iterations <= 4, "{}", ours.outcome.iterations);
        assert!(ours.cost <= theirs.cost * 1.01, "{} {}", ours.cost, theirs.cost);
    }
}

/// Costs of both stages from `node` on.
fn rest(mission: &Mission<LINKS>, plan: &InForce, node: usize) -> [f64; 2] {
    let (w, units) = (&mission.weights, mission.cost_units());
    let (from, to) = (node, NODES - 1);
    let force = |k: usize| plan.translation.force[k].component_div(&units.force);
    let effort: f64 = (from..to).map(|k| force(k).norm_squared()).sum();
    let change: f64 = (from + 1..to).map(|k| (force(k) - force(k - 1)).norm_squared()).sum();
    let torque = |k: usize| {
        let control = &plan.nominal.reorientation.controls[k];
        w.bus_torque * control.bus_torque.component_div(&units.bus_torque).norm_squared()
            + w.joint_torque
                * control.joint_torque.component_div(&units.joint_torque).norm_squared()
    };
    [w.force * effort + w.force_change * change, (from..to).map(torque).sum()]
}

/// Plans the rest of plans again, undisturbed; returns the largest ratios of its costs to those of the rest
/// of the plan in force.
fn replanned_rest(integrator: Integrator, scenarios: &[usize], nodes: &[usize]) -> [f64; 2] {
    let mut bench = Bench::new();
    let mut worst = [0.0, 0.0];
    for &k in scenarios {
        let plan = bench.in_force(k, integrator);
        for &node in nodes {
            let scenario = plan.rest(node);
            let elapsed = plan.nominal.time(node);
            let guess = InitialGuess::Nominal { plan: &plan.nominal, elapsed };
            let report = bench.plan(&scenario, integrator, guess);
            assert!(report.is_verified(), "{k} from node {node}: {:?}", report.residuals);
            let costs = [report.translation.cost, report.reorientation.cost];
            for ((worst, new), old) in
                worst.iter_mut().zip(costs).zip(rest(&bench.mission, &plan, node))
            {
                // Costs that are rounding have no ratio.
                *worst = f64::max(*worst, (new - 1e-9) / old);
            }
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..Default::default() })]

    // Verifies REM-PLN-017.
    #[test]
    fn the_rest_of_a_plan_planned_again_is_no_costlier(
        scenario in 0..60_usize,
        node in 1..=NODES - 4,
        flown in any::<bool>(),
    ) {
        let integrator = if flown { RK4 } else { Integrator::Euler };
        let worst = replanned_rest(integrator, &[scenario], &[node]);
        prop_assert!(worst[0] <= 1.01 && worst[1] <= 1.01, "{worst:?}");
    }
}

/// The whole of it: `cargo test --release --test all moving -- --ignored --nocapture`.
#[test]
#[ignore = "nightly: 6720 plans"]
fn the_rest_of_every_plan_is_no_costlier() {
    let (all, nodes): (Vec<_>, Vec<_>) = ((0..60).collect(), (1..=NODES - 4).collect());
    for integrator in [Integrator::Euler, RK4] {
        let worst = replanned_rest(integrator, &all, &nodes);
        println!("{integrator:?}: costs over those of the rest, at most {worst:.4?}");
        assert!(worst[0] <= 1.01 && worst[1] <= 1.01, "{worst:?}");
    }
}
