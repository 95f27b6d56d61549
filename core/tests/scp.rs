//! The loop against a script: which iterate it leaves, whatever makes it end.

use remora_core::advanced::qp::{Qp, QpOutcome, QpSolver, QpStatus, Solution, Validate};
use remora_core::advanced::scp::{
    Iterates, Outcome, Problem, Residuals, Scratch, Settings, Status, solve,
};
use remora_core::advanced::time::{Clock, Deadline, NoClock};
use std::sync::atomic::{AtomicU32, Ordering};

type Program = Qp<2, 1, 1, 1>;
type Point = Solution<2, 1, 1, 1>;

/// Iterates by number: cost and violation of each. A step leads from one to the next, and every
/// program promises the same decrease.
struct Script(&'static [(f64, f64)], f64);

impl Problem<2, 1, 1, 1> for Script {
    type Trajectory = usize;

    fn project(&self, _: &mut usize) {}

    fn linearise(&mut self, _: &usize, _: Option<&Point>, qp: &mut Program) {
        qp.constant = -self.1;
    }

    fn bound(&self, _: &usize, _: f64, _: &mut Program) {}

    fn retract(&self, from: &usize, _: &Program, _: &Point, to: &mut usize) {
        *to = (from + 1).min(self.0.len() - 1);
    }

    fn residuals(&self, at: &usize, out: &mut Residuals<2, 1, 1>) {
        let (cost, violation) = self.0[*at];
        out.cost = cost;
        out.path[0][0] = 1e-3 * violation;
        out.path[1][0] = -1.0;
    }

    fn violation(&self, residuals: &Residuals<2, 1, 1>) -> f64 {
        1e3 * residuals.path[0][0]
    }

    fn step_length(&self, _: &Point) -> f64 {
        1.0
    }
}

/// Ends every program the same way.
struct Always(QpStatus);

impl QpSolver<2, 1, 1, 1> for Always {
    fn reset(&mut self) {}

    fn solve(&mut self, _: &Program, _: &mut Point, _: &Deadline) -> QpOutcome {
        QpOutcome { status: self.0, iterations: 3 }
    }
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

fn run(script: &'static [(f64, f64)], most: usize, solver: QpStatus) -> (Outcome, usize) {
    run_until(script, most, solver, &Deadline::never())
}

fn run_until(
    script: &'static [(f64, f64)],
    most: usize,
    solver: QpStatus,
    deadline: &Deadline,
) -> (Outcome, usize) {
    let (mut scratch, mut iterates) = (Scratch::new(), Iterates::new(0));
    let settings = Settings { max_iterations: most, ..Settings::default() }.validated().unwrap();
    let (mut problem, mut solver) = (Script(script, 1.0), Always(solver));
    let outcome =
        solve(&mut problem, &mut solver, &settings, deadline, &mut scratch, &mut iterates);
    (outcome, iterates.trajectory)
}

/// Feasible at 1 and 3; each step is worth its promise.
const WANDERING: &[(f64, f64)] =
    &[(9.0, 50.0), (8.0, 0.5), (7.0, 9.0), (6.0, 0.5), (5.0, 8.0), (4.0, 7.0), (3.0, 7.0)];

// Verifies REM-SCP-002.
#[test]
fn the_best_feasible_iterate_is_left() {
    for (most, left, is_earlier) in
        [(1, 1, false), (2, 1, true), (3, 3, false), (4, 3, true), (5, 3, true), (6, 3, true)]
    {
        let (outcome, at) = run(WANDERING, most, QpStatus::Solved);
        assert_eq!(outcome.status, Status::IterationLimit);
        assert_eq!((outcome.iterations, at, outcome.is_earlier), (most, left, is_earlier));
        assert_eq!(outcome.violation, 0.5, "after {most}");
    }
    // The start counts too.
    let (outcome, at) = run(&WANDERING[1..3], 1, QpStatus::Solved);
    assert_eq!((at, outcome.is_earlier, outcome.violation), (0, true, 0.5));
}

/// At an optimum the program promises nothing, or less.
#[test]
fn a_program_that_promises_nothing_ends_the_loop_where_it_is() {
    let end = |script, promise| {
        let (mut scratch, mut iterates) = (Scratch::new(), Iterates::new(0));
        let settings =
            Settings { max_iterations: 3, max_radius: 9.0, radius: 9.0, ..Settings::DEFAULT };
        let settings = settings.validated().unwrap();
        let (mut problem, mut solver) = (Script(script, promise), Always(QpStatus::Solved));
        let deadline = Deadline::never();
        let z = &mut iterates;
        let outcome = solve(&mut problem, &mut solver, &settings, &deadline, &mut scratch, z);
        (outcome.status, outcome.iterations, iterates.trajectory)
    };
    const WORSE: &[(f64, f64)] = &[(9.0, 0.5), (9.001, 0.5)];
    assert_eq!(end(WORSE, -1e-6), (Status::Solved, 1, 0));
    assert_eq!(end(WORSE, 1e-6), (Status::Solved, 1, 0));
    // A loss of any size, where what is not counted is paid for; not where the step turns out to gain.
    assert_eq!(end(&[(9.0, 0.5), (9.5, 0.4)], -1.0), (Status::Solved, 1, 0));
    assert_eq!(end(&[(9.0, 0.5), (8.5, 0.5)], -1.0), (Status::IterationLimit, 3, 0));
    // What is promised and not kept is no optimum, and an infeasible one is no plan.
    assert_eq!(end(WORSE, 1.0), (Status::IterationLimit, 3, 0));
    for promise in [-1e-6, -1.0] {
        assert_eq!(end(&[(9.0, 2.0), (9.001, 2.0)], promise), (Status::IterationLimit, 3, 0));
    }
}

#[test]
fn without_a_feasible_iterate_the_last_is_left() {
    let (outcome, at) = run(&[(9.0, 50.0), (8.0, 40.0), (7.0, 60.0)], 2, QpStatus::Solved);
    assert_eq!((outcome.status, at, outcome.is_earlier), (Status::IterationLimit, 2, false));
    assert_eq!(outcome.violation, 60.0);
}

// Verifies REM-SCP-002.
#[test]
fn a_deadline_ends_the_loop_wherever_it_strikes() {
    let mut last = 0;
    for at in 1..60 {
        let clock = Jumps { readings: AtomicU32::new(0), at };
        let deadline = Deadline::after(&clock, 60.0);
        let (outcome, left) = run_until(WANDERING, 6, QpStatus::Solved, &deadline);
        if outcome.status == Status::Deadline {
            assert!(outcome.iterations >= last, "{at}");
            // Start, or feasible.
            assert!(left == 0 || outcome.violation == 0.5, "{at}: {left}");
            last = outcome.iterations;
        }
    }
    assert_eq!(last, 6);
}

#[test]
fn a_solver_out_of_time_is_a_deadline_at_once() {
    for status in [QpStatus::TimeLimit, QpStatus::Interrupted] {
        let (outcome, at) = run(WANDERING, 6, status);
        assert_eq!((outcome.status, outcome.iterations, at), (Status::Deadline, 1, 0));
    }
}

#[test]
fn other_failures_try_smaller_regions_first() {
    let (outcome, _) = run(WANDERING, 50, QpStatus::Infeasible);
    assert_eq!(outcome.status, Status::Infeasible);
    assert!(outcome.iterations > 1);
    // Nothing has broken down: it rests at a trajectory that violates constraints.
    let (outcome, _) = run(WANDERING, 50, QpStatus::Stalled);
    assert_eq!((outcome.status, outcome.violation), (Status::Infeasible, 50.0));
    // At a feasible one it has merely not converged.
    let (outcome, _) = run(&WANDERING[1..], 50, QpStatus::Stalled);
    assert_eq!((outcome.status, outcome.violation), (Status::IterationLimit, 0.5));
    let (outcome, _) = run(WANDERING, 50, QpStatus::NumericalFailure);
    assert_eq!(outcome.status, Status::NumericalFailure);
}

// Verifies REM-SCP-001.
#[test]
fn what_is_not_a_number_is_never_solved() {
    let (outcome, at) = run(&[(f64::NAN, 0.0)], 5, QpStatus::Solved);
    assert_eq!((outcome.status, outcome.iterations, at), (Status::NumericalFailure, 0, 0));
    let (outcome, at) = run(&[(9.0, 50.0), (f64::NAN, 0.0)], 50, QpStatus::Solved);
    assert_eq!((outcome.status, at), (Status::NumericalFailure, 0));
    let (outcome, at) = run(&[(9.0, 50.0), (8.0, f64::NAN)], 50, QpStatus::Solved);
    assert_eq!((outcome.status, at), (Status::NumericalFailure, 0));
}

#[test]
fn a_clock_that_stands_still_never_ends_it() {
    let deadline = Deadline::after(&NoClock, 1e-9);
    let (outcome, _) = run_until(WANDERING, 3, QpStatus::Solved, &deadline);
    assert_eq!(outcome.status, Status::IterationLimit);
}
