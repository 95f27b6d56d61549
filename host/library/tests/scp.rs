//! The loop on a problem small enough to know the answer: a pendulum (or a linear spring) is swung
//! from rest to rest with the least control.

use nalgebra::{Matrix2, SMatrix, Vector2};
use remora_core::advanced::qp::{Qp, QpStage, Solution, Validate};
use remora_core::advanced::scp::{
    Iterates, Outcome, Problem, Residuals, Scratch, Settings, Status, solve,
};
use remora_core::advanced::time::{Clock, Deadline};
use remora_host::backend::ClarabelQp;
use std::sync::atomic::{AtomicU32, Ordering};

const N: usize = 21;
const H: f64 = 0.1;
const GOAL: f64 = 1.0;
const TOLERANCE: f64 = 1e-6;

/// Angle and rate at the nodes, control over the intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Swing {
    x: [Vector2<f64>; N],
    u: [f64; N],
}

impl Swing {
    /// At rest, the goal in one jump.
    const START: Self = Self { x: [Vector2::new(0.0, 0.0); N], u: [0.0; N] };
}

struct Pendulum {
    /// Restoring acceleration by angle, with its derivative.
    restoring: fn(f64) -> (f64, f64),
    /// Largest control; a negative one leaves no point at all.
    max_control: f64,
}

const SPRING: Pendulum = Pendulum { restoring: |x| (x, 1.0), max_control: 100.0 };
const GRAVITY: Pendulum = Pendulum { restoring: |x| (x.sin(), x.cos()), max_control: 100.0 };

impl Pendulum {
    fn next(&self, x: &Vector2<f64>, u: f64) -> Vector2<f64> {
        Vector2::new(x[0] + H * x[1], x[1] + H * (u - (self.restoring)(x[0]).0))
    }
}

impl Problem<N, 2, 1, 1> for Pendulum {
    type Trajectory = Swing;

    fn project(&self, z: &mut Swing) {
        z.x[0] = Vector2::zeros();
        z.x[N - 1] = Vector2::new(GOAL, 0.0);
    }

    fn linearise(&mut self, z: &Swing, _: Option<&Solution<N, 2, 1, 1>>, qp: &mut Qp<N, 2, 1, 1>) {
        qp.defect_penalty = 1.0;
        for k in 0..N {
            qp.stages[k] = QpStage::ZERO;
            if k + 1 < N {
                let stage = &mut qp.stages[k];
                stage.a = Matrix2::new(1.0, H, -H * (self.restoring)(z.x[k][0]).1, 1.0);
                stage.b = Vector2::new(0.0, H);
                stage.c = self.next(&z.x[k], z.u[k]) - z.x[k + 1];
                stage.hessian_uu = SMatrix::from([[2.0]]);
                stage.gradient_u[0] = 2.0 * z.u[k];
            }
        }
    }

    fn bound(&self, z: &Swing, radius: f64, qp: &mut Qp<N, 2, 1, 1>) {
        for (k, stage) in qp.stages.iter_mut().enumerate() {
            let reach = if k == 0 || k + 1 == N { 0.0 } else { radius };
            stage.lower_x.fill(-reach);
            stage.upper_x.fill(reach);
            stage.lower_u[0] = -self.max_control - z.u[k];
            stage.upper_u[0] = self.max_control - z.u[k];
        }
    }

    fn retract(&self, from: &Swing, _: &Qp<N, 2, 1, 1>, by: &Solution<N, 2, 1, 1>, to: &mut Swing) {
        for k in 0..N {
            to.x[k] = from.x[k] + by.x[k];
            to.u[k] = from.u[k] + by.u[k][0];
        }
    }

    fn residuals(&self, z: &Swing, out: &mut Residuals<N, 2, 1>) {
        out.cost = z.u[..N - 1].iter().map(|u| u * u).sum();
        for k in 0..N {
            out.path[k][0] = -1.0;
            out.defect[k].fill(0.0);
            if k + 1 < N {
                out.defect[k] = self.next(&z.x[k], z.u[k]) - z.x[k + 1];
            }
        }
    }

    fn violation(&self, residuals: &Residuals<N, 2, 1>) -> f64 {
        let worst = |worst: f64, d: &Vector2<f64>| worst.max(d.amax());
        residuals.defect.iter().fold(0.0, worst) / TOLERANCE
    }

