//! The solver's trait, its statuses, and what identifies a solver.

use super::common::programs::{Recipe, bits, cold, embedded, random};
use remora_qp::nalgebra::Matrix1;
use remora_qp::time::Deadline;
use remora_qp::{
    Checksum, EmbeddedQp, InteriorPointSettings, MAX_SOLVER_ITERATIONS, Qp, QpOutcome, QpSolver,
    QpStatus, Solution, Valid, Validate,
};

type Program = Qp<2, 1, 1, 1>;
type Point = Solution<2, 1, 1, 1>;

/// A solver that counts what is asked of it and has nothing of its own but what it must.
#[derive(Default)]
struct Counting {
    resets: u32,
    solves: u32,
}

impl QpSolver<2, 1, 1, 1> for Counting {
    fn reset(&mut self) {
        self.resets += 1;
    }

    fn solve(&mut self, _: &Program, point: &mut Point, _: &Deadline) -> QpOutcome {
        self.solves += 1;
        point.x[0][0] = 7.0;
        QpOutcome { status: QpStatus::Stalled, iterations: self.solves }
    }
}

/// One that has everything.
struct Full;

impl QpSolver<2, 1, 1, 1> for Full {
    fn reset(&mut self) {}

    fn solve(&mut self, _: &Program, _: &mut Point, _: &Deadline) -> QpOutcome {
        QpOutcome { status: QpStatus::Solved, iterations: 1 }
    }

    fn solve_again(&mut self, _: &Program, _: &mut Point, _: &Deadline) -> QpOutcome {
        QpOutcome { status: QpStatus::Unbounded, iterations: 2 }
    }

    fn gain(&self, k: usize) -> Option<Matrix1<f64>> {
        Some(Matrix1::new(k as f64))
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.bytes(b"full");
    }
}

fn identity<S: QpSolver<2, 1, 1, 1>>(solver: &S) -> u64 {
    let mut checksum = Checksum::new();
    solver.identify(&mut checksum);
    checksum.value()
}

#[test]
fn a_solver_need_not_have_more_than_one_method() {
    let (mut solver, mut point) = (Counting::default(), Point::ZERO);
    let outcome = solver.solve_again(&Program::ZERO, &mut point, &Deadline::never());
    assert_eq!(outcome, QpOutcome { status: QpStatus::Stalled, iterations: 1 });
    assert_eq!(point.x[0][0], 7.0);
    assert!(solver.gain(0).is_none());
    assert_eq!(identity(&solver), Checksum::new().value());
}

/// Uses a solver by its trait alone.
fn all_of<S: QpSolver<2, 1, 1, 1>>(mut solver: S) -> (QpOutcome, QpOutcome, Option<f64>, u64) {
    let mut point = Point::ZERO;
    solver.reset();
    let first = solver.solve(&Program::ZERO, &mut point, &Deadline::never());
    let again = solver.solve_again(&Program::ZERO, &mut point, &Deadline::never());
    (first, again, solver.gain(3).map(|gain| gain[0]), identity(&solver))
}

#[test]
fn a_borrowed_solver_does_what_the_solver_does() {
    let mut solver = Counting::default();
    all_of(&mut solver);
    assert_eq!((solver.resets, solver.solves), (1, 2));
    let (first, again, gain, identity) = all_of(&mut Full);
    assert_eq!((first.status, again.status), (QpStatus::Solved, QpStatus::Unbounded));
    assert_eq!((first.iterations, again.iterations, gain), (1, 2, Some(3.0)));
    assert_eq!(identity, all_of(Full).3);
    assert_ne!(identity, Checksum::new().value());
}

#[test]
fn codes_never_change_their_meaning() {
    let statuses = [
        QpStatus::Solved,
        QpStatus::ReducedAccuracy,
        QpStatus::IterationLimit,
        QpStatus::TimeLimit,
        QpStatus::Infeasible,
        QpStatus::AlmostInfeasible,
        QpStatus::Unbounded,
        QpStatus::AlmostUnbounded,
        QpStatus::Stalled,
        QpStatus::NumericalFailure,
        QpStatus::Interrupted,
    ];
    for (code, status) in (0u32..).zip(statuses) {
        assert_eq!(status.code(), code);
        assert_eq!(status.is_usable(), code <= 1, "{status:?}");
    }
    assert_eq!(QpOutcome::default().status, QpStatus::NumericalFailure);
}

fn configured(settings: InteriorPointSettings) -> Box<EmbeddedQp<2, 1, 1, 1>> {
    let mut solver = embedded();
    solver.configure(settings.validated().unwrap());
    solver
}

