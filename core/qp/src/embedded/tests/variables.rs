//! Variables of a stage: where they start, what their vectors hold.

use super::super::bounded::Centering;
use super::super::variables::Free;
use super::super::*;
use nalgebra::{SMatrix, SVector};

type Vector = StageVector<2, 2, 2>;
type Variables = StageVariables<2, 1, 1>;
type Program = Qp<3, 2, 1, 1>;

const VECTOR: Vector =
    Vector { x: [1.0, 2.0], u: [3.0, 4.0], dynamics: [5.0, 6.0], path: [7.0, 8.0] };

/// The entry of a vector, in order.
fn entry(vector: &mut Vector, i: usize) -> &mut f64 {
    let StageVector { x, u, dynamics, path } = vector;
    [x, u, dynamics, path].into_iter().flatten().nth(i).unwrap()
}

#[test]
fn vectors_have_a_sum_and_a_largest_entry() {
    assert_eq!(VECTOR.sum(), 36.0);
    assert_eq!((Vector::ZERO.sum(), Vector::ZERO.largest()), (0.0, 0.0));
    for i in 0..8 {
        let mut vector = VECTOR;
        *entry(&mut vector, i) = 9.0;
        assert_eq!(vector.largest(), 9.0, "{i}");
    }
}

#[test]
fn barriers_push_multipliers_the_other_way() {
    let mut vector = VECTOR;
    vector.add_barrier_gradient(&Vector {
        x: [0.5; 2],
        u: [0.25; 2],
        dynamics: [2.0; 2],
        path: [3.0; 2],
    });
    assert_eq!((vector.x, vector.u), ([1.5, 2.5], [3.25, 4.25]));
    assert_eq!((vector.dynamics, vector.path), ([3.0, 4.0], [4.0, 5.0]));
}

#[test]
fn the_worst_of_each_entry_is_kept_and_what_is_not_finite_is_seen() {
    for i in 0..8 {
        let mut change = Vector::ZERO;
        *entry(&mut change, i) = -100.0;
        let mut worst = VECTOR;
        worst.raise_to(&change);
        for j in 0..8 {
            let expected = if i == j { 100.0 } else { *entry(&mut { VECTOR }, j) };
            assert_eq!(*entry(&mut worst, j), expected);
        }
        let mut spoilt = Vector::ZERO;
        spoilt.spoil_by(&change);
        // A sum of magnitudes stays finite and is never negative.
        assert_eq!(spoilt.sum(), 100.0 * f64::EPSILON);
        spoilt.spoil_by(&change);
        assert_eq!(spoilt.sum(), 200.0 * f64::EPSILON);
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            *entry(&mut change, i) = value;
            let mut spoilt = Vector::ZERO;
            spoilt.spoil_by(&change);
            assert!(!spoilt.sum().is_finite(), "{value} at {i}");
        }
    }
}

/// A program whose every bound is two-sided but for the last state's second, which is fixed.
fn program() -> Program {
    let mut qp = Program { defect_penalty: 5.0, path_penalty: 2.0, ..Program::ZERO };
    for stage in &mut qp.stages {
        stage.hessian_uu = SMatrix::repeat(1.0);
        (stage.lower_x, stage.upper_x) = (SVector::repeat(-1.0), SVector::repeat(3.0));
        (stage.lower_u, stage.upper_u) = (SVector::repeat(-2.0), SVector::repeat(2.0));
    }
    (qp.stages[2].lower_x[1], qp.stages[2].upper_x[1]) = (0.5, 0.5);
    qp
}

fn started(k: usize, qp: &Program, point: InitialPoint) -> Result<Variables, Unusable> {
    let mut vars = Variables::ZERO;
    vars.initialise(k, qp, point).map(|()| vars)
}

const ELASTIC: InitialPoint = InitialPoint::ELASTIC;
const RIGID: InitialPoint = InitialPoint { elastic: false, ..ELASTIC };

#[test]
fn each_bound_is_a_pair() {
    let qp = program();
    // Two states, a control, two multipliers of dynamics and one of a row, two bounds each.
    assert_eq!(started(0, &qp, ELASTIC).unwrap().pairs(), 12);
    assert_eq!(started(0, &qp, RIGID).unwrap().pairs(), 8);
    // The last stage has a state that is free, and a row.
    let last = started(2, &qp, ELASTIC).unwrap();
    assert_eq!(last.pairs(), 4);
    assert_eq!(last.x.value, [0.0, 0.5]);
    assert_eq!(last.free_x.factors(), [1.0, 0.0]);
    assert!(last.free_x.is_fixed(1) && !last.free_x.is_fixed(0) && !last.free_x.is_fixed(2));
    assert_eq!((last.free_u, last.u.value), (Free::NONE, [0.0]));
    let mut hard = program();
    hard.defect_penalty = f64::INFINITY;
    assert_eq!(started(0, &hard, ELASTIC).unwrap().pairs(), 8);
}

