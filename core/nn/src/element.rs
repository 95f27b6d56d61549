//! Number types of the KV cache, and attention scores with them.

use super::arithmetic::{dot_plain, quantise};
use super::header::Precision;
use super::kernels::{BATCH, Kernel, Rows, Sums, TILE, Vectors};
use super::rows::{from, from_mut, rows};

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for f32 {}
}

/// Number type of the KV cache: the bits of signed bytes with a scale, or `f32`.
pub trait Element: Copy + sealed::Sealed + 'static {
    /// Zero.
    const ZERO: Self;
    /// Precision of the models with this cache.
    const PRECISION: Precision;

    /// The number with bit `bit` flipped, modulo its size.
    #[doc(hidden)]
    fn flipped(self, bit: u32) -> Self;

    /// Stores a vector; returns its scale.
    #[doc(hidden)]
    fn store(x: &[f32], place: &mut [Self]) -> f32;

    /// The number without its scale.
    #[doc(hidden)]
    fn value(self) -> f32;

    #[doc(hidden)]
    fn scores(queries: &Queries, head: &Head<'_, Self>, scores: &mut [f32], stride: usize);
}

/// Queries of a batch, in `f32` and quantised; rows `stride` apart.
#[doc(hidden)]
pub struct Queries<'s> {
    pub(super) kernel: Kernel,
    pub(super) plain: &'s [f32],
    pub(super) bytes: &'s [u8],
    pub(super) operand_i16: &'s [i16],
    pub(super) stride: usize,
    /// Factors of the scores, besides the keys' scales.
    pub(super) scales: [f32; BATCH],
    pub(super) count: usize,
}

/// One head's part of the cached keys or values: `count` rows `stride` apart, the first `width`
/// numbers of each, and one scale a row.
#[doc(hidden)]
pub struct Head<'s, E> {
    pub(super) data: &'s [E],
    pub(super) scales: &'s [f32],
    pub(super) stride: usize,
    pub(super) width: usize,
    pub(super) count: usize,
}

impl Element for u8 {
    const ZERO: Self = 0;
    const PRECISION: Precision = Precision::Int8;

    fn flipped(self, bit: u32) -> Self {
        self ^ (1 << (bit % Self::BITS))
    }

    fn store(x: &[f32], place: &mut [Self]) -> f32 {
        quantise(x, place)
    }

    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self as i8)
    }

    fn scores(queries: &Queries, head: &Head<'_, u8>, scores: &mut [f32], stride: usize) {
        let Queries { bytes, operand_i16, stride: apart, count, .. } = *queries;
        let vectors = Vectors { bytes, operand_i16, stride: apart, count };
        let mut sums: Sums = [[0; TILE]; BATCH];
        let mut first = 0;
        for scales in head.scales.chunks(TILE) {
            let bytes = from(head.data, first * head.stride);
            let keys = Rows { bytes, stride: head.stride, count: scales.len() };
            queries.kernel.products(keys, head.width, vectors, &mut sums);
            let to = scores.chunks_mut(stride.max(1)).take(count);
            for ((scores, sums), scale) in to.zip(&sums).zip(queries.scales) {
                let scores = from_mut(scores, first);
                for ((score, sum), key) in scores.iter_mut().zip(sums).zip(scales) {
                    *score = *sum as f32 * (scale * key);
                }
            }
            first += TILE;
        }
    }
}

impl Element for f32 {
    const ZERO: Self = 0.0;
    const PRECISION: Precision = Precision::F32;

    fn flipped(self, bit: u32) -> Self {
        Self::from_bits(self.to_bits() ^ (1 << (bit % u32::BITS)))
    }

    fn store(x: &[f32], place: &mut [Self]) -> f32 {
        place.iter_mut().zip(x).for_each(|(place, x)| *place = *x);
        1.0
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self
    }

    fn scores(queries: &Queries, head: &Head<'_, f32>, scores: &mut [f32], stride: usize) {
        let from = rows(queries.plain, queries.stride, head.width).take(queries.count);
        let to = scores.chunks_mut(stride.max(1));
        for ((query, scores), scale) in from.zip(to).zip(queries.scales) {
            let keys = rows(head.data, head.stride, head.width).take(head.count);
            for (score, key) in scores.iter_mut().zip(keys) {
                *score = dot_plain(query, key) * scale;
            }
        }
    }
}
