//! Eigenvalues of small symmetric matrices.

use nalgebra::{SMatrix, SVector};

/// Sweeps of Jacobi rotations: convergence is quadratic, and dozens of sizes need fewer.
pub const MAX_SWEEPS: usize = 12;

/// Replaces symmetric `a` by the nearest positive semidefinite matrix: negative eigenvalues
/// become zero.
///
/// Jacobi's method: rotations in a fixed order, the same bits everywhere. Cost: about
/// `6 D^3` flops a sweep, some six sweeps. What is not finite is left as it is.
// Seldom needed: its memory is on the stack only then.
#[inline(never)]
pub fn project_positive<const D: usize>(a: &mut SMatrix<f64, D, D>) {
    let mut vectors = SMatrix::<f64, D, D>::identity();
    let mut m = *a;
    // Bound: sweeps.
    for _ in 0..MAX_SWEEPS {
        let mut off = 0.0;
        let mut diagonal = 0.0;
        for j in 0..D {
            diagonal += m[(j, j)] * m[(j, j)];
            for i in 0..j {
                off += m[(i, j)] * m[(i, j)];
            }
        }
        if !(off > 1e-28 * diagonal) {
            break;
        }
        // Entries that could not add up to what is left for nothing are left alone.
        let negligible = 1e-28 * diagonal / (D * D) as f64;
        for q in 1..D {
            for p in 0..q {
                let entry = m[(p, q)];
                if entry * entry > negligible {
                    rotate(&mut m, &mut vectors, p, q);
                }
            }
        }
    }
    for k in 0..D {
        let value = m[(k, k)];
        if value < 0.0 {
            let v = SVector::<f64, D>::from_fn(|i, _| vectors[(i, k)]);
            *a -= v * v.transpose() * value;
        }
    }
    *a = (*a + a.transpose()) * 0.5;
}

/// Zeroes the entry `(p, q)` by a rotation of those two axes.
fn rotate<const D: usize>(
    m: &mut SMatrix<f64, D, D>,
    vectors: &mut SMatrix<f64, D, D>,
    p: usize,
    q: usize,
) {
    let entry = m[(p, q)];
    let theta = 0.5 * (m[(q, q)] - m[(p, p)]) / entry;
    let sign = if theta < 0.0 { -1.0 } else { 1.0 };
    let t = sign / (theta.abs() + libm::sqrt(theta * theta + 1.0));
    let c = 1.0 / libm::sqrt(t * t + 1.0);
    let s = t * c;
    for i in 0..D {
        let (x, y) = (m[(i, p)], m[(i, q)]);
        m[(i, p)] = c * x - s * y;
        m[(i, q)] = s * x + c * y;
        let (x, y) = (vectors[(i, p)], vectors[(i, q)]);
        vectors[(i, p)] = c * x - s * y;
        vectors[(i, q)] = s * x + c * y;
    }
    for i in 0..D {
        let (x, y) = (m[(p, i)], m[(q, i)]);
        m[(p, i)] = c * x - s * y;
        m[(q, i)] = s * x + c * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn projection_is_nearest(entries in proptest::array::uniform32(-1.0..1.0f64)) {
            let m = SMatrix::<f64, 5, 5>::from_iterator(entries.into_iter().take(25));
            let a = m + m.transpose();
            let mut projected = a;
            project_positive(&mut projected);
            // What is left and what was taken are orthogonal, one positive, the other negative.
            let taken = projected - a;
            prop_assert!((projected * taken).norm() < 1e-11);
            let shift = SMatrix::<f64, 5, 5>::identity() * 1e-11;
            prop_assert!(nalgebra::Cholesky::new(projected + shift).is_some());
            prop_assert!(nalgebra::Cholesky::new(taken + shift).is_some());
        }
    }

    #[test]
    fn diagonal_and_not_finite() {
        let mut a = SMatrix::<f64, 3, 3>::from_diagonal(&[2.0, -1.0, 0.0].into());
        project_positive(&mut a);
        assert_eq!(a, SMatrix::from_diagonal(&[2.0, 0.0, 0.0].into()));
        let mut nan = SMatrix::<f64, 2, 2>::repeat(f64::NAN);
        project_positive(&mut nan);
        assert!(nan[(0, 0)].is_nan());
    }
}
