//! NEON, which every AArch64 has.

use super::{BATCH, Rows, Sums, TILE, Vectors, portable};
use core::arch::aarch64::*;

/// Products of bytes in 16 bits, added in pairs to sums of 32: 16 columns a step, each row loaded
/// once for all vectors.
pub(super) fn products(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
    match vectors.count.min(BATCH) {
        0 => {}
        1 => all::<1>(rows, columns, vectors, sums),
        2 => all::<2>(rows, columns, vectors, sums),
        3 => all::<3>(rows, columns, vectors, sums),
        4 => all::<4>(rows, columns, vectors, sums),
        _ => all::<5>(rows, columns, vectors, sums),
    }
}

fn all<const T: usize>(rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
    let mut x: [&[u8]; T] = [&[]; T];
    let mut length = columns;
    for (t, x) in x.iter_mut().enumerate() {
        *x = vectors.vector(t, columns).0;
        length = length.min(x.len());
    }
    for r in 0..rows.count.min(TILE) {
        let row = rows.row(r, columns);
        let found = one_row(row, &x, length.min(row.len()));
        for (sums, found) in sums.iter_mut().zip(found) {
            if let Some(sum) = sums.get_mut(r) {
                *sum = found;
            }
        }
    }
}

/// The first `length` columns, no more than row and vectors have.
#[inline(always)]
fn one_row<const T: usize>(row: &[u8], x: &[&[u8]; T], length: usize) -> [i32; T] {
    let mut found = [0; T];
    let mut at = 0;
    // SAFETY: NEON is part of the architecture. `at + 16` is within row and vectors; loads need no
    // alignment beyond a byte's.
    unsafe {
        let mut parts = [vdupq_n_s32(0); T];
        // Bound: columns.
        while at + 16 <= length {
            let w = vld1q_s8(row.as_ptr().add(at).cast());
            for t in 0..T {
                let x = vld1q_s8(x[t].as_ptr().add(at).cast());
                let low = vmull_s8(vget_low_s8(w), vget_low_s8(x));
                let high = vmull_high_s8(w, x);
                parts[t] = vpadalq_s16(vpadalq_s16(parts[t], low), high);
            }
            at += 16;
        }
        for t in 0..T {
            found[t] = vaddvq_s32(parts[t]);
        }
    }
    let row = row.get(at..length).unwrap_or_default();
    for (found, x) in found.iter_mut().zip(x) {
        *found += portable::dot(row, x.get(at..length).unwrap_or_default());
    }
    found
}
