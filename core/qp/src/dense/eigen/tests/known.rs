//! Projections known beforehand, of every size, and fixed bits.

use super::*;
use crate::Checksum;

/// `I - 2 w w^T / w^T w`, a reflection: its columns are orthonormal eigenvectors to be.
fn reflection<const D: usize>() -> SMatrix<f64, D, D> {
    let w = SMatrix::<f64, D, 1>::from_fn(|i, _| 1.0 + ((3 * i) % 5) as f64);
    SMatrix::identity() - w * w.transpose() * (2.0 / w.dot(&w))
}

/// A matrix of these eigenvalues, and its projection.
fn with_eigenvalues<const D: usize>(of: impl Fn(usize) -> f64) -> [SMatrix<f64, D, D>; 2] {
    let vectors = reflection::<D>();
    let matrix = |of: &dyn Fn(usize) -> f64| {
        let values = SMatrix::<f64, D, 1>::from_fn(|i, _| of(i));
        let m = vectors * SMatrix::from_diagonal(&values) * vectors.transpose();
        (m + m.transpose()) * 0.5
    };
    [matrix(&of), matrix(&|i| of(i).max(0.0))]
}

fn is_projected<const D: usize>() {
    let kinds: [fn(usize) -> f64; 6] = [
        |i| 1.0 - i as f64,
        |i| if i % 2 == 0 { 3.0 } else { -3.0 },
        |i| if i == 0 { -1e6 } else { 1e-6 },
        |i| 1.0 + i as f64,
        |_| -2.0,
        |i| [0.0, 5.0, -5.0][i % 3],
    ];
    for (kind, of) in kinds.into_iter().enumerate() {
        let [matrix, expected] = with_eigenvalues::<D>(of);
        let mut projected = matrix;
        project_positive(&mut projected);
        let size = 1.0 + matrix.amax();
        assert!((projected - expected).amax() < 1e-13 * size, "{D}, kind {kind}");
        assert_eq!(projected, projected.transpose());
        // A projection stays where it is.
        let mut again = projected;
        project_positive(&mut again);
        assert!((again - projected).amax() < 1e-13 * size, "{D}, kind {kind}");
    }
}

#[test]
fn matrices_of_known_eigenvalues() {
    is_projected::<1>();
    is_projected::<2>();
    is_projected::<3>();
    is_projected::<4>();
    is_projected::<5>();
    is_projected::<8>();
    is_projected::<11>();
}

/// Off the diagonal alone: eigenvalues 1 and -1, along the diagonals of the square.
#[test]
fn a_quarter_turn() {
    let mut a = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 1.0, 0.0);
    project_positive(&mut a);
    assert!((a - SMatrix::<f64, 2, 2>::repeat(0.5)).amax() < 1e-15);
    let mut a = SMatrix::<f64, 2, 2>::new(0.0, -1.0, -1.0, 0.0);
    project_positive(&mut a);
    assert!((a - SMatrix::<f64, 2, 2>::new(0.5, -0.5, -0.5, 0.5)).amax() < 1e-15);
}

#[test]
fn what_is_not_finite_is_left_alone() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
        let mut a = SMatrix::<f64, 3, 3>::identity() * -1.0;
        a[(2, 1)] = value;
        let before = a.map(f64::to_bits);
        project_positive(&mut a);
        assert_eq!(a.map(f64::to_bits), before, "{value}");
    }
}

/// A rotation makes columns orthogonal, keeps the sum of squares, and knows each square afterwards.
fn rotates<const D: usize>() {
    let mut columns = [[0.0; D]; D];
    for (j, column) in columns.iter_mut().enumerate() {
        for (i, entry) in column.iter_mut().enumerate() {
            *entry = ((7 * i + 11 * j) % 13) as f64 - 5.5 + f64::from(u8::from(i == j));
        }
    }
    let mut squares = columns.map(|column| dot(&column, &column));
    let total: f64 = squares.iter().sum();
    for round in 0..rounds(D) {
        assert!(rotate_round(&mut columns, &mut squares, round));
        for (p, q) in (0..D.div_ceil(2)).filter_map(|i| pair::<D>(round, i)) {
            let product = dot(&columns[p], &columns[q]);
            assert!(product.abs() < 1e-13 * total, "{p} {q} of {D}: {product:e}");
        }
        for (column, square) in columns.iter().zip(&squares) {
            assert!((dot(column, column) - square).abs() < 1e-13 * total, "{D}");
        }
        let now: f64 = squares.iter().sum();
        assert!((now - total).abs() < 1e-13 * total);
    }
}

