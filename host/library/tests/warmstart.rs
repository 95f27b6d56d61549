//! The learned start: its features, its actions and what the planner makes of it.

#[path = "scripts/mod.rs"]
mod scripts;

use nalgebra::Vector3;
use remora_core::advanced::dynamics::Integrator;
use remora_core::advanced::executor::Sequential;
use remora_core::advanced::math::quaternion;
use remora_core::advanced::model::Roll;
use remora_core::advanced::planner::{
    GuessRecord, InitialGuess, Options, PlanSettings, Platform, Workspace, plan,
};
use remora_core::advanced::scp::Status;
use remora_core::advanced::stages::{LINKS, Mode, NODES, ReorientationTrajectory};
use remora_core::advanced::time::Clock;
use remora_core::advanced::warmstart::{ACTION, Action, Encoding, MAX_FEATURES, Scene};
use remora_host::draw::draw_one;
use remora_host::formats::Mission;
use remora_host::learned::Learned;
use remora_host::memory::on_large_stack;
use remora_host::method::Method;
use remora_host::planning::Planner;
use remora_host::request::{Guess, PlanRequest};
use scripts::{Bench, RK4, Script, distance, limited};

#[test]
fn the_actions_of_a_plan_roll_out_to_the_plan() {
    let mut bench = Bench::new();
    for (integrator, tolerance) in [(Integrator::Euler, 1e-4), (RK4, 1e-3)] {
        bench.plan(0, integrator, &InitialGuess::Heuristic);
        let planned = *bench.workspace.reorientation();
        for action in [Action::Torque, Action::Rate] {
            let rolled = bench.rollout(integrator, &Script::of(action, &planned));
            let distance = distance(&planned, &rolled);
            assert!(distance < tolerance, "{integrator:?} {action:?}: {distance:e}");
            let miss = bench.scene(integrator).miss(&rolled.states[NODES - 1]);
            assert!(miss < 2.0 * tolerance, "{integrator:?} {action:?}: {miss} m");
        }
    }
}

#[test]
fn a_chunk_is_carried_out_before_the_next_is_asked_for() {
    let mut bench = Bench::new();
    bench.plan(0, Integrator::Euler, &InitialGuess::Heuristic);
    let planned = *bench.workspace.reorientation();
    let one = bench.rollout(Integrator::Euler, &Script::of(Action::Rate, &planned));
    let mut script = Script { chunk: 5, ..Script::of(Action::Rate, &planned) };
    for (executed, stride) in [(1, 1), (5, 1), (5, 5)] {
        (script.executed, script.stride) = (executed, stride);
        assert!(bench.rollout(Integrator::Euler, &script) == one);
    }
}

/// A policy for plans of other nodes is not asked.
// Verifies REM-PLN-020.
#[test]
fn a_model_for_other_nodes_gives_way_to_the_heuristic() {
    let mut bench = Bench::new();
    bench.plan(3, Integrator::Euler, &InitialGuess::Heuristic);
    let script = Script::of(Action::Rate, bench.workspace.reorientation());
    bench.mission.approach.nodes = 30;
    let heuristic = bench.plan(3, Integrator::Euler, &InitialGuess::Heuristic);
    let start = InitialGuess::Learned { policy: &script, seed: 0 };
    let learned = bench.plan(3, Integrator::Euler, &start);
    let record = learned.record;
    assert_eq!((record.start, record.output), (GuessRecord::Unfit, heuristic.record.output));
    assert!(record.start.is_fallback() && record.start.why().is_some());
}

/// From a plan of its own the loop ends after a few iterations, hardly ever more than three; where it takes
/// more, it has found a cheaper plan.
#[test]
fn a_plan_is_a_good_start_for_itself() {
    let mut bench = Bench::new();
    for integrator in [Integrator::Euler, RK4] {
        let mut long = 0;
        for scenario in 0..12 {
            let first = bench.plan(scenario, integrator, &InitialGuess::Heuristic);
            let script = Script::of(Action::Rate, bench.workspace.reorientation());
            let start = InitialGuess::Learned { policy: &script, seed: 0 };
            let again = bench.plan(scenario, integrator, &start);
            assert_eq!((again.status, again.record.start), (Status::Solved, GuessRecord::Learned));
            let [first, again] = [first, again].map(|report| report.reorientation);
            let (iterations, change) = (again.outcome.iterations, again.cost / first.cost);
            let few = iterations <= 3;
            assert!(
                change <= if few { 1.001 } else { 0.999 },
                "{scenario}: {iterations}, {change}"
            );
            long += usize::from(!few);
        }
        assert!(long <= 2, "{long} of 12 with {integrator}");
    }
}