    fn step_length(&self, step: &Solution<N, 2, 1, 1>) -> f64 {
        step.x.iter().fold(0.0, |longest, x| longest.max(x.amax()))
    }
}

fn settings() -> Settings {
    Settings { penalty_parameter: 1e3, cost_tolerance: 1e-9, radius: 10.0, ..Settings::default() }
}

fn run(problem: &mut Pendulum, settings: &Settings, start: Swing) -> (Outcome, Swing) {
    run_until(problem, settings, start, &Deadline::never())
}

fn run_until(
    problem: &mut Pendulum,
    settings: &Settings,
    start: Swing,
    deadline: &Deadline,
) -> (Outcome, Swing) {
    let (mut scratch, mut iterates) = (Box::new(Scratch::new()), Iterates::new(start));
    let mut solver = ClarabelQp::default();
    let outcome = solve(
        problem,
        &mut solver,
        &settings.validated().unwrap(),
        deadline,
        &mut scratch,
        &mut iterates,
    );
    (outcome, iterates.trajectory)
}

fn cost(swing: &Swing) -> f64 {
    swing.u[..N - 1].iter().map(|u| u * u).sum()
}

/// The least cost for the spring: of all controls that reach the goal, the shortest.
fn least_for_spring() -> f64 {
    let (a, b) = (Matrix2::new(1.0, H, -H, 1.0), Vector2::new(0.0, H));
    let mut gramian = Matrix2::zeros();
    for k in 0..N - 1 {
        let reach = a.pow(k as u32) * b;
        gramian += reach * reach.transpose();
    }
    let goal = Vector2::new(GOAL, 0.0);
    goal.dot(&(gramian.try_inverse().unwrap() * goal))
}

#[test]
fn a_linear_problem_takes_one_step_to_its_known_optimum() {
    let (outcome, swing) = run(&mut { SPRING }, &settings(), Swing::START);
    assert_eq!(outcome.status, Status::Solved);
    // One to get there, one to see that there is no better.
    assert_eq!(outcome.iterations, 2);
    assert!((cost(&swing) / least_for_spring() - 1.0).abs() < 1e-6);
}

#[test]
fn the_pendulum_reaches_one_optimum_from_different_starts() {
    let (outcome, first) = run(&mut { GRAVITY }, &settings(), Swing::START);
    assert_eq!(outcome.status, Status::Solved);
    assert!(outcome.violation <= 1.0);
    let mut other = Swing::START;
    for k in 0..N {
        other.x[k] = Vector2::new((k as f64).sin(), 1.0);
        other.u[k] = -2.0;
    }
    let (outcome, second) = run(&mut { GRAVITY }, &settings(), other);
    assert_eq!(outcome.status, Status::Solved);
    assert!((cost(&first) / cost(&second) - 1.0).abs() < 1e-5);
}

/// The last step gained more than the tolerance, but those to come would gain less together.
#[test]
fn what_leaves_little_to_gain_is_the_last_step() {
    let settings_at = |cost_tolerance| Settings { cost_tolerance, ..settings() };
    let (_, best) = run(&mut { GRAVITY }, &settings(), Swing::START);
    let (mut estimated, mut spared) = (0, 0);
    for cost_tolerance in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5] {
        let (mut scratch, mut iterates) = (Box::new(Scratch::new()), Iterates::new(Swing::START));
        let outcome = solve(
            &mut { GRAVITY },
            &mut ClarabelQp::default(),
            &settings_at(cost_tolerance).validated().unwrap(),
            &Deadline::never(),
            &mut scratch,
            &mut iterates,
        );
        assert_eq!(outcome.status, Status::Solved);
        let left = cost(&iterates.trajectory) / cost(&best) - 1.0;
        assert!(left <= cost_tolerance, "{left} of {cost_tolerance}");
        let last = iterates.log.last().unwrap();
        if last.actual_reduction > cost_tolerance * (last.cost + last.actual_reduction) {
            estimated += 1;
            // Another iteration confirms it.
            let sharp = settings_at(0.2 * cost_tolerance);
            let (confirmed, _) = run(&mut { GRAVITY }, &sharp, Swing::START);
            spared += confirmed.iterations - outcome.iterations;
        }
    }
    assert!(estimated > 0 && spared >= estimated, "{estimated}, {spared}");
}

