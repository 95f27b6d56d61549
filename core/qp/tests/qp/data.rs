//! A program's and a point's numbers: what each of their functions says of them.

use super::common::programs::{Recipe, cold, embedded, random};
use remora_qp::nalgebra::{Matrix2, RowVector2, SVector, Vector1, Vector2};
use remora_qp::{Qp, QpStage, Solution};

type Program = Qp<3, 2, 1, 1>;
type Point = Solution<3, 2, 1, 1>;

/// Three stages with numbers small enough for a head.
fn example() -> Program {
    let mut qp = Program { constant: 100.0, ..Program::ZERO };
    for stage in &mut qp.stages {
        stage.hessian_xx = Matrix2::new(2.0, 1.0, 1.0, 4.0);
        stage.hessian_ux = RowVector2::new(3.0, 5.0);
        stage.hessian_uu = Vector1::new(6.0);
        stage.gradient_x = Vector2::new(7.0, 8.0);
        stage.gradient_u = Vector1::new(9.0);
        stage.a = Matrix2::new(1.0, 2.0, 0.0, 1.0);
        stage.b = Vector2::new(0.5, 3.0);
        stage.c = Vector2::new(10.0, 20.0);
        stage.path_jacobian = RowVector2::new(1.0, -1.0);
        stage.path_offset = Vector1::new(0.25);
    }
    qp
}

/// A point at which only stage `k` has states and controls.
fn at(k: usize, x: [f64; 2], u: f64) -> Point {
    let mut point = Point::ZERO;
    (point.x[k], point.u[k]) = (x.into(), [u].into());
    point
}

#[test]
fn nothing_has_been_said_of_a_zero_program() {
    let qp = Program::ZERO;
    assert_eq!((qp.nodes(), qp.unused, qp.constant), (3, 0, 0.0));
    assert_eq!((qp.defect_penalty, qp.path_penalty, qp.complementarity), (0.0, 0.0, 0.0));
    assert_eq!(qp.stages[2].path_offset, Vector1::new(0.0));
    // A stage of its own has rows that are never active.
    assert_eq!(QpStage::<2, 1, 3>::ZERO.path_offset, SVector::<f64, 3>::repeat(-1.0));
}

#[test]
fn stages_left_out_are_no_part() {
    let mut qp = example();
    for (unused, nodes) in [(0, 3), (1, 2), (2, 1), (3, 0), (4, 0), (usize::MAX, 0)] {
        qp.unused = unused;
        assert_eq!((qp.nodes(), qp.used().len(), qp.used_mut().len()), (nodes, nodes, nodes));
    }
    qp.unused = 1;
    qp.used_mut()[1].c[0] = -1.0;
    assert_eq!((qp.stages[1].c[0], qp.stages[2].c[0]), (-1.0, 10.0));
    // Neither cost nor slack nor rows of what is left out count.
    let far = at(2, [1e3, -1e3], 1e3);
    let origin = Point::ZERO;
    assert_eq!(qp.cost(&far), qp.cost(&origin));
    assert_eq!(qp.slope(&far), qp.slope(&origin));
    assert_eq!(qp.defect_norm(&far), qp.defect_norm(&origin));
    assert_eq!(qp.path_violation(&far), qp.path_violation(&origin));
    assert_eq!(qp.slack(&far, 1), Vector2::zeros());
}

#[test]
fn the_cost_of_a_point() {
    let qp = example();
    assert_eq!(qp.cost(&Point::ZERO), 100.0);
    // x^T Q x / 2 = (2 - 2 * 2 + 4 * 4) / 2 = 7, q^T x = 7 - 16 = -9.
    assert_eq!(qp.cost(&at(1, [1.0, -2.0], 0.0)), 98.0);
    // u R u / 2 = 12, r u = 18.
    assert_eq!(qp.cost(&at(1, [0.0, 0.0], 2.0)), 130.0);
    // The cross term u S x = 2 (3 - 10) = -14 is counted once.
    assert_eq!(qp.cost(&at(1, [1.0, -2.0], 2.0)), 98.0 + 30.0 - 14.0);
    // The last stage has a state and no control.
    assert_eq!(qp.cost(&at(2, [1.0, -2.0], 2.0)), 98.0);
}

#[test]
fn the_slope_is_the_derivative_of_the_cost() {
    let qp = random::<6, 3, 2, 1>(&Recipe::PLAIN);
    let answer = cold(&mut *embedded(), &qp);
    let scaled = |factor: f64| {
        let mut point = answer.point.clone();
        point.x.iter_mut().for_each(|x| *x *= factor);
        point.u.iter_mut().for_each(|u| *u *= factor);
        point
    };
    // Central differences of a quadratic are exact.
    let difference = 0.5 * (qp.cost(&scaled(1.0)) - qp.cost(&scaled(-1.0)));
    assert!((qp.slope(&answer.point) - difference).abs() < 1e-12);
    assert!(difference.abs() > 0.1);
    assert_eq!(example().slope(&at(1, [1.0, -2.0], 2.0)), 7.0 - 16.0 + 18.0);
}

