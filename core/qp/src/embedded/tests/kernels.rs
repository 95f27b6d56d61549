//! Factors and products against the matrices they stand for.

use super::super::kernels::{
    NotPositiveDefinite, add_transposed_product, factor, solve, sub_product,
};
use super::Numbers;
use nalgebra::{SMatrix, SVector};

fn factors<const D: usize>() {
    let mut numbers = Numbers(D as u64);
    for _ in 0..20 {
        let matrix = numbers.definite::<D>();
        // The upper triangle is not read.
        let mut factored = matrix;
        factored.fill_upper_triangle_with_lower_triangle();
        for j in 1..D {
            factored.view_mut((0, j), (j, 1)).fill(f64::NAN);
        }
        factor(&mut factored.data.0).unwrap();
        let mut unit = factored.lower_triangle();
        unit.fill_diagonal(1.0);
        let pivots = SMatrix::from_diagonal(&factored.diagonal().map(|inverse| 1.0 / inverse));
        assert!((unit * pivots * unit.transpose() - matrix).amax() < 1e-13, "L D L^T of {D}");
        let rhs: SVector<f64, D> = numbers.matrix(1.0);
        let mut x = rhs;
        solve(&factored.data.0, &mut x.data.0[0]);
        assert!((matrix * x - rhs).amax() < 1e-12, "{D}");
    }
}

#[test]
fn factors_are_those_of_the_matrix() {
    factors::<1>();
    factors::<2>();
    factors::<3>();
    factors::<6>();
    factors::<9>();
}

#[test]
fn a_matrix_that_is_not_definite_has_no_factor() {
    for (first, last) in [
        (-1.0, 1.0),
        (0.0, 1.0),
        (1.0, 0.0),
        (1.0, -1e-300),
        (f64::NAN, 1.0),
        (1.0, f64::NAN),
        (f64::INFINITY, 1.0),
        (1.0, f64::INFINITY),
    ] {
        let mut matrix = [[first, 0.0], [0.0, last]];
        assert_eq!(factor(&mut matrix), Err(NotPositiveDefinite), "{first} {last}");
    }
    // Definite on the diagonal alone.
    assert_eq!(factor(&mut [[1.0, 2.0], [2.0, 1.0]]), Err(NotPositiveDefinite));
    assert_eq!(factor(&mut [[4.0, 2.0], [2.0, 2.0]]), Ok(()));
}

#[test]
fn products_are_added_and_subtracted() {
    let mut numbers = Numbers(1);
    let m: SMatrix<f64, 4, 3> = numbers.matrix(1.0);
    let (x, y): (SVector<f64, 4>, SVector<f64, 3>) = (numbers.matrix(1.0), numbers.matrix(1.0));
    let mut sum = y;
    add_transposed_product(&m.data.0, &x.data.0[0], &mut sum.data.0[0]);
    assert!((sum - y - m.transpose() * x).amax() < 1e-15);
    let mut difference = x;
    sub_product(&m.data.0, &y.data.0[0], &mut difference.data.0[0]);
    assert!((difference - x + m * y).amax() < 1e-15);
    // Columns that are not there are not subtracted.
    let mut difference = x;
    sub_product(&m.data.0[..1], &y.data.0[0], &mut difference.data.0[0]);
    assert!((difference - x + m.column(0) * y[0]).amax() < 1e-15);
}