#[test]
fn an_absolute_tolerance_is_what_is_left_at_most() {
    let (exact, best) = run(&mut { GRAVITY }, &settings(), Swing::START);
    let mut iterations = 0;
    for share in [1e-1, 1e-2, 1e-3, 1e-4] {
        let absolute_cost_tolerance = share * cost(&best);
        let settings = Settings { cost_tolerance: 0.0, absolute_cost_tolerance, ..settings() };
        let (outcome, swing) = run(&mut { GRAVITY }, &settings, Swing::START);
        assert_eq!(outcome.status, Status::Solved);
        let left = cost(&swing) - cost(&best);
        assert!(left <= absolute_cost_tolerance, "{left} of {absolute_cost_tolerance}");
        assert!(outcome.iterations >= iterations);
        iterations = outcome.iterations;
    }
    assert!(iterations < exact.iterations);
}

#[test]
fn the_first_feasible_iterate_is_enough_where_asked_for() {
    let feasible = Settings { stop_when_feasible: true, ..settings() };
    let (first, swing) = run(&mut { GRAVITY }, &feasible, Swing::START);
    let (optimal, best) = run(&mut { GRAVITY }, &settings(), Swing::START);
    assert_eq!((first.status, optimal.status), (Status::Solved, Status::Solved));
    assert!(first.violation <= 1.0 && first.iterations < optimal.iterations);
    assert!(cost(&swing) >= cost(&best) * (1.0 - 1e-9));
    // A start that is feasible is not touched but for its pins.
    let (again, same) = run(&mut { GRAVITY }, &feasible, swing);
    assert_eq!((again.status, again.iterations, same.u), (Status::Solved, 0, swing.u));
}

#[test]
fn the_iteration_limit_is_one() {
    let short = Settings { max_iterations: 1, ..settings() };
    let (outcome, _) = run(&mut { GRAVITY }, &short, Swing::START);
    assert_eq!((outcome.status, outcome.iterations), (Status::IterationLimit, 1));
}

#[test]
fn no_point_is_infeasible() {
    let (outcome, swing) =
        run(&mut Pendulum { max_control: -1.0, ..GRAVITY }, &settings(), Swing::START);
    assert_eq!(outcome.status, Status::Infeasible);
    assert_eq!(swing.u, Swing::START.u);
}

#[test]
fn a_model_that_breaks_down_on_the_way_is_never_solved() {
    let breaks: fn(f64) -> (f64, f64) = |x| if x > 0.5 { (f64::NAN, 1.0) } else { (x, 1.0) };
    let (outcome, _) =
        run(&mut Pendulum { restoring: breaks, ..SPRING }, &settings(), Swing::START);
    assert_ne!(outcome.status, Status::Solved);
    let always: fn(f64) -> (f64, f64) = |_| (f64::NAN, f64::NAN);
    let (outcome, _) =
        run(&mut Pendulum { restoring: always, ..SPRING }, &settings(), Swing::START);
    assert_eq!(outcome.status, Status::NumericalFailure);
}

/// A clock on which an hour passes before its reading of this number.
struct Jumps {
    readings: AtomicU32,
    at: u32,
}

impl Clock for Jumps {
    fn seconds(&self) -> f64 {
        let before = self.readings.fetch_add(1, Ordering::Relaxed);
        if before >= self.at { 3600.0 } else { 0.0 }
    }
}

#[test]
fn a_deadline_leaves_what_the_outcome_says() {
    let mut problem = GRAVITY;
    let mut residuals = Residuals::ZERO;
    let (mut ended, mut useful) = (0, 0);
    for at in 1..200 {
        let clock = Jumps { readings: AtomicU32::new(0), at };
        let deadline = Deadline::after(&clock, 60.0);
        let (outcome, swing) = run_until(&mut problem, &settings(), Swing::START, &deadline);
        problem.residuals(&swing, &mut residuals);
        // The first look at the clock is before the start was judged: nothing is known of it then.
        let known = problem.violation(&residuals);
        assert_eq!(outcome.violation, if at == 1 { f64::INFINITY } else { known }, "{at}");
        match outcome.status {
            Status::Deadline => useful += i32::from(outcome.violation <= 1.0),
            status => assert_eq!(status, Status::Solved),
        }
        ended += i32::from(outcome.status == Status::Deadline);
    }
    assert!(useful > 0 && ended > useful && ended < 199, "{ended}, {useful}");
}
