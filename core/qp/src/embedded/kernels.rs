//! Dense kernels of the solver alone, beside those of [`crate::dense::matrix`]: column-major, with the
//! same order of operations with and without vector registers.

use crate::dense::divisor;

/// `y += M^T x` where no transpose is stored. Cost: `2 R C` flops.
#[inline(always)]
pub(super) fn add_transposed_product<const R: usize, const C: usize>(
    m: &[[f64; R]; C],
    x: &[f64; R],
    y: &mut [f64; C],
) {
    for (y, column) in y.iter_mut().zip(m) {
        for (m, x) in column.iter().zip(x) {
            *y += m * x;
        }
    }
}

/// `y -= M x` over the columns of `M`. Cost: `2 R C` flops.
#[inline(always)]
pub(super) fn sub_product<const R: usize>(m: &[[f64; R]], x: &[f64], y: &mut [f64; R]) {
    for (column, factor) in m.iter().zip(x) {
        for (y, m) in y.iter_mut().zip(column) {
            *y -= m * factor;
        }
    }
}

/// A pivot was not positive, or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotPositiveDefinite;

/// Factors symmetric `m = L D L^T` in place, `L` unit lower triangular below the diagonal, `1 / D`
/// on it; reads the lower triangle, leaves the upper one undefined. Cost: `R^3 / 3` flops (twice
/// that with whole columns), `R` divisions.
#[inline(always)]
pub(super) fn factor<const R: usize>(m: &mut [[f64; R]; R]) -> Result<(), NotPositiveDefinite> {
    for j in 0..R {
        let mut column = m[j];
        let pivot = column[j];
        // Written so that NaN fails.
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return Err(NotPositiveDefinite);
        }
        let inverse = 1.0 / divisor(pivot);
        for k in j + 1..R {
            let factor = column[k] * inverse;
            for (l, c) in m[k].iter_mut().zip(&column) {
                *l -= c * factor;
            }
        }
        for c in &mut column {
            *c *= inverse;
        }
        column[j] = inverse;
        m[j] = column;
    }
    Ok(())
}

/// Solves `L D L^T x = b` in place with what [`factor`] left. Cost: `2 R^2` flops.
#[inline(always)]
pub(super) fn solve<const R: usize>(factor: &[[f64; R]; R], b: &mut [f64; R]) {
    for j in 0..R {
        let x = b[j];
        for i in j + 1..R {
            b[i] -= factor[j][i] * x;
        }
    }
    for j in (0..R).rev() {
        let mut x = b[j] * factor[j][j];
        for i in j + 1..R {
            x -= factor[j][i] * b[i];
        }
        b[j] = x;
    }
}
