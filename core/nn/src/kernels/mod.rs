//! Products of signed bytes with the same bits on every processor: integer sums are exact in any order
//! and width.
//!
//! The one operation is a matrix of weights times a batch of up to five vectors, a node's tokens; each
//! weight is read once for all of them. The keys of the KV cache are such a matrix too.
//!
//! | kernel | where | instruction | operands |
//! | --- | --- | --- | --- |
//! | portable | everywhere | the compiler's choice | bytes |
//! | AVX2 | x86-64, asked at run time | `vpmaddwd` after widening | bytes, vectors as `i16` |
//! | AVX-512-VNNI | x86-64, asked at run time | `vpdpbusd` of 256 bits | bytes, rows offset by 128 |
//! | AVX-VNNI | x86-64, asked at run time | the same | the same |
//! | NEON | AArch64 | `smull`, `sadalp` | bytes |
//! | DSP | Armv7E-M | `sxtb16`, `smlad` | bytes, vectors as `i16` |
//!
//! The only module of the crate with unsafe code: vector loads, optional instructions, assembly. Each
//! use states why it is sound.
#![allow(unsafe_code)]

mod portable;

#[cfg(remora_dsp)]
mod dsp;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "x86_64")]
mod x86;

use super::header::limit;

/// Most vectors of a batch.
pub(super) const BATCH: usize = limit::TOKEN_TYPES;
/// Most rows of a matrix in one call: the built-in networks' width, so that little is left of what a call costs.
pub const TILE: usize = 96;

/// Inner products of each vector with each row.
pub(super) type Sums = [[i32; TILE]; BATCH];

/// Rows of signed bytes, `stride` apart.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub bytes: &'a [u8],
    pub stride: usize,
    pub count: usize,
}

impl<'a> Rows<'a> {
    /// The first `columns` bytes of a row, fewer where it is shorter.
    fn row(&self, row: usize, columns: usize) -> &'a [u8] {
        let bytes = self.bytes.get(row * self.stride..).unwrap_or_default();
        bytes.get(..columns).unwrap_or(bytes)
    }
}

/// A batch of vectors of signed bytes, `stride` apart, and their `i16` operands as [`Kernel::prepare`]
/// wrote them.
#[derive(Clone, Copy)]
pub(super) struct Vectors<'a> {
    pub bytes: &'a [u8],
    pub operand_i16: &'a [i16],
    pub stride: usize,
    pub count: usize,
}

impl<'a> Vectors<'a> {
    fn vector(&self, vector: usize, columns: usize) -> (&'a [u8], &'a [i16]) {
        let at = vector * self.stride;
        let bytes = self.bytes.get(at..).unwrap_or_default();
        let operand_i16 = self.operand_i16.get(at..).unwrap_or_default();
        (bytes.get(..columns).unwrap_or(bytes), operand_i16.get(..columns).unwrap_or(operand_i16))
    }
}

/// A matrix kernel that this processor supports: only [`Kernel::available`] and [`Kernel::best`] make
/// one other than the portable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(Choice);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Choice {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512Vnni,
    #[cfg(target_arch = "x86_64")]
    AvxVnni,
    #[cfg(target_arch = "aarch64")]
    Neon,
    #[cfg(remora_dsp)]
    Dsp,
}

impl Kernel {
    /// The kernel of every processor.
    pub const fn portable() -> Self {
        Self(Choice::Portable)
    }