/// Whatever a model answers, there is a plan: the heuristic's.
// Verifies REM-LRN-003.
#[test]
fn a_bad_start_gives_way_to_the_heuristic() {
    let mut bench = Bench::new();
    let first = bench.plan(5, Integrator::Euler, &InitialGuess::Heuristic);
    let planned = *bench.workspace.reorientation();
    let bad: [(Script, GuessRecord); 3] = [
        (Script::new(Action::Rate, vec![[f32::NAN; ACTION]]), GuessRecord::NotFinite),
        (Script::new(Action::Torque, vec![[f32::INFINITY; ACTION]]), GuessRecord::NotFinite),
        (Script::new(Action::Torque, vec![[2e-5; ACTION]]), GuessRecord::Worse),
    ];
    for (script, record) in bad {
        let start = InitialGuess::Learned { policy: &script, seed: 0 };
        let report = bench.plan(5, Integrator::Euler, &start);
        assert_eq!(report.record.start, record);
        assert!(report.record.start.is_fallback());
        assert!(*bench.workspace.reorientation() == planned, "{record:?}");
        assert_eq!(report.record.output, first.record.output);
        assert_ne!(report.record.settings, first.record.settings);
    }
    let report = bench.plan(5, Integrator::Euler, &InitialGuess::Refused);
    assert_eq!(report.record.start, GuessRecord::Refused);
    assert_eq!(report.record.output, first.record.output);
}

/// A start from which Stage 2 ends unsolved costs iterations, not the plan.
// Verifies REM-LRN-003.
#[test]
fn a_start_that_fails_is_followed_by_the_heuristic() {
    let mut bench = Bench::new();
    // From where the heuristic is after one iteration, one more is not enough. The budget is that
    // of both tries together.
    let mut options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    options.reorientation = limited(&options.reorientation, 1);
    options.learned = limited(&options.learned, 1);
    let first = bench.plan_with(6, &options, &InitialGuess::Heuristic);
    assert_eq!(first.status, Status::IterationLimit);
    let heuristic = *bench.workspace.reorientation();
    let script = Script::of(Action::Rate, bench.workspace.reorientation());
    options.reorientation = limited(&options.reorientation, 2);
    let start = InitialGuess::Learned { policy: &script, seed: 0 };
    let report = bench.plan_with(6, &options, &start);
    assert_eq!(report.record.start, GuessRecord::Unsolved);
    assert!(*bench.workspace.reorientation() == heuristic);
    assert_eq!(report.reorientation.outcome.iterations, 2);
    assert_eq!(report.record.reorientation.iterations, 2);
    assert!(report.record.reorientation.qp_iterations > first.record.reorientation.qp_iterations);
}

/// A clock that goes a second further each time it is looked at.
struct Hasty(std::sync::atomic::AtomicU32);

impl Clock for Hasty {
    fn seconds(&self) -> f64 {
        f64::from(self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed))
    }
}

#[test]
fn without_time_nothing_is_rolled_out() {
    let mut bench = Bench::new();
    let scenario = bench.set.scenarios[0].scenario().resized();
    let mut options = PlanSettings::new(Mode::Optimal, Integrator::Euler);
    options.deadline_s = 0.5;
    let script = Script::new(Action::Rate, Vec::new());
    let start = InitialGuess::Learned { policy: &script, seed: 0 };
    let clock = Hasty(std::sync::atomic::AtomicU32::new(0));
    let platform = Platform { clock: &clock, executor: &Sequential };
    let Bench { mission, workspace, solver, .. } = &mut bench;
    let report = plan(
        mission,
        &scenario,
        &Options::from_parts(options, start, platform),
        &mut **solver,
        workspace,
    );
    assert_eq!(report.record.start, GuessRecord::Deadline);
    assert_eq!(report.status, Status::Deadline);
    assert!(report.times.inference_s > 0.0);
}