/// What an earlier program left in the last stage's controls is gone.
#[test]
fn the_last_stage_has_neither_controls_nor_dynamics() {
    let mut vars = Variables::filled(7.0);
    vars.initialise(2, &program(), ELASTIC).unwrap();
    assert_eq!((vars.u.value, vars.dynamics.value), ([0.0], [0.0; 2]));
    assert_eq!((vars.u.pairs(), vars.dynamics.pairs(), vars.free_u), (0, 0, Free::NONE));
    let mut vars = Variables::filled(7.0);
    vars.initialise(1, &program(), ELASTIC).unwrap();
    assert_eq!((vars.u.pairs(), vars.dynamics.pairs(), vars.free_u), (2, 4, Free::ALL));
}

#[test]
fn a_stage_that_is_none_is_refused() {
    let mut qp = program();
    assert_eq!(started(3, &qp, ELASTIC).unwrap_err(), Unusable::InvalidProblem);
    qp.unused = 1;
    assert_eq!(started(2, &qp, ELASTIC).unwrap_err(), Unusable::InvalidProblem);
    assert!(started(1, &qp, ELASTIC).is_ok());
    // Now it is the last, without controls.
    assert_eq!(started(1, &qp, ELASTIC).unwrap().free_u, Free::NONE);
}

#[test]
fn bounds_that_are_none_are_named() {
    let infinite = f64::INFINITY;
    let of = |lower: f64, upper: f64| {
        let [mut x, mut u] = [program(), program()];
        (x.stages[1].lower_x[1], x.stages[1].upper_x[1]) = (lower, upper);
        (u.stages[1].lower_u[0], u.stages[1].upper_u[0]) = (lower, upper);
        let (x, u) = (started(1, &x, ELASTIC), started(1, &u, ELASTIC));
        let is_fixed = x.as_ref().map(|vars| vars.free_x.is_fixed(1)).map_err(|e| *e);
        assert_eq!(is_fixed, u.map(|vars| vars.free_u.is_fixed(0)));
        is_fixed
    };
    for (lower, upper) in [(f64::NAN, 1.0), (0.0, f64::NAN), (f64::NAN, f64::NAN)] {
        assert_eq!(of(lower, upper), Err(Unusable::InvalidProblem));
    }
    for (lower, upper) in [(1.0, 0.0), (infinite, infinite), (-infinite, -infinite), (1e-300, 0.0)]
    {
        assert_eq!(of(lower, upper), Err(Unusable::EmptyBox), "{lower} {upper}");
    }
    assert_eq!(of(-infinite, infinite), Ok(false));
    assert_eq!(of(0.0, 1e-10), Ok(false));
    assert_eq!(of(0.0, 1e-11), Ok(true));
    assert_eq!(of(4.0, 4.0), Ok(true));
}

/// A variable that is fixed stands in the middle of its bounds.
#[test]
fn a_fixed_variable_has_a_value() {
    let mut qp = program();
    (qp.stages[1].lower_x[0], qp.stages[1].upper_x[0]) = (4.0, 4.0);
    let width = 1.0 / (1u64 << 40) as f64;
    (qp.stages[1].lower_u[0], qp.stages[1].upper_u[0]) = (-width, 3.0 * width);
    let vars = started(1, &qp, ELASTIC).unwrap();
    assert_eq!((vars.x.value[0], vars.u.value[0]), (4.0, width));
}

#[test]
fn rows_without_a_price_have_no_multiplier() {
    let mut qp = program();
    qp.stages[1].path_offset[0] = 4.0;
    for (penalty, is_free) in [(0.0, false), (1e-11, false), (1e-10, true), (2.0, true)] {
        qp.path_penalty = penalty;
        let vars = started(1, &qp, ELASTIC).unwrap();
        assert_eq!(vars.free_path.is_fixed(0), !is_free, "{penalty}");
        assert_eq!(vars.path.pairs(), if is_free { 2 } else { 0 });
        assert_eq!(vars.path_scaling()[0] > 0.0, is_free);
        assert!((0.0..=penalty).contains(&vars.path.value[0]));
    }
    // Multipliers start near zero, the nearer the more their row holds.
    qp.path_penalty = 2.0;
    let mut near = |offset: f64| {
        qp.stages[1].path_offset[0] = offset;
        started(1, &qp, ELASTIC).unwrap().path.value[0]
    };
    let violated = near(4.0);
    assert!(violated < 0.2 && near(-4.0) < violated);
    let vars = started(1, &qp, ELASTIC).unwrap();
    // The slack of a row that holds is the multiplier of the bound at zero.
    assert_eq!(vars.path.multipliers()[0].signum(), -1.0);
    assert!((vars.path_scaling()[0] - 1.0 / vars.path.scaling()[0]).abs() < 1e-15);
}

