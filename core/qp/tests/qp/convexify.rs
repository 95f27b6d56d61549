//! Convexification against the program that it must not change.

use super::common::programs::cases;
use proptest::prelude::*;
use remora_qp::nalgebra::{SMatrix, SVector};
use remora_qp::{Checksum, Convexification, Qp, QpStage, Solution};

const N: usize = 6;
const NX: usize = 3;
const NU: usize = 2;
type Program = Qp<N, NX, NU, 1>;
type Point = Solution<N, NX, NU, 1>;

/// Curvature of either sign beside a convex part of one on controls, with dynamics, from numbers in [-1, 1].
fn program(numbers: &[f64], size: f64) -> Program {
    let mut stream = numbers.iter().copied().cycle();
    let mut next = move || stream.next().unwrap();
    let mut qp = Program { constant: 2.5, defect_penalty: 5.0, path_penalty: 4.0, ..Program::ZERO };
    for stage in &mut qp.stages {
        let m = SMatrix::<f64, NX, NX>::from_fn(|_, _| next());
        stage.hessian_xx = (m + m.transpose()) * size;
        stage.hessian_ux = SMatrix::from_fn(|_, _| size * next());
        stage.gradient_x = SVector::from_fn(|_, _| next());
        stage.gradient_u = SVector::from_fn(|_, _| next());
        stage.a = SMatrix::from_fn(|_, _| 0.6 * next());
        stage.b = SMatrix::from_fn(|_, _| next());
        stage.c = SVector::from_fn(|_, _| 0.3 * next());
    }
    qp
}

/// A point on the dynamics from controls. A step starts at zero: curvature by the first state is left out.
fn rolled_out(qp: &Program, numbers: &[f64]) -> Point {
    let mut point = Point::ZERO;
    for k in 0..N - 1 {
        point.u[k] = SVector::from_fn(|i, _| numbers[2 * k + i]);
        let stage = &qp.stages[k];
        point.x[k + 1] = stage.a * point.x[k] + stage.b * point.u[k] + stage.c;
    }
    point
}

/// Least eigenvalue of a stage's whole Hessian, over its size.
fn least_curvature(stage: &QpStage<NX, NU, 1>) -> f64 {
    let mut block = SMatrix::<f64, 5, 5>::zeros();
    block.fixed_view_mut::<NX, NX>(0, 0).copy_from(&stage.hessian_xx);
    block.fixed_view_mut::<NU, NX>(NX, 0).copy_from(&stage.hessian_ux);
    block.fixed_view_mut::<NX, NU>(0, NX).copy_from(&stage.hessian_ux.transpose());
    block.fixed_view_mut::<NU, NU>(NX, NX).copy_from(&stage.hessian_uu);
    block.symmetric_eigenvalues().min() / (1.0 + block.amax())
}

fn numbers() -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-1.0..1.0f64, 293)
}

proptest! {
    #![proptest_config(cases(40))]

    /// Curvature of any sign, handed back until every block is convex: where none had to be
    /// dropped, the objective is the same on every step along the dynamics.
    #[test]
    fn convexification_keeps_the_objective_along_the_dynamics(
        numbers in numbers(),
        size in 0.0..0.4f64,
    ) {
        let before = program(&numbers, size);
        let mut qp = before.clone();
        let convex = SVector::<f64, NU>::repeat(1.0);
        let dropped = qp.convexify(&convex, |_, _| false);
        let point = rolled_out(&before, &numbers[100..]);
        let effort: f64 = point.u.iter().map(|u| 0.5 * u.norm_squared()).sum();
        let (old, new) = (before.cost(&point) + effort, qp.cost(&point));
        if dropped == 0 {
            prop_assert!((old - new).abs() < 1e-6 * (1.0 + old.abs()), "{old} {new}");
        } else {
            // Only negative curvature is ever dropped.
            prop_assert!(new > old - 1e-6 * (1.0 + old.abs()), "{old} {new}");
        }
        for stage in &qp.stages[..N - 1] {
            prop_assert!(least_curvature(stage) > -1e-9, "{}", least_curvature(stage));
        }
    }
}