#[test]
fn rotations_make_columns_orthogonal() {
    rotates::<2>();
    rotates::<3>();
    rotates::<4>();
    rotates::<7>();
    rotates::<10>();
}

/// Of two ways to turn, the smaller: the longer of two columns stays the longer.
#[test]
fn rotations_are_small() {
    for (first, second) in [(3.0, 1.0), (1.0, 3.0)] {
        let mut columns = [[first, 0.25], [0.25, second]];
        let mut squares = columns.map(|column| dot(&column, &column));
        assert!(rotate_round(&mut columns, &mut squares, 0));
        assert_eq!(squares[0] > squares[1], first > second);
        assert!(columns[0][0] > 0.9 * first && columns[1][1] > 0.9 * second);
    }
    // Columns that are orthogonal to rounding are left as they are.
    let mut columns = [[1.0, 0.0], [1e-15, 1.0]];
    let before = columns;
    let mut squares = [1.0; 2];
    assert!(!rotate_round(&mut columns, &mut squares, 0));
    assert_eq!((columns, squares), (before, [1.0; 2]));
    let mut columns = [[1.0, 0.0], [1e-13, 1.0]];
    assert!(rotate_round(&mut columns, &mut squares, 0));
}

#[test]
fn sums_of_every_length() {
    fn is_sum<const D: usize>() {
        let x: [f64; D] = core::array::from_fn(|i| 1.0 + i as f64);
        let y: [f64; D] = core::array::from_fn(|i| 2.0 - i as f64);
        let expected = (0..D).map(|i| x[i] * y[i]).sum::<f64>();
        assert_eq!(dot(&x, &y), expected, "{D}");
        let mut to = [9.0; D];
        combine(&mut to, (2.0, &x), (-3.0, &y));
        assert!((0..D).all(|i| to[i] == 2.0 * x[i] - 3.0 * y[i]), "{D}");
    }
    is_sum::<0>();
    is_sum::<1>();
    is_sum::<3>();
    is_sum::<4>();
    is_sum::<6>();
    is_sum::<8>();
    is_sum::<13>();
}

#[test]
fn a_round_for_each_column_but_one() {
    assert_eq!([0, 1, 2, 3, 4, 5, 12].map(rounds), [0, 1, 1, 3, 3, 5, 11]);
    // Of zero the inverse root is large and no infinity.
    assert!(inverse_root(0.0) > 1e100 && inverse_root(0.0).is_finite());
}

/// Bits that are the same on every target. Whoever changes the method on purpose copies what this prints.
#[test]
fn fixed_matrices_have_fixed_bits() {
    fn add<const D: usize>(checksum: &mut Checksum) {
        for seed in 0..6 {
            let mut a = SMatrix::<f64, D, D>::from_fn(|i, j| {
                let (i, j) = (i.min(j), i.max(j));
                ((13 * i + 29 * j + 7 * i * j + 31 * seed) % 37) as f64 / 9.0 - 2.0
            });
            project_positive(&mut a);
            checksum.numbers(a.as_slice());
        }
    }
    let mut checksum = Checksum::new();
    add::<2>(&mut checksum);
    add::<3>(&mut checksum);
    add::<6>(&mut checksum);
    add::<9>(&mut checksum);
    add::<12>(&mut checksum);
    assert_eq!(checksum.value(), 0x369c_fa73_4110_480e, "0x{:016x}", checksum.value());
}
