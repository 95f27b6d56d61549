//! Clarabel's answers against the optimality conditions.

use super::common::programs::cases;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use remora_core::advanced::qp::{Qp, QpSolver, QpStatus, Solution};
use remora_core::advanced::time::{Deadline, NoClock};
use remora_host::backend::ClarabelQp;
use remora_host::kkt::Kkt;

const N: usize = 6;
const NX: usize = 3;
const NU: usize = 2;
type Program = Qp<N, NX, NU, 1>;
type Point = Solution<N, NX, NU, 1>;

/// A program from a stream of numbers in [-1, 1]: feasible, convex, the first state pinned.
fn program(numbers: &[f64], soft: bool) -> Program {
    let mut stream = numbers.iter().copied().cycle();
    let mut next = move || stream.next().unwrap();
    let mut qp = Program::ZERO;
    qp.defect_penalty = if soft { 5.0 } else { f64::INFINITY };
    qp.path_penalty = 4.0;
    for (k, stage) in qp.stages.iter_mut().enumerate() {
        let root = SMatrix::<f64, 5, 5>::from_fn(|_, _| next());
        let hessian = root * root.transpose() + SMatrix::identity() * 0.1;
        stage.hessian_xx = hessian.fixed_view::<NX, NX>(0, 0).into_owned();
        stage.hessian_ux = hessian.fixed_view::<NU, NX>(NX, 0).into_owned();
        stage.hessian_uu = hessian.fixed_view::<NU, NU>(NX, NX).into_owned();
        stage.gradient_x = SVector::from_fn(|_, _| next());
        stage.gradient_u = SVector::from_fn(|_, _| next());
        stage.a = SMatrix::from_fn(|_, _| next()) * 0.6;
        stage.b = SMatrix::from_fn(|_, _| next());
        stage.c = SVector::from_fn(|_, _| next()) * 0.3;
        stage.lower_x = SVector::repeat(if k == 0 { 0.2 } else { -3.0 });
        stage.upper_x = SVector::repeat(if k == 0 { 0.2 } else { 3.0 });
        stage.lower_u = SVector::repeat(-0.7);
        stage.upper_u = SVector::repeat(0.7);
        stage.path_jacobian = SMatrix::from_fn(|_, _| next());
        stage.path_offset[0] = 0.2 * next();
    }
    qp
}

fn numbers() -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-1.0..1.0f64, 293)
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn clarabel_satisfies_the_optimality_conditions(numbers in numbers(), soft: bool) {
        let qp = program(&numbers, soft);
        let mut point = Point::ZERO;
        let outcome = ClarabelQp::default().solve(&qp, &mut point, &Deadline::never());
        if outcome.status == QpStatus::Solved {
            prop_assert!(Kkt::of(&qp, &point).worst() < 1e-7, "{:?}", Kkt::of(&qp, &point));
        } else {
            // Hard dynamics within boxes need not have a feasible point; slack always does.
            prop_assert!(!soft && outcome.status == QpStatus::Infeasible, "{:?}", outcome.status);
        }
    }

    #[test]
    fn an_update_in_place_equals_a_fresh_solver(first in numbers(), second in numbers()) {
        let (mut used, mut fresh) = (ClarabelQp::default(), ClarabelQp::default());
        let (mut a, mut b) = (Point::ZERO, Point::ZERO);
        used.solve(&program(&first, true), &mut a, &Deadline::never());
        used.solve(&program(&second, true), &mut a, &Deadline::never());
        fresh.solve(&program(&second, true), &mut b, &Deadline::never());
        prop_assert_eq!(a.x, b.x);
        prop_assert_eq!(a.u, b.u);
        prop_assert_eq!(a.defect_multiplier, b.defect_multiplier);
    }
}

#[test]
fn statuses_tell_why_there_is_no_solution() {
    let numbers: Vec<f64> = (0..293).map(|i| ((i * 37 % 101) as f64) / 50.5 - 1.0).collect();
    let solve = |change: fn(&mut Program)| {
        let mut qp = program(&numbers, false);
        change(&mut qp);
        let mut point = Point::ZERO;
        ClarabelQp::default().solve(&qp, &mut point, &Deadline::never()).status
    };
    assert_eq!(solve(|_| ()), QpStatus::Solved);
    // The next state cannot be reached whatever the control.
    assert_eq!(solve(|qp| qp.stages[0].c.fill(100.0)), QpStatus::Infeasible);
    assert_eq!(
        solve(|qp| {
            for stage in &mut qp.stages {
                stage.hessian_uu.fill(0.0);
                stage.hessian_ux.fill(0.0);
                stage.hessian_xx.fill(0.0);
                stage.b.fill(0.0);
                stage.lower_u.fill(f64::NEG_INFINITY);
            }
        }),
        QpStatus::Unbounded
    );
    assert!(!solve(|qp| qp.stages[2].gradient_u[0] = f64::NAN).is_usable());
    assert!(!solve(|qp| qp.stages[2].a[(0, 0)] = f64::NAN).is_usable());
}

#[test]
fn a_deadline_that_has_passed_ends_it_at_once() {
    let numbers = [0.5, -0.25, 0.75];
    let passed = Deadline::after(&NoClock, 0.0);
    let mut point = Point::ZERO;
    let outcome = ClarabelQp::default().solve(&program(&numbers, true), &mut point, &passed);
    assert_eq!(outcome.status, QpStatus::TimeLimit);
}