/// Fixed numbers in [-1, 1].
fn fixed_numbers(seed: usize) -> Vec<f64> {
    (0..293).map(|i| (((i + 7 * seed) * 37 % 101) as f64) / 50.5 - 1.0).collect()
}

/// What is fixed at zero may have any curvature: an end that must be met makes controls convex whose own
/// curvature is not.
#[test]
fn curvature_of_what_is_fixed_does_not_count() {
    for seed in 0..20 {
        let numbers = fixed_numbers(seed);
        let mut qp = program(&numbers, 0.0);
        let last = &mut qp.stages[N - 1];
        last.hessian_xx = SMatrix::from_diagonal_element(-50.0);
        last.gradient_x.fill(0.0);
        let before = qp.clone();
        let convex = SVector::<f64, NU>::repeat(1.0);
        let is_fixed = |k: usize, i: usize| k == N - 1 && i != 1;
        let mut free = before.clone();
        assert!(free.convexify(&convex, |_, _| false) > 0);
        // One component keeps its own curvature, and that is dropped; all of them, and none is.
        let mut partly = before.clone();
        assert!(partly.convexify(&convex, is_fixed) > 0);
        assert_eq!(qp.convexify(&convex, |k, _| k == N - 1), 0);
        // On the dynamics the end counts as if it cost 100 x^2 / 2, which is nothing where it is met.
        let point = rolled_out(&before, &numbers[10..]);
        let effort: f64 = point.u.iter().map(|u| 0.5 * u.norm_squared()).sum();
        let end = 0.5 * (100.0 + 50.0) * point.x[N - 1].norm_squared();
        let expected = before.cost(&point) + effort + end;
        let found = qp.cost(&point);
        assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{found} {expected}");
    }
}

/// The last stage lends its dynamics as memory and gets them back empty.
#[test]
fn the_last_stage_keeps_a_trace_of_curvature_alone() {
    let mut qp = program(&fixed_numbers(1), 0.1);
    let gradient = qp.stages[N - 1].gradient_x;
    qp.convexify(&SVector::repeat(1.0), |_, _| false);
    let last = &qp.stages[N - 1];
    assert_eq!(last.a, SMatrix::<f64, NX, NX>::zeros());
    assert_eq!(last.hessian_xx, SMatrix::<f64, NX, NX>::from_diagonal_element(1e-9));
    assert_eq!(last.gradient_x, gradient);
    // One stage alone, and none.
    let mut one = Qp::<1, NX, NU, 1>::ZERO;
    assert_eq!(one.convexify(&SVector::repeat(1.0), |_, _| false), 0);
    assert_eq!(one.stages[0].hessian_xx[(1, 1)], 1e-9);
    one.unused = 1;
    assert_eq!(one.convexify(&SVector::repeat(1.0), |_, _| false), 0);
}

/// What is not a number can't be made convex: it is reported as if all had been projected.
#[test]
fn what_is_not_a_number_is_not_made_convex() {
    let convex = SVector::<f64, NU>::repeat(1.0);
    let mut qp = program(&fixed_numbers(2), 0.1);
    qp.stages[3].hessian_uu[(0, 0)] = f64::NAN;
    qp.stages[3].hessian_xx[(0, 0)] = f64::NAN;
    qp.stages[4].b[(0, 0)] = f64::NAN;
    assert_eq!(qp.convexify(&convex, |_, _| false), N);
    let sound = program(&fixed_numbers(2), 0.1);
    // Stages before the one that failed are left as they were.
    assert_eq!(qp.stages[0].hessian_xx, sound.stages[0].hessian_xx);
    assert_eq!(qp.stages[0].gradient_x, sound.stages[0].gradient_x);
}

