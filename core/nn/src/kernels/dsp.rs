//! The DSP extension of Armv7E-M: two products of 16 bits an instruction.

use super::{BATCH, Rows, Sums, TILE, Vectors, portable};
use core::arch::asm;

/// Widens a vector to 16 bits, each group of four in the order 0, 2, 1, 3, in which `sxtb16` gives a
/// row's bytes. What is left over stays in order, and is not read.
pub(super) fn widen(bytes: &[u8], operand_i16: &mut [i16]) {
    let (bytes, _) = bytes.as_chunks::<4>();
    let (operand_i16, _) = operand_i16.as_chunks_mut::<4>();
    for (operand_i16, bytes) in operand_i16.iter_mut().zip(bytes) {
        let [a, b, c, d] = bytes.map(|byte| i16::from(byte as i8));
        *operand_i16 = [a, c, b, d];
    }
}

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
    for r in 0..rows.count.min(TILE) {
        let row = rows.row(r, columns);
        for (t, sums) in sums.iter_mut().enumerate().take(T) {
            if let Some(sum) = sums.get_mut(r) {
                let (bytes, operand_i16) = vectors.vector(t, columns);
                *sum = one(row, bytes, operand_i16);
            }
        }
    }
}

#[inline(always)]
fn one(row: &[u8], bytes: &[u8], operand_i16: &[i16]) -> i32 {
    let (fours, row_tail) = row.as_chunks::<4>();
    let (wides, _) = operand_i16.as_chunks::<4>();
    let mut sum = 0;
    for (four, [a, c, b, d]) in fours.iter().zip(wides) {
        let w = u32::from_le_bytes(*four);
        let pair = |low: i16, high: i16| u32::from(low as u16) | u32::from(high as u16) << 16;
        sum = multiply_add(even(w), pair(*a, *c), sum);
        sum = multiply_add(odd(w), pair(*b, *d), sum);
    }
    sum + portable::dot(row_tail, bytes.get(4 * fours.len()..).unwrap_or_default())
}

/// Bytes 0 and 2, each widened to 16 bits.
#[inline(always)]
fn even(w: u32) -> u32 {
    let pair;
    // SAFETY: registers only; Armv7E-M has the instruction.
    unsafe {
        asm!("sxtb16 {}, {}", out(reg) pair, in(reg) w, options(pure, nomem, nostack, preserves_flags))
    };
    pair
}

/// Bytes 1 and 3, each widened to 16 bits.
#[inline(always)]
fn odd(w: u32) -> u32 {
    let pair;
    // SAFETY: registers only; Armv7E-M has the instruction.
    unsafe {
        asm!("sxtb16 {}, {}, ror #8", out(reg) pair, in(reg) w, options(pure, nomem, nostack, preserves_flags))
    };
    pair
}

/// `sum` and the products of the halves. The flag of saturation may be set, which nobody reads.
#[inline(always)]
fn multiply_add(w: u32, x: u32, sum: i32) -> i32 {
    let more;
    // SAFETY: registers and flags only; Armv7E-M has the instruction.
    unsafe {
        asm!("smlad {}, {}, {}, {}", out(reg) more, in(reg) w, in(reg) x, in(reg) sum, options(pure, nomem, nostack))
    };
    more
}