/// The first complementarity is a hundredth of the cost's largest gradient, within limits.
#[test]
fn a_cold_start_is_in_proportion_to_the_cost() {
    let cold = |change: &dyn Fn(&mut Program)| {
        let mut qp = program();
        change(&mut qp);
        let InitialPoint { mu, elastic } = InitialPoint::cold(&qp);
        assert!(!elastic);
        mu
    };
    assert_eq!(cold(&|_| ()), 1e-6);
    assert_eq!(cold(&|qp| qp.complementarity = 1e-5), 1e-5);
    assert_eq!(cold(&|qp| qp.stages[0].gradient_x[1] = -4.0), 0.04);
    assert_eq!(cold(&|qp| qp.stages[2].gradient_x[0] = 4.0), 0.04);
    assert_eq!(cold(&|qp| qp.stages[1].gradient_u[0] = -4.0), 0.04);
    assert_eq!(cold(&|qp| qp.stages[1].gradient_u[0] = 1e9), 0.1);
    // The last stage has no control.
    assert_eq!(cold(&|qp| qp.stages[2].gradient_u[0] = 4.0), 1e-6);
    let fewer = |qp: &mut Program| {
        qp.unused = 1;
        qp.stages[2].gradient_x[0] = 4.0;
        qp.stages[1].gradient_u[0] = 4.0;
    };
    assert_eq!(cold(&fewer), 1e-6);
}

/// Gradients of fixed variables count for nothing, multipliers of bounds balance the others.
#[test]
fn residuals_are_gradients_with_their_bounds() {
    let vars = started(2, &program(), ELASTIC).unwrap();
    let gradient = StageVector { x: [1.0, 1e9], u: [0.0], dynamics: [0.5, -0.5], path: [2.0] };
    let found = vars.residual(&gradient);
    assert_eq!(found.x, [1.0 + vars.x.multipliers()[0], 0.0]);
    assert_eq!(found.u, [0.0]);
    assert_eq!(found.dynamics, gradient.dynamics);
    assert_eq!(found.path, [2.0 - vars.path.multipliers()[0]]);
    assert!(vars.x.multipliers()[0] != 0.0 && vars.path.multipliers()[0] != 0.0);
    let mut qp = program();
    (qp.stages[1].lower_u[0], qp.stages[1].upper_u[0]) = (1.0, 1.0);
    qp.path_penalty = 0.0;
    let vars = started(1, &qp, ELASTIC).unwrap();
    let found = vars.residual(&StageVector { u: [1e9], path: [1e9], ..StageVector::ZERO });
    assert_eq!((found.u, found.path), ([0.0], [0.0]));
    let point = vars.point();
    assert_eq!((point.x, point.u), (vars.x.value, [1.0]));
    assert_eq!((point.dynamics, point.path), ([0.0; 2], [0.0]));
}

/// Dynamics without slack have no barrier: no gradient, no limit, no product, steps of any length.
#[test]
fn dynamics_without_slack_have_no_barrier() {
    let step = StageVector { x: [0.0; 2], u: [0.0], dynamics: [100.0, -50.0], path: [0.0] };
    let zero = StageVector::ZERO;
    let centering = Centering { sigma_mu: 0.1, corrector: 0.0 };
    for (point, is_soft) in [(ELASTIC, true), (RIGID, false)] {
        let mut vars = started(1, &program(), point).unwrap();
        // Off the middle, where both barriers are equal.
        vars.dynamics.value = [0.0; 2];
        let mut worst = StageVector::ZERO;
        vars.limit_step(&step, centering, &zero, &mut worst);
        assert_eq!(worst.dynamics[0] > 1.0, is_soft);
        let (mut sum, mut most) = (StageVector::ZERO, StageVector::ZERO);
        vars.add_complementarity(&mut sum, &mut most);
        assert_eq!(sum.dynamics[0] > 0.0, is_soft);
        assert!(sum.x[0] > 0.0 && sum.x[1] > 0.0 && sum.u[0] > 0.0 && sum.path[0] > 0.0);
        assert!(most.x[0] > 0.0 && most.u[0] > 0.0 && most.path[0] > 0.0);
        let mut after = StageVector::ZERO;
        vars.add_complementarity_after(&zero, Centering::AFFINE, &zero, 0.0, &mut after);
        assert_eq!((after.x, after.u, after.path), (sum.x, sum.u, sum.path));
        assert_eq!(after.dynamics, sum.dynamics);
        vars.advance(&step, centering, &zero, 0.01);
        assert_eq!(vars.dynamics.value, [1.0, -0.5]);
        let gradient = vars.barrier_gradient(centering, &zero).dynamics;
        assert_eq!(gradient[0] != 0.0, is_soft);
    }
}

#[test]
fn recentring_raises_every_product() {
    let mut vars = started(1, &program(), InitialPoint { mu: 1e-9, elastic: true }).unwrap();
    vars.recentre(0.01);
    let (mut sum, mut most) = (StageVector::ZERO, StageVector::ZERO);
    vars.add_complementarity(&mut sum, &mut most);
    let StageVector { x, u, dynamics, path } = sum;
    let all = [x[0], x[1], u[0], dynamics[0], dynamics[1], path[0]];
    assert!(all.iter().all(|v| *v >= 0.0199), "{all:?}");
}