#[test]
fn each_setting_is_part_of_a_solver_s_name() {
    let default = InteriorPointSettings::DEFAULT;
    let all = [
        default,
        InteriorPointSettings { max_iterations: 99, ..default },
        InteriorPointSettings { tolerance: 4e-10, ..default },
        InteriorPointSettings { complementarity: 2e-13, ..default },
        InteriorPointSettings { reduced: 2e-6, ..default },
        InteriorPointSettings { fixed_iterations: Some(0), ..default },
        InteriorPointSettings { fixed_iterations: Some(MAX_SOLVER_ITERATIONS), ..default },
    ];
    let names = all.map(|settings| identity(&*configured(settings)));
    for i in 0..all.len() {
        assert_eq!(configured(all[i]).settings(), all[i]);
        assert!((0..i).all(|j| names[i] != names[j]), "{:?}", all[i]);
    }
    // Records name it so.
    assert_eq!(names[0], 0x676a_67f1_87cc_7053);
    assert_eq!(names[0], identity(&*embedded::<2, 1, 1, 1>()));
    assert_eq!(EmbeddedQp::<2, 1, 1, 1>::default().settings(), default);
    assert_eq!(InteriorPointSettings::default(), default);
    assert_eq!((default.max_iterations, default.fixed_iterations), (100, None));
}

#[test]
fn sizes_are_what_memory_needs() {
    assert_eq!(EmbeddedQp::<3, 2, 1, 1>::BYTES, size_of::<EmbeddedQp<3, 2, 1, 1>>());
    // The last of them are the iterate and the system: nothing is on a heap.
    const { assert!(EmbeddedQp::<6, 2, 1, 1>::BYTES > 2 * EmbeddedQp::<3, 2, 1, 1>::BYTES - 300) };
}

#[test]
fn a_valid_value_is_the_value() {
    let default = InteriorPointSettings::DEFAULT;
    let valid = default.validated().unwrap();
    assert_eq!((valid.into_inner(), valid.reduced), (default, 1e-6));
    assert_eq!(Valid::of_constant(default), valid);
    let error = InteriorPointSettings { max_iterations: 2000, ..default }.validated().unwrap_err();
    assert_eq!(error.to_string(), "max_iterations must be at most MAX_SOLVER_ITERATIONS");
}

/// A correction goes on from a solution where there is one, and solves from nothing where there is none.
#[test]
fn a_correction_without_a_solution_is_a_solve() {
    let qp = random::<12, 4, 2, 1>(&Recipe::HARD);
    let fresh = cold(&mut *embedded(), &qp);
    let correct = |solver: &mut EmbeddedQp<12, 4, 2, 1>| {
        let mut point = Box::new(Solution::ZERO);
        let outcome = solver.solve_again(&qp, &mut point, &Deadline::never());
        (outcome, bits(&point))
    };
    let mut solver = embedded();
    assert_eq!(correct(&mut solver), (fresh.outcome, bits(&fresh.point)));
    // Now there is one, from which fewer steps lead to other bits.
    let (outcome, point) = correct(&mut solver);
    assert_eq!(outcome.status, QpStatus::Solved);
    assert!(outcome.iterations < fresh.outcome.iterations, "{outcome:?}");
    assert_ne!(point, bits(&fresh.point));
    solver.reset();
    assert_eq!(correct(&mut solver), (fresh.outcome, bits(&fresh.point)));
    // None is left by a solve that failed.
    let mut bad = qp.clone();
    bad.stages[1].c[0] = f64::NAN;
    assert!(!cold(&mut *solver, &bad).outcome.status.is_usable());
    assert!(solver.gain(0).is_none());
    assert_eq!(correct(&mut solver), (fresh.outcome, bits(&fresh.point)));
}

/// Prices and constants that are none are refused before the first iteration.
#[test]
fn prices_that_are_none_are_refused() {
    let good = random::<12, 4, 2, 1>(&Recipe::PLAIN);
    let solved = |change: &dyn Fn(&mut Qp<12, 4, 2, 1>)| {
        let mut qp = good.clone();
        change(&mut qp);
        let outcome = cold(&mut *embedded(), &qp).outcome;
        (outcome.status, outcome.iterations == 0)
    };
    let refused = (QpStatus::NumericalFailure, true);
    for price in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        assert_eq!(solved(&|qp| qp.defect_penalty = price), refused, "{price}");
    }
    for price in [-1e-9, f64::NAN, f64::INFINITY] {
        assert_eq!(solved(&|qp| qp.path_penalty = price), refused, "{price}");
    }
    assert_eq!(solved(&|qp| qp.path_penalty = 0.0).0, QpStatus::Solved);
    for constant in [f64::NAN, f64::INFINITY] {
        assert_eq!(solved(&|qp| qp.constant = constant), refused, "{constant}");
    }
    let empty = (QpStatus::Infeasible, true);
    for (lower, upper) in [(1.0, 0.0), (f64::INFINITY, f64::INFINITY)] {
        let bounds = (lower, upper);
        let of_x = |qp: &mut Qp<12, 4, 2, 1>| {
            (qp.stages[11].lower_x[3], qp.stages[11].upper_x[3]) = bounds;
        };
        let of_u = |qp: &mut Qp<12, 4, 2, 1>| {
            (qp.stages[10].lower_u[1], qp.stages[10].upper_u[1]) = bounds;
        };
        assert_eq!(solved(&of_x), empty, "{bounds:?}");
        assert_eq!(solved(&of_u), empty, "{bounds:?}");
    }
    let none = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    let of_x = |qp: &mut Qp<12, 4, 2, 1>| (qp.stages[5].lower_x[0], qp.stages[5].upper_x[0]) = none;
    assert_eq!(solved(&of_x), empty);
}
