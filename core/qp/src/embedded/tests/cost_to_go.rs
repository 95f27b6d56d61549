//! The regularised cost-to-go against the inverse that defines it.

use super::super::InitialPoint;
use super::super::cost_to_go::CostToGo;
use super::super::variables::{Free, StageVariables};
use super::Numbers;
use crate::{Qp, QpStage};
use nalgebra::{SMatrix, SVector};

const D: usize = 4;
type Matrix = SMatrix<f64, D, D>;
type Vector = SVector<f64, D>;

/// A mask in which `fixed` components are not free: there is no other way to one than a program.
fn mask(fixed: &[usize]) -> Free<D> {
    let mut stage = QpStage::<D, 1, 0>::ZERO;
    stage.upper_x.fill(1.0);
    fixed.iter().for_each(|i| stage.upper_x[*i] = 0.0);
    let qp = Qp::<1, D, 1, 0> { stages: [stage], defect_penalty: 1.0, ..Qp::ZERO };
    let mut vars = StageVariables::ZERO;
    vars.initialise(0, &qp, InitialPoint::ELASTIC).unwrap();
    vars.free_x
}

/// A cost-to-go whose fixed components are zero.
fn masked(numbers: &mut Numbers, fixed: &[usize]) -> Matrix {
    let mut p = numbers.definite::<D>();
    for i in fixed {
        p.row_mut(*i).fill(0.0);
        p.column_mut(*i).fill(0.0);
    }
    p
}

#[test]
fn the_schur_complement_is_the_inverse_of_a_sum() {
    let mut numbers = Numbers(1);
    for scale in [1e-6, 1e-3, 0.5, 3.0, 1e3] {
        let p = masked(&mut numbers, &[]);
        let d = Vector::from_fn(|i, _| scale * [1.0, 0.3, 4.0, 1.5][i]);
        let expected =
            (p.try_inverse().unwrap() + Matrix::from_diagonal(&d)).try_inverse().unwrap();
        let (mut found, mut next) = (p, CostToGo::ZERO);
        next.schur_complement(&mut found.data.0, d.data.0[0], Free::ALL).unwrap();
        assert!((found - expected).amax() < 1e-12 * expected.amax(), "{scale}: {found}");
        // The columns are mirrored, so that both halves have the same bits.
        assert_eq!(found, found.transpose());
    }
    let mut indefinite = Matrix::from_diagonal_element(-2.0);
    let mut next = CostToGo::<D>::ZERO;
    assert!(next.schur_complement(&mut indefinite.data.0, [1.0; D], Free::ALL).is_err());
}

/// Equations of substitution: `x+ = y - D lambda`, `lambda = P x+ + p`; fixed components stay.
fn satisfies(p: &Matrix, d: &Vector, fixed: &[usize], is_rigid: bool, numbers: &mut Numbers) {
    let (mut block, mut next) = (*p, CostToGo::ZERO);
    match is_rigid {
        true => next.of_rigid_dynamics(&mut block.data.0, d[0], mask(fixed)),
        false => next.schur_complement(&mut block.data.0, d.data.0[0], mask(fixed)).unwrap(),
    }
    for i in fixed {
        assert_eq!(block[(*i, *i)], 1.0 / d[*i]);
    }
    let (mut gradient, y): (Vector, Vector) = (numbers.matrix(1.0), numbers.matrix(1.0));
    fixed.iter().for_each(|i| gradient[*i] = 0.0);
    next.gradient = gradient.data.0[0];
    let (x, lambda) = next.substitute(&y.data.0[0]);
    let (x, lambda) = (Vector::from(x), Vector::from(lambda));
    for i in 0..D {
        let is_fixed = fixed.contains(&i);
        let own = if is_rigid && !is_fixed { 0.0 } else { d[i] };
        let dynamics = x[i] - y[i] + own * lambda[i];
        assert!(dynamics.abs() < 1e-12 * (1.0 + own), "{i} of {fixed:?}: {dynamics:e}");
        let cost = lambda[i] - (p * x + gradient)[i];
        match is_fixed {
            true => assert_eq!(x[i], 0.0),
            false => assert!(cost.abs() < 1e-9 * (1.0 + lambda[i].abs()), "{i}: {cost:e}"),
        }
    }
    // The cost-to-go by y has the gradient lambda: P~ y where p is zero.
    next.gradient = [0.0; D];
    let (_, lambda) = next.substitute(&y.data.0[0]);
    let difference = Vector::from(lambda) - block * y;
    assert!(difference.amax() < 1e-9 * (1.0 + (block * y).amax()), "{difference}");
}

#[test]
fn substitution_solves_the_regularised_dynamics() {
    let mut numbers = Numbers(2);
    for fixed in [&[][..], &[1], &[0, 3], &[0, 1, 2, 3]] {
        for scale in [1e-8, 1e-2, 0.9, 1.1, 50.0] {
            let p = masked(&mut numbers, fixed);
            let d = Vector::from_fn(|i, _| scale * [1.0, 0.2, 3.0, 0.7][i]);
            satisfies(&p, &d, fixed, false, &mut numbers);
            // Regularisation of one and more is no rounding any more: dynamics are not rigid then.
            satisfies(&p, &Vector::repeat(0.01 * scale), fixed, true, &mut numbers);
        }
    }
}

/// Rigid dynamics leave the cost-to-go as it is, to the bit.
#[test]
fn rigid_dynamics_change_nothing() {
    let p = masked(&mut Numbers(3), &[]);
    let (mut found, mut next) = (p, CostToGo::ZERO);
    next.of_rigid_dynamics(&mut found.data.0, 1e-8, Free::ALL);
    assert_eq!(found, p);
    let y = [0.5, -1.0, 0.25, 2.0];
    assert_eq!(next.substitute(&y).0, y);
}
