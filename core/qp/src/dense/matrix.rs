//! Products of small dense matrices stored by columns, `[[f64; ROWS]; COLUMNS]`: what nalgebra's
//! fixed-size matrices hold in `data.0`.
//!
//! Every kernel runs down whole columns (`column += column * number`), so that vector registers
//! take several rows at once while each entry is still the same sum in the same order: the same
//! bits on every target, vectors or not. A dot product down a column would have to be reassociated
//! to be vectorised; that is why `a^T b` is written as [`transpose`] and [`multiply_add`].

/// `y += x * factor`, one column. Cost: `2 R` flops.
#[inline(always)]
pub fn axpy<const R: usize>(y: &mut [f64; R], x: &[f64; R], factor: f64) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += *x * factor;
    }
}

/// `out += a b` over the columns of `out`, `b` and `a`: fewer of `a` where its last ones meet zeros. Cost:
/// `2 R K C` flops.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn multiply_add<const R: usize, const K: usize>(
    out: &mut [[f64; R]],
    a: &[[f64; R]],
    b: &[[f64; K]],
) {
    for (out, b) in out.iter_mut().zip(b) {
        multiply_vector_add(out, a, b);
    }
}

/// `out = a b`, as [`multiply_add`]. Cost: `2 R K C` flops.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn multiply<const R: usize, const K: usize>(
    out: &mut [[f64; R]],
    a: &[[f64; R]],
    b: &[[f64; K]],
) {
    out.fill([0.0; R]);
    multiply_add(out, a, b);
}

/// The lower triangle of `out += a b` where the product is symmetric, and what of the upper one fills vectors of
/// four rows; the rest of it has no meaning. Cost: `(R + 3) K C` flops. On processors other than x86-64 code is
/// dearer than work: there it is [`multiply_add`].
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn multiply_add_lower<const R: usize, const K: usize>(
    out: &mut [[f64; R]],
    a: &[[f64; R]],
    b: &[[f64; K]],
) {
    if !cfg!(target_arch = "x86_64") {
        return multiply_add(out, a, b);
    }
    for (j, (out, b)) in out.iter_mut().zip(b).enumerate() {
        match j / 4 {
            0 => multiply_vector_add_from::<R, 0>(out, a, b),
            1 => multiply_vector_add_from::<R, 4>(out, a, b),
            2 => multiply_vector_add_from::<R, 8>(out, a, b),
            _ => multiply_vector_add_from::<R, 12>(out, a, b),
        }
    }
}

/// `out += a a^T`: a symmetric update whose halves get the same bits.
/// Cost: `2 R R K` flops.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn add_square<const R: usize, const K: usize>(out: &mut [[f64; R]; R], a: &[[f64; R]; K]) {
    for (j, out) in out.iter_mut().enumerate() {
        let mut sum = *out;
        for a in a {
            axpy(&mut sum, a, a[j]);
        }
        *out = sum;
    }
}

/// `out = a^T`. Cost: `R C` loads and stores.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn transpose<const R: usize, const C: usize>(out: &mut [[f64; C]; R], a: &[[f64; R]; C]) {
    for (i, row) in out.iter_mut().enumerate() {
        for (out, column) in row.iter_mut().zip(a) {
            *out = column[i];
        }
    }
}

/// `out += a x` for one vector, over the columns of `a`. Cost: `2 R K` flops.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn multiply_vector_add<const R: usize>(out: &mut [f64; R], a: &[[f64; R]], x: &[f64]) {
    multiply_vector_add_from::<R, 0>(out, a, x);
}

/// Adds `a x` to `out` from row `FIRST` on; the rows before are left as they were.
#[inline(always)]
fn multiply_vector_add_from<const R: usize, const FIRST: usize>(
    out: &mut [f64; R],
    a: &[[f64; R]],
    x: &[f64],
) {
    // A copy, so that the sums stay in registers.
    let mut sum = *out;
    for (a, factor) in a.iter().zip(x) {
        for i in FIRST..R {
            sum[i] += a[i] * factor;
        }
    }
    *out = sum;
}

/// Copies the lower triangle of `a` over the upper one. Cost: `D^2 / 2` loads and stores.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn mirror_lower<const D: usize>(a: &mut [[f64; D]; D]) {
    for j in 1..D {
        for i in 0..j {
            a[j][i] = a[i][j];
        }
    }
}

