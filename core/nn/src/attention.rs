//! Causal attention over the cache.

use super::arithmetic::{exp, maximum, quantise, sum};
use super::element::{Element, Head, Queries};
use super::header::{Dimensions, Precision};
use super::kernels::{BATCH, Kernel};
use super::memory::{Cache, Quantised};
use super::rows::{from, from_mut, rows, rows_mut};

/// The tokens of a batch: `count` of them from `position` on in the sequence, of which those from
/// `first` on are asked about.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    pub position: usize,
    pub count: usize,
    pub first: usize,
}

/// Puts keys and values of a batch into the cache. `qkv`: rows of query, key, value, `stride`
/// apart.
pub(super) fn remember<E: Element>(
    size: &Dimensions,
    qkv: &[f32],
    stride: usize,
    batch: Batch,
    cache: &mut Cache<E>,
) {
    let w = size.width;
    for (t, row) in rows(qkv, stride, 3 * w).take(batch.count).enumerate() {
        let token = batch.position + t;
        let (keys, values) = from(row, w).split_at_checked(w).unwrap_or_default();
        put(size, keys, from_mut(cache.keys, token * cache.width), |head, scale| {
            if let Some(place) = cache.key_scales.get_mut(head * cache.tokens + token) {
                *place = scale;
            }
        });
        put(size, values, from_mut(cache.values, token * cache.width), |head, scale| {
            if let Some(place) = cache.value_scales.get_mut(head * cache.tokens + token) {
                *place = scale;
            }
        });
    }
}

/// Stores a vector head by head, and hands over the scales.
fn put<E: Element>(
    size: &Dimensions,
    x: &[f32],
    place: &mut [E],
    mut scale: impl FnMut(usize, f32),
) {
    let parts = x.chunks(size.head_width.max(1));
    let places = place.chunks_mut(size.head_width.max(1));
    for (head, (x, place)) in parts.zip(places).enumerate() {
        scale(head, E::store(x, place));
    }
}

/// What attention reads and writes besides the cache.
pub(super) struct Work<'s, 'm> {
    /// Queries, rows `stride` apart.
    pub queries: &'s [f32],
    pub stride: usize,
    pub quantised: &'s mut Quantised<'m>,
    /// A row of scores a token, as far apart as the cache has tokens.
    pub scores: &'s mut [f32],
    /// The result, rows `out_stride` apart.
    pub out: &'s mut [f32],
    pub out_stride: usize,
}

/// Softmax attention of the tokens asked about over all up to themselves; results in rows from
/// `batch.first` on. Cost: `4 width` flops and `heads` exponentials a pair of tokens.
pub(super) fn attend<E: Element>(
    kernel: Kernel,
    size: &Dimensions,
    batch: Batch,
    cache: &Cache<E>,
    work: Work,
) {
    let Batch { position, count, first } = batch;
    let asked = count - first.min(count);
    let known = position + count;
    let width = size.head_width;
    let root = 1.0 / libm::sqrtf(width as f32);
    let plain = from(work.queries, first * work.stride);
    let stride = work.quantised.stride;
    let out = from_mut(work.out, first * work.out_stride);
    for head in 0..size.heads {
        let at = head * width;
        let mut scales = [root; BATCH];
        if E::PRECISION == Precision::Int8 {
            let bytes = rows_mut(work.quantised.bytes, stride, width);
            let wide = rows_mut(work.quantised.wide, stride, width);
            let from = rows(from(plain, at), work.stride, width).take(asked);
            for ((x, scale), (bytes, wide)) in from.zip(&mut scales).zip(bytes.zip(wide)) {
                *scale *= quantise(x, bytes);
                kernel.prepare(bytes, wide);
            }
        }
        let (bytes, wide) = (&*work.quantised.bytes, &*work.quantised.wide);
        let (plain, stride) = match E::PRECISION {
            Precision::Int8 => (plain, stride),
            Precision::F32 => (from(plain, at), work.stride),
        };
        let queries = Queries { kernel, plain, bytes, wide, stride, scales, count: asked };
        let part = |data, scales| Head {
            data: from(data, at),
            scales: from(scales, head * cache.tokens).get(..known).unwrap_or_default(),
            stride: cache.width,
            width,
            count: known,
        };
        let keys = part(cache.keys, cache.key_scales);
        let values = part(cache.values, cache.value_scales);
        E::scores(&queries, &keys, work.scores, cache.tokens);
        let shares = rows_mut(work.scores, cache.tokens, known).take(asked);
        let mut sums = [0.0; BATCH];
        for ((t, shares), sum) in shares.enumerate().zip(&mut sums) {
            *sum = softmax(shares, position + first + t + 1, values.scales);
        }
        let out = (from_mut(out, at), work.out_stride);
        let shares = (&*work.scores, cache.tokens);
        match asked {
            1 => weigh::<E, 1>(&values, shares, &sums, out),
            2 => weigh::<E, 2>(&values, shares, &sums, out),
            3 => weigh::<E, 3>(&values, shares, &sums, out),
            4 => weigh::<E, 4>(&values, shares, &sums, out),
            _ => weigh::<E, 5>(&values, shares, &sums, out),
        }
    }
}