/// A control block that is indefinite by itself loses its curvature; the convex part is left.
#[test]
fn curvature_of_its_own_is_given_up_last() {
    let convex = SVector::<f64, NU>::from([1.0, 2.0]);
    let mut qp = program(&fixed_numbers(3), 0.0);
    qp.stages[2].hessian_uu = SMatrix::from_diagonal_element(-5.0);
    qp.stages[2].hessian_ux.fill(0.5);
    assert_eq!(qp.convexify(&convex, |_, _| false), 1);
    let stage = &qp.stages[2];
    assert!((stage.hessian_uu - SMatrix::from_diagonal(&convex)).amax() < 1e-6);
    assert!(stage.hessian_ux.amax() < 1e-6);
    // A share of nine tenths of the convex part may be lost, no more.
    for (lost, projected) in [(0.89, 0), (0.91, 1)] {
        let mut qp = program(&fixed_numbers(3), 0.0);
        qp.stages[2].hessian_uu = SMatrix::from_diagonal_element(-lost);
        assert_eq!(qp.convexify(&SVector::repeat(1.0), |_, _| false), projected, "{lost}");
    }
}

/// Work is counted in stages: one each, and nine more where curvature is projected.
#[test]
fn a_budget_is_spent_on_stages_from_the_last_back() {
    let convex = SVector::<f64, NU>::repeat(1.0);
    let whole = {
        let mut qp = program(&fixed_numbers(4), 0.05);
        qp.stages[3].hessian_uu = SMatrix::from_diagonal_element(-5.0);
        assert_eq!(qp.convexify(&convex, |_, _| false), 1);
        qp
    };
    let mut qp = program(&fixed_numbers(4), 0.05);
    qp.stages[3].hessian_uu = SMatrix::from_diagonal_element(-5.0);
    let [stages @ .., last] = &mut qp.stages;
    let mut convexification = Convexification::new(last, &convex);
    assert_eq!(convexification.advance(4, &mut stages[4..], 0, |_, _| false), (0, 0));
    let mut asked = Vec::new();
    let seen = std::cell::RefCell::new(&mut asked);
    let is_fixed = |k: usize, i: usize| {
        seen.borrow_mut().push((k, i));
        false
    };
    // Stage 4, then stage 3, whose curvature is projected, then the budget is spent.
    assert_eq!(convexification.advance(2, &mut stages[2..], 3, is_fixed), (2, 11));
    assert_eq!(asked, [(5, 0), (5, 1), (5, 2), (4, 0), (4, 1), (4, 2)]);
    assert_eq!(convexification.advance(1, &mut stages[1..3], 1, |_, _| false), (1, 1));
    assert_eq!(convexification.advance(0, &mut stages[..2], 99, |_, _| false), (2, 2));
    let (constant, projected) = convexification.finish();
    assert_eq!((qp.constant + constant, projected), (whole.constant, Some(1)));
    // In pieces as in one.
    assert_eq!(checksum(&qp), checksum(&whole));
}

/// Of all that convexification writes.
fn checksum(qp: &Program) -> u64 {
    let mut checksum = Checksum::new();
    for stage in &qp.stages {
        checksum.numbers(stage.hessian_xx.as_slice());
        checksum.numbers(stage.hessian_ux.as_slice());
        checksum.numbers(stage.hessian_uu.as_slice());
        checksum.numbers(stage.gradient_x.as_slice());
        checksum.numbers(stage.gradient_u.as_slice());
        checksum.numbers(stage.a.as_slice());
    }
    checksum.value()
}

/// Bits that are the same on every target. Whoever changes the method on purpose copies what this prints.
#[test]
fn fixed_programs_have_fixed_bits() {
    let (mut all, mut projected) = (Checksum::new(), 0);
    for seed in 0..20 {
        let mut qp = program(&fixed_numbers(seed), 0.1 * (1 + seed % 5) as f64);
        projected += qp.convexify(&SVector::from([1.0, 0.5]), |k, i| k == N - 1 && i == 0);
        all.integer(checksum(&qp));
        all.numbers([&qp.constant]);
    }
    let found = (projected, all.value());
    assert_eq!(found, (19, 0x7ef8_1492_4b0b_3ac0), "({}, 0x{:016x})", found.0, found.1);
}