    /// The fastest kernel of this processor.
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::portable())
    }

    /// All kernels of this processor, the fastest last.
    pub fn available() -> impl Iterator<Item = Self> {
        let all = [
            Some(Choice::Portable),
            #[cfg(target_arch = "x86_64")]
            x86::features().avx2.then_some(Choice::Avx2),
            #[cfg(target_arch = "x86_64")]
            x86::features().avx512_vnni.then_some(Choice::Avx512Vnni),
            #[cfg(target_arch = "x86_64")]
            x86::features().avx_vnni.then_some(Choice::AvxVnni),
            #[cfg(target_arch = "aarch64")]
            Some(Choice::Neon),
            #[cfg(remora_dsp)]
            Some(Choice::Dsp),
        ];
        all.into_iter().flatten().map(Self)
    }

    /// Its name, in lower case.
    pub const fn name(self) -> &'static str {
        match self.0 {
            Choice::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Choice::Avx512Vnni => "avx512-vnni",
            #[cfg(target_arch = "x86_64")]
            Choice::AvxVnni => "avx-vnni",
            #[cfg(target_arch = "aarch64")]
            Choice::Neon => "neon",
            #[cfg(remora_dsp)]
            Choice::Dsp => "dsp",
        }
    }

    /// Converts a vector's bytes to the `i16` operand, for kernels that read that. The vector must be as
    /// long as the product for which it is used.
    pub(super) fn prepare(self, bytes: &[u8], operand_i16: &mut [i16]) {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Choice::Avx2 => portable::widen(bytes, operand_i16),
            #[cfg(remora_dsp)]
            Choice::Dsp => dsp::widen(bytes, operand_i16),
            _ => {}
        }
        let _ = (bytes, operand_i16);
    }

    /// The inner products of up to [`TILE`] rows of `columns` bytes with up to [`BATCH`] vectors.
    /// Exact while they are below 2^31, as they are up to 131,071 columns. Cost: one multiplication
    /// and one addition a column, row and vector.
    pub(super) fn products(self, rows: Rows, columns: usize, vectors: Vectors, sums: &mut Sums) {
        match self.0 {
            Choice::Portable => portable::products(rows, columns, vectors, sums),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `features` found the instructions, or there would be no such kernel.
            Choice::Avx2 => unsafe { x86::avx2(rows, columns, vectors, sums) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: likewise.
            Choice::Avx512Vnni => unsafe { x86::avx512_vnni(rows, columns, vectors, sums) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: likewise.
            Choice::AvxVnni => unsafe { x86::avx_vnni(rows, columns, vectors, sums) },
            #[cfg(target_arch = "aarch64")]
            Choice::Neon => neon::products(rows, columns, vectors, sums),
            #[cfg(remora_dsp)]
            Choice::Dsp => dsp::products(rows, columns, vectors, sums),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LONGEST: usize = 150;
    const GAP: usize = 3;

    /// All kernels of the machine against sums written down plainly, on any bytes.
    fn check(rows: usize, columns: usize, vectors: usize, bytes: &[u8]) {
        let stride = columns + GAP;
        let (matrix, rest) = bytes.split_at(TILE * (LONGEST + GAP));
        for kernel in Kernel::available() {
            let mut operand_i16 = [0; BATCH * (LONGEST + GAP)];
            for t in 0..vectors {
                let at = t * stride..t * stride + columns;
                kernel.prepare(&rest[at.clone()], &mut operand_i16[at]);
            }
            let mut sums = [[77; TILE]; BATCH];
            let operand =
                Vectors { bytes: rest, operand_i16: &operand_i16, stride, count: vectors };
            kernel.products(
                Rows { bytes: matrix, stride, count: rows },
                columns,
                operand,
                &mut sums,
            );
            for (t, sums) in sums.iter().enumerate().take(vectors) {
                for (r, sum) in sums.iter().enumerate().take(rows) {
                    let exact: i32 = (0..columns)
                        .map(|i| {
                            let (w, x) = (matrix[r * stride + i] as i8, rest[t * stride + i] as i8);
                            i32::from(w) * i32::from(x)
                        })
                        .sum();
                    assert_eq!(*sum, exact, "{} row {r} vector {t}", kernel.name());
                }
            }
        }
    }

    const BYTES: usize = (TILE + BATCH) * (LONGEST + GAP);

    proptest! {
        // Verifies REM-LRN-004.
        #[test]
        fn every_kernel_is_exact(
            rows in 0..=TILE, columns in 0..=LONGEST, vectors in 0..=BATCH,
            bytes in proptest::collection::vec(any::<u8>(), BYTES),
        ) {
            check(rows, columns, vectors, &bytes);
        }
    }

    #[test]
    fn extremes_do_not_overflow() {
        for byte in [0x80, 0x7f, 0x81, 0xff] {
            for columns in [0, 1, 15, 16, 31, 32, 33, 64, LONGEST] {
                check(TILE, columns, BATCH, &[byte; BYTES]);
            }
        }
    }

    /// Kernels read nothing beyond the slices, whatever the sizes say.
    #[test]
    fn too_little_is_no_crime() {
        for kernel in Kernel::available() {
            for length in 0..70 {
                let (bytes, operand_i16) = ([1; 70], [1; 70]);
                let mut sums = [[0; TILE]; BATCH];
                let rows = Rows { bytes: &bytes[..length], stride: 40, count: 9 };
                let (bytes, operand_i16) = (&bytes[..length], &operand_i16[..length / 2]);
                let vectors = Vectors { bytes, operand_i16, stride: 20, count: 9 };
                kernel.products(rows, 40, vectors, &mut sums);
            }
        }
    }
}
