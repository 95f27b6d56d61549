//! Residuals against the Lagrangian that they derive.

extern crate std;

use super::super::*;
use super::{Numbers, program};
use std::boxed::Box;

const N: usize = 4;
type Program = Qp<N, 3, 2, 2>;
type Point = Solution<N, 3, 2, 2>;

/// The Lagrangian without bounds: the smooth cost, and multipliers times what they belong to.
fn lagrangian(qp: &Program, point: &Point) -> f64 {
    let mut sum = qp.cost(point);
    for k in 0..N {
        sum -= point.defect_multiplier[k].dot(&qp.slack(point, k));
        let stage = &qp.stages[k];
        let rows = stage.path_jacobian * point.x[k] + stage.path_offset;
        sum += point.path_multiplier[k].dot(&rows);
    }
    sum
}

/// Central difference: exact of a quadratic.
fn derivative(qp: &Program, point: &Point, of: impl Fn(&mut Point) -> &mut f64) -> f64 {
    let [plus, minus] = [1.0, -1.0].map(|by| {
        let mut moved = point.clone();
        *of(&mut moved) += by;
        lagrangian(qp, &moved)
    });
    0.5 * (plus - minus)
}

#[test]
fn the_gradient_is_the_lagrangian_s() {
    let mut numbers = Numbers(5);
    let qp: Program = program(&mut numbers, 4.0);
    let mut solver = Box::new(EmbeddedQp::<N, 3, 2, 2>::new());
    solver.start(&qp).unwrap();
    let mut point = Box::new(Point::ZERO);
    for k in 0..N {
        let vars = &mut solver.variables[k];
        vars.x.value = numbers.matrix::<3, 1>(1.0).data.0[0];
        vars.path.value = numbers.matrix::<2, 1>(1.0).data.0[0];
        if k + 1 < N {
            vars.u.value = numbers.matrix::<2, 1>(1.0).data.0[0];
            vars.dynamics.value = numbers.matrix::<3, 1>(1.0).data.0[0];
        }
    }
    solver.write(&mut point);
    solver.differentiate(&qp);
    for (k, gradient) in solver.gradient.iter().enumerate() {
        let same = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{k}");
        for i in 0..3 {
            same(gradient.x[i], derivative(&qp, &point, |p| &mut p.x[k][i]));
            let of_dynamics = derivative(&qp, &point, |p| &mut p.defect_multiplier[k][i]);
            same(gradient.dynamics[i], of_dynamics);
        }
        for i in 0..2 {
            same(gradient.u[i], derivative(&qp, &point, |p| &mut p.u[k][i]));
            same(gradient.path[i], derivative(&qp, &point, |p| &mut p.path_multiplier[k][i]));
        }
    }
}

#[test]
fn tolerances_scale_and_include_their_limit() {
    let at = Optimality { residual: 2.0, mu: 0.0, complementarity: 6.0, scale: 2.0 };
    assert!(at.is_within(1.0, 3.0));
    assert!(!at.is_within(0.99, 3.0) && !at.is_within(1.0, 2.99));
    assert!(!Optimality { residual: f64::NAN, ..at }.is_within(1.0, 3.0));
}

#[test]
fn residuals_are_finite_where_each_is() {
    let at = Optimality { residual: 1.0, mu: 1.0, complementarity: 1.0, scale: 1.0 };
    assert!(at.is_finite());
    for value in [f64::NAN, f64::INFINITY] {
        assert!(!Optimality { residual: value, ..at }.is_finite());
        assert!(!Optimality { complementarity: value, ..at }.is_finite());
        assert!(!Optimality { scale: value, ..at }.is_finite());
    }
}

/// Accuracy asked for: the settings' or the program's, whichever is more.
#[test]
fn errors_are_counted_in_what_is_asked_for() {
    let solver = EmbeddedQp::<N, 3, 2, 2>::new();
    let settings = solver.settings();
    let asked = |complementarity: f64| {
        let qp = Program { complementarity, ..Program::ZERO };
        (solver.tolerance(&qp), solver.complementarity(&qp))
    };
    assert_eq!(asked(0.0), (settings.tolerance, settings.complementarity));
    assert_eq!(asked(1e-9), (settings.tolerance, 1e-9));
    let (tolerance, complementarity) = asked(1e-6);
    assert!((tolerance - 1e-8).abs() < 1e-20 && complementarity == 1e-6);
    for nothing in [f64::NAN, -1.0] {
        assert_eq!(asked(nothing), asked(0.0));
    }
    // No more than 1e-4 counts as good enough.
    assert_eq!(asked(1.0), asked(1e-4));
    assert_eq!(asked(1.0).1, 1e-4);
}
