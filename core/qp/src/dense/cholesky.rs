//! Cholesky factorisation of small dense matrices, in place.

use super::divisor;
use nalgebra::SMatrix;

/// A pivot was not positive (or not a number).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite;

/// Overwrites the lower triangle of symmetric `a` with its Cholesky factor `L`, `a = L L^T`.
///
/// Reads and writes the lower triangle only. Cost: `D^3 / 3` flops, `D` square roots.
///
/// # Errors
/// [`NotPositiveDefinite`] where a pivot is not a positive number; `a` is then half overwritten.
#[inline]
pub fn cholesky_in_place<const D: usize>(
    a: &mut SMatrix<f64, D, D>,
) -> Result<(), NotPositiveDefinite> {
    for j in 0..D {
        for k in 0..j {
            let factor = a[(j, k)];
            for i in j..D {
                a[(i, j)] -= a[(i, k)] * factor;
            }
        }
        let pivot = a[(j, j)];
        // Written so that NaN fails too.
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return Err(NotPositiveDefinite);
        }
        let inverse = 1.0 / libm::sqrt(pivot);
        for i in j..D {
            a[(i, j)] *= inverse;
        }
    }
    Ok(())
}

/// Solves `L L^T x = b` in place for `C` right-hand sides at once, `L` the lower triangle of
/// `factor`. Cost: `2 C D^2` flops, `D` divisions.
#[inline]
pub fn cholesky_solve_in_place<const D: usize, const C: usize>(
    factor: &SMatrix<f64, D, D>,
    b: &mut SMatrix<f64, D, C>,
) {
    let inverse = factor.diagonal().map(|pivot| 1.0 / divisor(pivot));
    for c in 0..C {
        for j in 0..D {
            let x = b[(j, c)] * inverse[j];
            b[(j, c)] = x;
            for i in j + 1..D {
                b[(i, c)] -= factor[(i, j)] * x;
            }
        }
        for j in (0..D).rev() {
            let mut x = b[(j, c)];
            for i in j + 1..D {
                x -= factor[(i, j)] * b[(i, c)];
            }
            b[(j, c)] = x * inverse[j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed_cases;
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(fixed_cases())]

        #[test]
        fn solves_random_positive_definite_systems(
            entries in proptest::array::uniform32(-1.0..1.0f64),
            rhs in proptest::array::uniform5(-1.0..1.0f64),
        ) {
            let m = SMatrix::<f64, 5, 5>::from_iterator(entries.into_iter().take(25));
            let a = m * m.transpose() + SMatrix::identity() * 0.1;
            let b = SVector::from(rhs);
            let (mut factor, mut x) = (a, b);
            cholesky_in_place(&mut factor).unwrap();
            cholesky_solve_in_place(&factor, &mut x);
            prop_assert!((a * x - b).norm() < 1e-11);
        }
    }

    #[test]
    fn refuses_indefinite_and_nan() {
        let mut indefinite = SMatrix::<f64, 2, 2>::new(1.0, 2.0, 2.0, 1.0);
        assert_eq!(cholesky_in_place(&mut indefinite), Err(NotPositiveDefinite));
        let mut nan = SMatrix::<f64, 2, 2>::new(f64::NAN, 0.0, 0.0, 1.0);
        assert_eq!(cholesky_in_place(&mut nan), Err(NotPositiveDefinite));
    }

    /// `[4, 2; 2, 5] = L L^T` with `L = [2, 0; 1, 2]`.
    #[test]
    fn a_factor_known_by_heart() {
        let mut factor = SMatrix::<f64, 2, 2>::new(4.0, f64::NAN, 2.0, 5.0);
        cholesky_in_place(&mut factor).unwrap();
        assert_eq!((factor[(0, 0)], factor[(1, 0)], factor[(1, 1)]), (2.0, 1.0, 2.0));
        // The upper triangle is neither read nor written.
        assert!(factor[(0, 1)].is_nan());
        // Two right-hand sides at once: A x = b with x = (1, 1) and (2, -1).
        let mut b = SMatrix::<f64, 2, 2>::new(6.0, 6.0, 7.0, -1.0);
        cholesky_solve_in_place(&factor, &mut b);
        assert_eq!(b, SMatrix::<f64, 2, 2>::new(1.0, 2.0, 1.0, -1.0));
    }

    #[test]
    fn a_factor_squared_is_the_matrix() {
        let matrix = SMatrix::<f64, 4, 4>::new(
            9.0, 1.0, -2.0, 0.5, 1.0, 7.0, 3.0, -1.0, -2.0, 3.0, 8.0, 2.0, 0.5, -1.0, 2.0, 6.0,
        );
        let mut factor = matrix;
        cholesky_in_place(&mut factor).unwrap();
        let lower = factor.lower_triangle();
        assert!((lower * lower.transpose() - matrix).amax() < 1e-14);
        let mut inverse = SMatrix::<f64, 4, 4>::identity();
        cholesky_solve_in_place(&factor, &mut inverse);
        assert!((inverse * matrix - SMatrix::<f64, 4, 4>::identity()).amax() < 1e-14);
    }

    #[test]
    fn pivots_are_positive_and_finite() {
        for (first, last) in
            [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (f64::INFINITY, 1.0), (1.0, f64::INFINITY)]
        {
            let mut matrix = SMatrix::<f64, 2, 2>::new(first, 0.0, 0.0, last);
            assert_eq!(cholesky_in_place(&mut matrix), Err(NotPositiveDefinite), "{first} {last}");
        }
        let mut least = SMatrix::<f64, 1, 1>::new(1e-300);
        assert_eq!(cholesky_in_place(&mut least), Ok(()));
    }
}