/// Turning the whole scene turns nothing in bus axes but the orbit's own directions.
#[test]
fn bus_axes_do_not_see_where_the_approach_points() {
    let mut bench = Bench::new();
    bench.plan(1, Integrator::Euler, &InitialGuess::Heuristic);
    let Workspace { target, translation, .. } = &*bench.workspace;
    let path = &translation.trajectory;
    let turn = quaternion::exp(&Vector3::new(0.3, -1.1, 0.7));
    let rotation = quaternion::rotation_matrix(&turn);
    let mut turned_path = *path;
    let mut turned_target = *target;
    for k in 0..NODES {
        for vectors in
            [&mut turned_path.position, &mut turned_path.velocity, &mut turned_path.force]
        {
            vectors[k] = rotation * vectors[k];
        }
        turned_target[k].attitude = quaternion::product(&turn, &target[k].attitude);
        turned_target[k].rate = rotation * target[k].rate;
    }
    let scene = Scene::new(&bench.mission, &bench.scenario, path, target, Integrator::Euler);
    let turned = Scene::new(
        &bench.mission,
        &bench.scenario,
        &turned_path,
        &turned_target,
        Integrator::Euler,
    );
    for k in [0, 7, 30, 57, 58, 59] {
        let state = bench.workspace.reorientation().states[k];
        let mut turned_state = state;
        turned_state.attitude = quaternion::product(&turn, &state.attitude);
        turned_state.rate = rotation * state.rate;
        let previous = [0.1; ACTION];
        let [mut a, mut b] = [[0.0f32; MAX_FEATURES]; 2];
        scene.features(Encoding::Body, k, &state, &previous, &mut a);
        turned.features(Encoding::Body, k, &turned_state, &previous, &mut b);
        let [_, _, ahead, ..] = Encoding::Body.groups(LINKS);
        let orbit = ACTION + 1 + ahead..ACTION + 1 + ahead + 6;
        for i in (0..Encoding::Body.features(LINKS)).filter(|i| !orbit.contains(i)) {
            assert!((a[i] - b[i]).abs() <= 1e-6 * a[i].abs().max(1.0), "node {k}, feature {i}");
        }
        assert!(a.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn the_paper_sees_attitudes_of_one_sign() {
    let mut bench = Bench::new();
    bench.plan(2, Integrator::Euler, &InitialGuess::Heuristic);
    let Workspace { target, translation, .. } = &*bench.workspace;
    let scene = Scene::new(
        &bench.mission,
        &bench.scenario,
        &translation.trajectory,
        target,
        Integrator::Euler,
    );
    let state = bench.workspace.reorientation().states[20];
    let opposite = remora_core::advanced::dynamics::State { attitude: -state.attitude, ..state };
    let [mut a, mut b] = [[0.0f32; MAX_FEATURES]; 2];
    scene.features(Encoding::Paper, 20, &state, &[0.0; ACTION], &mut a);
    scene.features(Encoding::Paper, 20, &opposite, &[0.0; ACTION], &mut b);
    assert_eq!(a, b);
    assert!(a[Encoding::Paper.features(LINKS)..].iter().all(|value| *value == 0.0));
}

/// A network of many servicers sees what one of the built-in one sees, and beside the time which servicer it is.
#[test]
fn the_servicers_numbers_stand_beside_the_time() {
    let mut bench = Bench::new();
    bench.plan(2, Integrator::Euler, &InitialGuess::Heuristic);
    let Workspace { target, translation, reorientation, .. } = &*bench.workspace;
    let mut other = bench.mission;
    other.servicer.links[1].mass_kg *= 1.25;
    other.servicer.joint_torque_limit_n_m[2] *= 0.5;
    let time = ACTION + 1;
    let own = 7 + 5 * LINKS;
    let seen = |mission| {
        let path = &translation.trajectory;
        let scene = Scene::new(mission, &bench.scenario, path, target, Integrator::Euler);
        let state = reorientation.trajectory.states[20];
        let [mut body, mut servicer] = [[0.0f32; MAX_FEATURES]; 2];
        scene.features(Encoding::Body, 20, &state, &[0.1; ACTION], &mut body);
        scene.features(Encoding::Servicer, 20, &state, &[0.1; ACTION], &mut servicer);
        assert_eq!(servicer[..time], body[..time]);
        assert_eq!(servicer[time + own..], body[time..MAX_FEATURES - own]);
        servicer[time..time + own].to_vec()
    };
    let (built_in, changed) = (seen(&bench.mission), seen(&other));
    assert_eq!(built_in[..10], [500.0, 83.3, 83.3, 83.3, 5e-3, 5e-3, 5e-3, 0.75, 0.75, 0.3]);
    assert_eq!(built_in[10..19], [10.0, 10.0, 10.0, 5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-3]);
    let differ: Vec<_> = (0..own).filter(|i| built_in[*i] != changed[*i]).collect();
    assert_eq!((differ, changed[11], changed[18]), (vec![11, 18], 12.5, 2.5e-3));
}

/// What is handed in is treated as a model's roll-out is, to the last bit.
#[test]
fn a_given_start_is_as_good_as_a_learned_one() {
    let mut bench = Bench::new();
    bench.plan(3, Integrator::Euler, &InitialGuess::Heuristic);
    let script = Script::of(Action::Rate, bench.workspace.reorientation());
    let rolled = bench.rollout(Integrator::Euler, &script);
    let start = InitialGuess::Learned { policy: &script, seed: 0 };
    let learned = bench.plan(3, Integrator::Euler, &start);
    let given = bench.plan(3, Integrator::Euler, &InitialGuess::User(&rolled));
    assert_eq!((given.status, given.record.start), (Status::Solved, GuessRecord::User));
    assert!(!given.record.start.is_fallback());
    assert_eq!(given.record.output, learned.record.output);
    assert_eq!(given.reorientation.outcome, learned.reorientation.outcome);
    // Every bit of it stands in the evidence.
    let mut other = rolled;
    other.controls[NODES - 1].bus_torque.x = 1e-300;
    let again = bench.plan(3, Integrator::Euler, &InitialGuess::User(&other));
    assert_eq!(again.record.output, given.record.output);
    assert_ne!(again.record.settings, given.record.settings);
    assert_ne!(given.record.settings, learned.record.settings);
}

/// Whatever is handed in, there is a plan: the heuristic's.
#[test]
fn a_bad_given_start_gives_way_to_the_heuristic() {
    let mut bench = Bench::new();
    let first = bench.plan(5, Integrator::Euler, &InitialGuess::Heuristic);
    let planned = *bench.workspace.reorientation();
    let changed = |change: &dyn Fn(&mut ReorientationTrajectory<NODES, LINKS>)| {
        let mut motion = planned;
        change(&mut motion);
        motion
    };
    let bad = [
        (changed(&|z| z.states[7].rate.x = f64::NAN), GuessRecord::NotFinite),
        (changed(&|z| z.controls[59].joint_torque[2] = f64::INFINITY), GuessRecord::NotFinite),
        (changed(&|z| z.states[20].attitude.fill(0.0)), GuessRecord::NotFinite),
        (changed(&|z| z.states[20].attitude *= 1e-200), GuessRecord::NotFinite),
        (changed(&|z| z.states[20].rate.z = -1e300), GuessRecord::NotFinite),
        (changed(&|z| z.states[20].rate.y = 1e3), GuessRecord::Worse),
        (changed(&|z| z.states[30].attitude.x *= -1.0), GuessRecord::Worse),
        (ReorientationTrajectory::ZERO, GuessRecord::Worse),
    ];
    for (motion, record) in bad {
        let report = bench.plan(5, Integrator::Euler, &InitialGuess::User(&motion));
        assert_eq!(report.record.start, record);
        assert!(report.record.start.is_fallback());
        assert_eq!(report.record.output, first.record.output);
    }
    // What lies beyond a limit is moved to it first, and may do.
    let fast = changed(&|z| z.states[20].joint_rate[0] = 1e300);
    let report = bench.plan(5, Integrator::Euler, &InitialGuess::User(&fast));
    assert_eq!((report.status, report.record.start), (Status::Solved, GuessRecord::User));
}

/// A mission whose approaches begin otherwise than those that a model has learnt from gets the heuristic,
/// and the reason; so do other arms and a given roll.
// Verifies REM-PLN-020.
#[test]
fn a_model_is_not_used_where_it_has_not_learnt() {
    let method = Method { integrator: Integrator::Euler, ..Method::default() };
    let guess = Guess::from(Learned::built_in(method.integrator));
    let request = |mission: &Mission| PlanRequest {
        mission: *mission,
        method,
        guess: guess.clone(),
        ..PlanRequest::default()
    };
    let begin = |mission: &Mission| {
        let scenario = draw_one(1, 0, mission).unwrap();
        let plan = || Planner::new().plan(&request(mission), &scenario);
        on_large_stack(plan).unwrap().evidence.start
    };
    let own = Mission::default();
    assert_eq!(begin(&own), GuessRecord::Learned);
    let mut fast = own;
    fast.scenarios.rate_norm_rad_s = Some(1f64.to_radians());
    assert_eq!(begin(&fast), GuessRecord::Unfit);
    let mut long = own;
    long.approach.duration_s = 7200.0;
    assert_eq!(begin(&long), GuessRecord::Unfit);
    let mut rolled = own;
    rolled.roll = Some(Roll { end_effector: Vector3::x(), port: Vector3::y() });
    assert_eq!(begin(&rolled), GuessRecord::Unfit);
    let scenario = draw_one(1, 0, &own).unwrap();
    let four = Mission::from(own.sized::<4>());
    let plan = || Planner::new().plan(&request(&four), &scenario);
    assert_eq!(on_large_stack(plan).unwrap().evidence.start, GuessRecord::Unfit);
}
