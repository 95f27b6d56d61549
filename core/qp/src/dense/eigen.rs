//! Projection of small symmetric matrices onto the positive semidefinite cone.

use crate::simd::multiversion;
use nalgebra::SMatrix;

/// Sweeps of Jacobi rotations: convergence is quadratic, and dozens of sizes need fewer.
pub const MAX_SWEEPS: usize = 12;

/// Squared cosine of the angle between two columns that count as orthogonal.
const ORTHOGONAL: f64 = 1e-28;

multiversion! {
    /// Projects symmetric `a` onto the positive semidefinite cone: negative eigenvalues become zero.
    ///
    /// Hestenes' one-sided Jacobi method on `a + 2 |a| I`, which is well conditioned: rotations from
    /// the right make its columns orthogonal, so that they end as eigenvectors, as long as their
    /// eigenvalues. A round rotates `D / 2` pairs of columns that have none in common: columns lie side
    /// by side in memory, and no rotation of a round waits for another. The order is fixed: the same
    /// bits everywhere. Cost: about `5 D^3` flops a sweep, some six sweeps. What is not finite is left
    /// as it is.
    // Not inlined: it is seldom called and needs a large frame.
    #[inline(never)]
    pub fn project_positive<const D: usize>(a: &mut SMatrix<f64, D, D>) {
        let shift = 2.0 * libm::sqrt(a.iter().map(|x| x * x).sum());
        // Written so that NaN fails.
        if !(shift > 0.0 && shift < f64::INFINITY) {
            return;
        }
        let mut columns = a.data.0;
        for (i, column) in columns.iter_mut().enumerate() {
            column.get_mut(i).into_iter().for_each(|entry| *entry += shift);
        }
        // Bound: sweeps.
        for _ in 0..MAX_SWEEPS {
            let mut rotated = false;
            let mut squares = columns.map(|column| dot(&column, &column));
            for round in 0..rounds(D) {
                rotated |= rotate_round(&mut columns, &mut squares, round);
            }
            if !rotated {
                break;
            }
        }
        for column in &columns {
            let square = dot(column, column);
            let value = square * inverse_root(square) - shift;
            if value < 0.0 {
                let v = SMatrix::<f64, D, 1>::from(*column);
                *a -= v * v.transpose() * (value / square);
            }
        }
        *a = (*a + a.transpose()) * 0.5;
    }
}

/// Number of rounds of a round-robin tournament of `count` columns.
const fn rounds(count: usize) -> usize {
    // With an odd number one column rests each round.
    if count.is_multiple_of(2) { count.saturating_sub(1) } else { count }
}

/// Columns of pair `i` in a round; `None` where one of them rests.
#[inline(always)]
fn pair<const D: usize>(round: usize, i: usize) -> Option<(usize, usize)> {
    // The last column of an even number stays; the others rotate (circle method).
    let circle = rounds(D).max(1);
    let p = (round + i) % circle;
    let q = match i {
        0 if D.is_multiple_of(2) => circle,
        0 => return None,
        _ => (round + circle - i) % circle,
    };
    (p < D && q < D).then_some((p, q))
}

/// Orthogonalises the pairs of a round and updates the columns' `squares`; returns whether any pair
/// was rotated.
#[inline(always)]
fn rotate_round<const D: usize>(
    columns: &mut [[f64; D]; D],
    squares: &mut [f64; D],
    round: usize,
) -> bool {
    // All inner products, then all angles, then all rotations: each loop vectorises.
    let (mut difference, mut product) = ([0.0; D], [0.0; D]);
    let mut any = false;
    for i in 0..D.div_ceil(2) {
        let Some((p, q)) = pair::<D>(round, i) else { continue };
        let (Some(x), Some(y)) = (columns.get(p), columns.get(q)) else { continue };
        let (Some(xx), Some(yy)) = (squares.get(p), squares.get(q)) else { continue };
        let xy = dot(x, y);
        if xy * xy > ORTHOGONAL * xx * yy {
            (difference[i], product[i]) = (yy - xx, xy);
            any = true;
        }
    }
    let (mut tangent, mut cosine) = ([0.0; D], [1.0; D]);
    for i in 0..D.div_ceil(2) {
        // t = tan of the angle, the smaller root of t^2 + 2 zeta t - 1 with zeta = d / 2 p, written
        // without the quotient: where there is nothing to rotate t is 0 / (0 + 0 + tiny).
        let (d, p) = (difference[i], 2.0 * product[i]);
        let sign = if d < 0.0 { -1.0 } else { 1.0 };
        let square = d * d + p * p;
        let t = sign * p / (d.abs() + square * inverse_root(square) + f64::MIN_POSITIVE);
        cosine[i] = inverse_root(t * t + 1.0);
        tangent[i] = t;
    }
    for i in 0..D.div_ceil(2) {
        let Some((p, q)) = pair::<D>(round, i) else { continue };
        let (Some(x), Some(y)) = (columns.get(p).copied(), columns.get(q).copied()) else {
            continue;
        };
        let (c, s) = (cosine[i], tangent[i] * cosine[i]);
        columns.get_mut(p).into_iter().for_each(|to| combine(to, (c, &x), (-s, &y)));
        columns.get_mut(q).into_iter().for_each(|to| combine(to, (s, &x), (c, &y)));
        squares.get_mut(p).into_iter().for_each(|square| *square -= tangent[i] * product[i]);
        squares.get_mut(q).into_iter().for_each(|square| *square += tangent[i] * product[i]);
    }
    any
}

