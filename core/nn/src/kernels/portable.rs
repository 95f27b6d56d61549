//! The kernel in plain Rust, which the compiler vectorises where it can.

use super::{Rows, Sums, Vectors};

pub(super) fn products(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
    for (t, sums) in sums.iter_mut().enumerate().take(vectors.count) {
        let (x, _) = vectors.vector(t, columns);
        for (r, sum) in sums.iter_mut().enumerate().take(rows.count) {
            *sum = dot(rows.row(r, columns), x);
        }
    }
}

/// Inner product of signed bytes.
#[inline(always)]
pub(super) fn dot(w: &[u8], x: &[u8]) -> i32 {
    w.iter().zip(x).map(|(w, x)| i32::from(*w as i8) * i32::from(*x as i8)).sum()
}

/// Converts signed bytes to `i16`.
#[cfg(target_arch = "x86_64")]
pub(super) fn widen(bytes: &[u8], operand_i16: &mut [i16]) {
    for (operand_i16, byte) in operand_i16.iter_mut().zip(bytes) {
        *operand_i16 = i16::from(*byte as i8);
    }
}