/// Turns the first `count` scores into shares times the value's scale, the others to nothing;
/// returns the sum of the shares.
fn softmax(scores: &mut [f32], count: usize, scales: &[f32]) -> f32 {
    let (scores, masked) = scores.split_at_mut(count.min(scores.len()));
    masked.fill(0.0);
    let largest = maximum(scores);
    // Zero, or NaN where a score is not finite: a score of minus infinity must not vanish.
    let sound = sum(scores) * 0.0;
    for score in scores.iter_mut() {
        *score = exp(*score - largest);
    }
    let total = sum(scores) + sound;
    for (score, scale) in scores.iter_mut().zip(scales) {
        *score *= scale;
    }
    total
}

/// Columns that [`weigh`] takes at once: for five tokens, two registers of AVX each.
const COLUMNS: usize = 16;
/// Rows of values that it turns into numbers before it uses them.
const ROWS: usize = 8;

/// Sums of the values by their shares, divided by the sums of the shares; for `T` tokens, so that
/// each value is read once. A masked value adds an exact zero: a token alone has the same bits as in
/// a batch.
fn weigh<E: Element, const T: usize>(
    values: &Head<'_, E>,
    (shares, apart): (&[f32], usize),
    sums: &[f32; BATCH],
    (out, out_stride): (&mut [f32], usize),
) {
    let mut of: [&[f32]; T] = [&[]; T];
    for (of, shares) in of.iter_mut().zip(rows(shares, apart, values.count)) {
        *of = shares;
    }
    let stride = values.stride.max(1);
    let data = values.data.get(..stride * values.count).unwrap_or(values.data);
    let mut at = 0;
    // Bound: columns.
    while at < values.width {
        let mut totals = [[0.0f32; COLUMNS]; T];
        let mut of = of;
        for data in data.chunks(stride * ROWS) {
            // Moved first and turned into numbers in one go, which is the form that becomes vector
            // code.
            let mut moved = [[E::ZERO; COLUMNS]; ROWS];
            for (moved, row) in moved.iter_mut().zip(data.chunks(stride)) {
                take(from(row, at), moved);
            }
            let mut numbers = [[0.0f32; COLUMNS]; ROWS];
            let to = numbers.as_flattened_mut().iter_mut();
            to.zip(moved.as_flattened()).for_each(|(to, value)| *to = value.value());
            let mut shares = [[0.0f32; ROWS]; T];
            for (shares, of) in shares.iter_mut().zip(&mut of) {
                let (here, rest) = of.split_at_checked(ROWS).unwrap_or((of, &[]));
                shares.iter_mut().zip(here).for_each(|(share, of)| *share = *of);
                *of = rest;
            }
            for (j, numbers) in numbers.iter().enumerate() {
                for (total, shares) in totals.iter_mut().zip(&shares) {
                    for (total, number) in total.iter_mut().zip(numbers) {
                        *total += shares[j] * number;
                    }
                }
            }
        }
        let out = rows_mut(from_mut(out, at), out_stride, COLUMNS.min(values.width - at));
        for ((out, total), sum) in out.zip(totals).zip(sums) {
            let inverse = 1.0 / sum;
            for (out, total) in out.iter_mut().zip(total) {
                *out = total * inverse;
            }
        }
        at += COLUMNS;
    }
}

/// The first columns of a row. The last of the last head may have fewer beside them.
#[inline(always)]
fn take<E: Element>(row: &[E], to: &mut [E; COLUMNS]) {
    match row.first_chunk::<COLUMNS>() {
        Some(full) => *to = *full,
        None => to.iter_mut().zip(row).for_each(|(to, value)| *to = *value),
    }
}