/// Writes `a x + b y`.
#[inline(always)]
fn combine<const D: usize>(to: &mut [f64; D], (a, x): (f64, &[f64; D]), (b, y): (f64, &[f64; D])) {
    for j in 0..D {
        to[j] = a * x[j] + b * y[j];
    }
}

/// `1 / sqrt(x)` of a normal `x > 0`, within four units in the last place; of zero a large number.
///
/// Newton's method from the halved exponent (the constant is Lomont's, for doubles). `libm`'s root
/// is dozens of operations on most targets, and on x86-64 an instruction in the old encoding, which
/// stalls code for AVX; this is 17 operations that stand side by side with those of other pairs.
#[inline(always)]
fn inverse_root(x: f64) -> f64 {
    let mut y = f64::from_bits(0x5fe6_eb50_c7b5_37a9 - (x.to_bits() >> 1));
    for _ in 0..4 {
        y *= 1.5 - 0.5 * x * y * y;
    }
    y
}

/// Inner product, four sums at a time.
fn dot<const D: usize>(x: &[f64; D], y: &[f64; D]) -> f64 {
    let mut sums = [0.0; 4];
    let (x, x_rest) = x.as_chunks::<4>();
    let (y, y_rest) = y.as_chunks::<4>();
    for (x, y) in x.iter().zip(y) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    mod known;

    use super::*;
    use crate::fixed_cases;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(fixed_cases())]

        #[test]
        fn projection_is_nearest(entries in proptest::array::uniform32(-1.0..1.0f64)) {
            let m = SMatrix::<f64, 5, 5>::from_iterator(entries.into_iter().take(25));
            let a = m + m.transpose();
            let mut projected = a;
            project_positive(&mut projected);
            // The projection and its change are orthogonal, and both are positive.
            let taken = projected - a;
            prop_assert!((projected * taken).norm() < 1e-11);
            let shift = SMatrix::<f64, 5, 5>::identity() * 1e-11;
            prop_assert!(nalgebra::Cholesky::new(projected + shift).is_some());
            prop_assert!(nalgebra::Cholesky::new(taken + shift).is_some());
        }
    }

    /// The projection by another algorithm.
    fn by_tridiagonal(a: &SMatrix<f64, 12, 12>) -> SMatrix<f64, 12, 12> {
        let mut eigen = a.symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(0.0));
        eigen.recompose()
    }

    proptest! {
        #![proptest_config(fixed_cases())]

        #[test]
        fn another_algorithm_agrees(
            entries in proptest::collection::vec(-1.0..1.0f64, 144),
            scales in proptest::collection::vec(-3.0..3.0f64, 12),
        ) {
            let mut a = SMatrix::<f64, 12, 12>::from_iterator(entries);
            a += a.transpose();
            for i in 0..12 {
                for j in 0..12 {
                    a[(i, j)] *= libm::exp10(scales[i] + scales[j]);
                }
            }
            let mut projected = a;
            project_positive(&mut projected);
            let difference = (projected - by_tridiagonal(&a)).norm();
            prop_assert!(difference <= 1e-12 * a.norm(), "{difference} of {}", a.norm());
        }
    }

    proptest! {
        #![proptest_config(fixed_cases())]

        #[test]
        fn the_root_is_the_library_s(mantissa in 1.0..4.0f64, exponent in -900..900i32) {
            let x = libm::scalbn(mantissa, exponent);
            let exact = 1.0 / libm::sqrt(x);
            prop_assert!((inverse_root(x) - exact).abs() <= 4.0 * f64::EPSILON * exact, "{x:e}");
        }
    }

    #[test]
    fn each_column_meets_each_other_once() {
        fn meetings<const D: usize>() {
            let mut met = [[0; D]; D];
            for round in 0..rounds(D) {
                let mut seen = [false; D];
                for (p, q) in (0..D.div_ceil(2)).filter_map(|i| pair::<D>(round, i)) {
                    assert!(p != q && !seen[p] && !seen[q], "{D}: {round}");
                    (seen[p], seen[q]) = (true, true);
                    met[p.min(q)][p.max(q)] += 1;
                }
            }
            for p in 0..D {
                assert!((0..D).all(|q| met[p][q] == usize::from(q > p)), "{D}: {p}");
            }
        }
        meetings::<1>();
        meetings::<2>();
        meetings::<3>();
        meetings::<5>();
        meetings::<12>();
    }

    #[test]
    fn diagonal_and_not_finite() {
        let mut a = SMatrix::<f64, 3, 3>::from_diagonal(&[2.0, -1.0, 0.0].into());
        project_positive(&mut a);
        assert!((a - SMatrix::from_diagonal(&[2.0, 0.0, 0.0].into())).norm() < 1e-15);
        let mut zero = SMatrix::<f64, 3, 3>::zeros();
        project_positive(&mut zero);
        assert_eq!(zero.norm(), 0.0);
        let mut nan = SMatrix::<f64, 2, 2>::repeat(f64::NAN);
        project_positive(&mut nan);
        assert!(nan[(0, 0)].is_nan());
    }
}