#[test]
fn slack_is_what_the_dynamics_lack() {
    let qp = example();
    let mut point = at(0, [1.0, 2.0], 4.0);
    // A x + B u + c = (1 + 4 + 2 + 10, 2 + 12 + 20).
    point.x[1] = Vector2::new(17.0, 34.0);
    assert_eq!(qp.slack(&point, 0), Vector2::zeros());
    point.x[1] = Vector2::new(17.5, 33.0);
    assert_eq!(qp.slack(&point, 0), Vector2::new(0.5, -1.0));
    // (17.5 + 66 + 10, 33 + 20) is expected of the last state, which is zero.
    assert_eq!(qp.slack(&point, 1), Vector2::new(-93.5, -53.0));
    assert_eq!(qp.defect_norm(&point), 1.5 + 146.5);
    // Nothing follows the last stage.
    assert_eq!(qp.slack(&point, 2), Vector2::zeros());
    assert_eq!(qp.slack(&point, 3), Vector2::zeros());
    assert_eq!(qp.slack(&point, usize::MAX - 1), Vector2::zeros());
}

#[test]
fn only_rows_above_zero_are_violated() {
    let qp = example();
    // Every stage's row is x_1 - x_2 + 1/4.
    assert_eq!(qp.path_violation(&Point::ZERO), 0.75);
    assert_eq!(qp.path_violation(&at(0, [0.0, 5.0], 0.0)), 0.5);
    assert_eq!(qp.path_violation(&at(2, [2.0, 0.5], 0.0)), 0.5 + 1.75);
}

/// A field: its number at a stage.
type Field = (&'static str, fn(&mut Point, usize) -> &mut f64);

const FIELDS: [Field; 6] = [
    ("x", |point, k| &mut point.x[k][1]),
    ("u", |point, k| &mut point.u[k][0]),
    ("defect_multiplier", |point, k| &mut point.defect_multiplier[k][1]),
    ("bound_multiplier_x", |point, k| &mut point.bound_multiplier_x[k][0]),
    ("bound_multiplier_u", |point, k| &mut point.bound_multiplier_u[k][0]),
    ("path_multiplier", |point, k| &mut point.path_multiplier[k][0]),
];

/// A point without a zero.
fn full() -> Point {
    let mut point = Point::ZERO;
    for k in 0..3 {
        point.x[k].fill(1.0);
        point.u[k].fill(2.0);
        point.defect_multiplier[k].fill(3.0);
        point.bound_multiplier_x[k].fill(4.0);
        point.bound_multiplier_u[k].fill(5.0);
        point.path_multiplier[k].fill(6.0);
    }
    point
}

#[test]
fn a_point_is_finite_where_each_of_its_numbers_is() {
    assert!(Point::ZERO.is_finite() && full().is_finite());
    for (name, field) in FIELDS {
        for (k, value) in [(0, f64::NAN), (1, f64::INFINITY), (2, f64::NEG_INFINITY)] {
            let mut point = full();
            *field(&mut point, k) = value;
            assert!(!point.is_finite(), "{value} in {name} of {k}");
        }
    }
}

#[test]
fn what_is_cleared_is_zero_and_the_rest_is_kept() {
    for first in 0..5 {
        let mut point = full();
        point.clear_from(first);
        for (name, field) in FIELDS {
            for k in 0..3 {
                let is_cleared = *field(&mut point, k) == 0.0;
                assert_eq!(is_cleared, k >= first, "{name} of {k} from {first}");
            }
        }
    }
    let mut point = full();
    point.clear_multipliers();
    for (i, (name, field)) in FIELDS.into_iter().enumerate() {
        for k in 0..3 {
            assert_eq!(*field(&mut point, k) == 0.0, i >= 2, "{name} of {k}");
        }
    }
}

#[test]
fn multipliers_of_dynamics_and_rows_have_a_largest() {
    let point = full();
    assert!(point.multipliers_are_within(6.0) && !point.multipliers_are_within(5.9));
    for (name, field) in FIELDS {
        let mut point = full();
        *field(&mut point, 2) = -6.5;
        let counts = ["defect_multiplier", "path_multiplier"].contains(&name);
        assert_eq!(point.multipliers_are_within(6.0), !counts, "{name}");
    }
}