/// Solves `X L^T = B` in place: the columns of `b` become `B L^-T`, where the lower triangle of
/// `factor` is `L` and `inverse` holds the inverses of its diagonal. With `B = S^T` that is
/// `(L^-1 S)^T`, all rows side by side. Cost: `R K^2` flops, no division.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub fn solve_lower_transposed<const R: usize, const K: usize>(
    b: &mut [[f64; R]; K],
    factor: &[[f64; K]; K],
    inverse: &[f64; K],
) {
    for j in 0..K {
        let mut column = b[j];
        for k in 0..j {
            axpy(&mut column, &b[k], -factor[k][j]);
        }
        b[j] = column.map(|x| x * inverse[j]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::cholesky_in_place;
    use crate::fixed_cases;
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(fixed_cases())]

        #[test]
        fn kernels_are_the_products_they_say(
            entries in proptest::array::uniform32(-1.0..1.0f64),
        ) {
            let from = |skip: usize| entries.into_iter().cycle().skip(skip);
            let a = SMatrix::<f64, 5, 3>::from_iterator(from(0));
            let b = SMatrix::<f64, 3, 4>::from_iterator(from(7));
            let start = SMatrix::<f64, 5, 4>::from_iterator(from(13));
            let mut out = start;
            multiply_add(&mut out.data.0, &a.data.0, &b.data.0);
            prop_assert!((out - start - a * b).norm() < 1e-14);
            multiply(&mut out.data.0, &a.data.0, &b.data.0);
            prop_assert!((out - a * b).norm() < 1e-14);

            let mut transposed = SMatrix::<f64, 3, 5>::zeros();
            transpose(&mut transposed.data.0, &a.data.0);
            prop_assert_eq!(transposed, a.transpose());

            let mut lower = SMatrix::<f64, 5, 5>::identity();
            multiply_add_lower(&mut lower.data.0, &a.data.0, &transposed.data.0);
            for (i, j) in (0..5).flat_map(|j| (j..5).map(move |i| (i, j))) {
                let expected = f64::from(i == j) + a.row(i).dot(&a.row(j));
                prop_assert!((lower[(i, j)] - expected).abs() < 1e-14);
            }
            // Columns that are not there are not added.
            let mut fewer = start;
            multiply_add(&mut fewer.data.0[..2], &a.data.0[..1], &b.data.0);
            let expected = a.column(0) * b.fixed_view::<1, 2>(0, 0);
            prop_assert!((fewer.fixed_columns::<2>(0) - start.fixed_columns::<2>(0) - expected).norm() < 1e-14);
            prop_assert_eq!(fewer.fixed_columns::<2>(2), start.fixed_columns::<2>(2));

            let mut square = SMatrix::<f64, 5, 5>::identity();
            add_square(&mut square.data.0, &a.data.0);
            prop_assert!((square - (SMatrix::identity() + a * a.transpose())).norm() < 1e-14);
            let mut mirrored = square;
            mirror_lower(&mut mirrored.data.0);
            prop_assert_eq!(mirrored, square);

            let x = b.column(1).into_owned();
            let mut y = a.column(2).into_owned();
            multiply_vector_add(&mut y.data.0[0], &a.data.0, &x.data.0[0]);
            prop_assert!((y - a.column(2) - a * x).norm() < 1e-14);
        }

        #[test]
        fn solves_by_the_transposed_factor(
            entries in proptest::array::uniform32(-1.0..1.0f64),
        ) {
            let m = SMatrix::<f64, 4, 4>::from_iterator(entries);
            let b = SMatrix::<f64, 3, 4>::from_iterator(entries.into_iter().skip(16));
            let mut factor = m * m.transpose() + SMatrix::identity() * 0.1;
            cholesky_in_place(&mut factor).unwrap();
            let inverse = factor.diagonal().map(|pivot| 1.0 / pivot);
            let mut x = b;
            solve_lower_transposed(&mut x.data.0, &factor.data.0, &inverse.data.0[0]);
            let error = x * factor.lower_triangle().transpose() - b;
            prop_assert!(error.norm() < 1e-11);
        }
    }

    /// Lower triangles of sizes beyond each group of four rows, which are computed in part.
    fn lower_is_whole<const D: usize>() {
        let a = SMatrix::<f64, D, 3>::from_fn(|i, j| 1.0 + i as f64 - 0.5 * (i * j) as f64);
        let transposed = a.transpose();
        let start = SMatrix::<f64, D, D>::from_fn(|i, j| (i + 2 * j) as f64);
        let mut lower = start;
        multiply_add_lower(&mut lower.data.0, &a.data.0, &transposed.data.0);
        let expected = start + a * transposed;
        for j in 0..D {
            // Rows above a column's group are left as they were where that saves work.
            let first = if cfg!(target_arch = "x86_64") { (j / 4).min(3) * 4 } else { 0 };
            for i in 0..D {
                let value = if i < first { start[(i, j)] } else { expected[(i, j)] };
                assert_eq!(lower[(i, j)], value, "{i} {j} of {D}");
            }
        }
    }

    #[test]
    fn lower_triangles_are_whole() {
        lower_is_whole::<3>();
        lower_is_whole::<4>();
        lower_is_whole::<9>();
        lower_is_whole::<12>();
        lower_is_whole::<18>();
    }

    #[test]
    fn the_lower_triangle_is_copied() {
        let mut matrix = SMatrix::<f64, 4, 4>::from_fn(|i, j| (10 * i + j) as f64);
        mirror_lower(&mut matrix.data.0);
        let expected = SMatrix::<f64, 4, 4>::from_fn(|i, j| (10 * i.max(j) + i.min(j)) as f64);
        assert_eq!(matrix, expected);
        let mut y = [1.0, 2.0];
        axpy(&mut y, &[3.0, -4.0], 0.5);
        assert_eq!(y, [2.5, 0.0]);
    }
}
