//! Caps on iterations and time, and the same bits whatever was solved before.

use super::common::kkt::Kkt;
use super::common::programs::{Answer, Recipe, bits, cold, embedded, next, random};
use remora_qp::time::{Clock, Deadline, NoClock};
use remora_qp::{InteriorPointSettings, Qp, QpSolver, QpStatus, Solution, Validate};
use std::sync::atomic::{AtomicU32, Ordering};

/// The subject of these tests: a program of moderate size.
fn program(seed: u64) -> Box<Qp<12, 4, 2, 1>> {
    random(&Recipe { seed, ..Recipe::PLAIN })
}

// Verifies REM-QP-003.
#[test]
fn the_cap_on_iterations_is_one() {
    let qp = program(3);
    let mut solver = embedded();
    let free = cold(&mut *solver, &qp).outcome.iterations;
    assert!(free > 2);
    for most in [1, 2] {
        solver.configure(
            InteriorPointSettings { max_iterations: most, ..solver.settings() }
                .validated()
                .unwrap(),
        );
        let outcome = cold(&mut *solver, &qp).outcome;
        assert_eq!((outcome.status, outcome.iterations), (QpStatus::IterationLimit, most));
    }
    solver.configure(
        InteriorPointSettings { max_iterations: free, ..solver.settings() }.validated().unwrap(),
    );
    assert_eq!(cold(&mut *solver, &qp).outcome.status, QpStatus::Solved);
}

#[test]
fn a_fixed_number_of_iterations_is_exactly_that() {
    let qp = program(3);
    let mut solver = embedded();
    let free = cold(&mut *solver, &qp).outcome.iterations;
    for count in [1, 2, free, free + 1, free + 5, 40] {
        solver.configure(
            InteriorPointSettings { fixed_iterations: Some(count), ..solver.settings() }
                .validated()
                .unwrap(),
        );
        let answer = cold(&mut *solver, &qp);
        assert_eq!(answer.outcome.iterations, count);
        let kkt = Kkt::of(&qp, &answer.point);
        if count >= free {
            assert!(answer.outcome.status.is_usable(), "{count}: {:?}", answer.outcome);
            assert!(kkt.worst() <= 1e-8, "{count}: {kkt:?}");
        } else {
            assert_eq!(answer.outcome.status, QpStatus::IterationLimit, "{count}");
        }
    }
}

#[test]
fn a_deadline_that_has_passed_ends_it_at_once() {
    let qp = program(3);
    let passed = Deadline::after(&NoClock, 0.0);
    let mut point = Box::new(Solution::ZERO);
    let ours = embedded().solve(&qp, &mut point, &passed);
    assert_eq!((ours.status, ours.iterations), (QpStatus::TimeLimit, 0));
    let again = embedded().solve_again(&qp, &mut point, &passed);
    assert_eq!(again.status, QpStatus::TimeLimit);
}

/// A clock that ticks each time it is read.
struct Ticks(AtomicU32);

impl Clock for Ticks {
    fn seconds(&self) -> f64 {
        f64::from(self.0.fetch_add(1, Ordering::Relaxed) + 1)
    }
}

// Verifies REM-QP-003.
#[test]
fn a_deadline_is_looked_at_in_every_iteration() {
    let qp = program(3);
    let mut solver = embedded();
    let free = cold(&mut *solver, &qp).outcome.iterations;
    let mut point = Box::new(Solution::ZERO);
    let clock = Ticks(AtomicU32::new(0));
    solver.reset();
    let outcome = solver.solve(&qp, &mut point, &Deadline::after(&clock, 3.5));
    assert_eq!(outcome.status, QpStatus::TimeLimit);
    assert!(outcome.iterations < free && outcome.iterations <= 4, "{outcome:?}");
    // One that is far away changes nothing.
    let expected = cold(&mut *solver, &qp);
    let mut point = Box::new(Solution::ZERO);
    solver.reset();
    let outcome = solver.solve(&qp, &mut point, &Deadline::after(&clock, 1e9));
    assert_eq!(outcome, expected.outcome);
    assert_eq!(bits(&point), bits(&expected.point));
}

// Verifies REM-QP-004.
#[test]
fn after_a_reset_the_bits_do_not_depend_on_what_was_solved_before() {
    let qp = program(3);
    let expected = cold(&mut *embedded(), &qp);
    let mut used = embedded();
    for seed in 10..14 {
        cold(&mut *used, &program(seed));
    }
    let mut point = cold(&mut *used, &random(&Recipe { seed: 9, ..Recipe::HARD })).point;
    used.solve_again(&program(10), &mut point, &Deadline::never());
    let again = cold(&mut *used, &qp);
    assert_eq!(again.outcome, expected.outcome);
    assert_eq!(bits(&again.point), bits(&expected.point));
}

#[test]
fn no_solve_depends_on_the_one_before() {
    let (first, second) = (program(3), program(4));
    let mut solver = embedded();
    let expected = cold(&mut *solver, &second);
    let before = cold(&mut *solver, &first);
    let after = next(&mut *solver, &second, &before);
    assert_eq!(after.outcome, expected.outcome);
    assert_eq!(bits(&after.point), bits(&expected.point));
}

/// A QP that says what complementarity is enough is solved to that and no further; what is not a number or less
/// than the settings ask for counts as nothing said, more than 1e-4 as that.
#[test]
fn a_qp_says_how_exact_it_has_to_be() {
    let mut solver = embedded();
    let settings = solver.settings();
    let mut exact = program(3);
    let expected = cold(&mut *solver, &exact);
    for nothing in [f64::NAN, -1.0, f64::NEG_INFINITY, 1e-15] {
        exact.complementarity = nothing;
        let same = cold(&mut *solver, &exact);
        assert_eq!((same.outcome, bits(&same.point)), (expected.outcome, bits(&expected.point)));
    }
    let mut iterations = expected.outcome.iterations;
    for (asked, granted) in [(1e-9, 1e-9), (1e-7, 1e-7), (1e-4, 1e-4), (f64::INFINITY, 1e-4)] {
        let mut qp = program(3);
        qp.complementarity = asked;
        let Answer { point, outcome } = cold(&mut *solver, &qp);
        let kkt = Kkt::of(&qp, &point);
        // States and controls of this QP are below ten, by which tolerances scale at most.
        assert!(kkt.complementarity <= 10.0 * granted, "{kkt:?}");
        assert!(kkt.complementarity > 10.0 * settings.complementarity, "{kkt:?}");
        let residual = settings.tolerance.max(0.01 * granted);
        assert!(kkt.stationarity.max(kkt.primal) <= 10.0 * residual, "{kkt:?}");
        assert!(outcome.status == QpStatus::Solved && outcome.iterations <= iterations);
        iterations = outcome.iterations;
    }
    assert!(iterations < expected.outcome.iterations);
}
