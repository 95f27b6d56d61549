//! Causal attention over the KV cache.

use super::arithmetic::{exp, maximum, quantise, sum};
use super::element::{Element, Head, Queries};
use super::header::{Dimensions, Precision};
use super::kernels::{BATCH, Kernel};
use super::linear::{Input, Output};
use super::memory::{Cache, Quantised};
use super::rows::{from, from_mut, rows, rows_mut};

/// A batch of `count` consecutive tokens, the first at `position` of the sequence; those from
/// `first` on are queried.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    pub position: usize,
    pub count: usize,
    pub first: usize,
}

/// Appends keys and values of a batch to the KV cache. `qkv`: rows of query, key, value, `stride`
/// apart.
pub(super) fn append_to_cache<E: Element>(
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

/// Stores a vector head by head and passes each head's scale to `scale`.
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

/// Input, scratch and output of attention, besides the KV cache.
pub(super) struct Work<'s, 'm> {
    /// Queries, rows `stride` apart.
    pub queries: &'s [f32],
    pub stride: usize,
    pub quantised: &'s mut Quantised<'m>,
    /// One row of scores for each queried token; the stride is the cache's number of tokens.
    pub scores: &'s mut [f32],
    /// The attention's result, rows `out_stride` apart.
    pub out: &'s mut [f32],
    pub out_stride: usize,
}

/// Softmax attention of the queried tokens over all tokens up to themselves; results in rows from
/// `batch.first` on. Cost: `4 width` flops and `heads` exponentials for each pair of tokens.
pub(super) fn attend<E: Element>(
    kernel: Kernel,
    size: &Dimensions,
    batch: Batch,
    cache: &Cache<E>,
    work: Work,
) {
    let Batch { position, count, first } = batch;
    let queried = count - first.min(count);
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
            let operand_i16 = rows_mut(work.quantised.operand_i16, stride, width);
            let from = rows(from(plain, at), work.stride, width).take(queried);
            for ((x, scale), (bytes, operand_i16)) in
                from.zip(&mut scales).zip(bytes.zip(operand_i16))
            {
                *scale *= quantise(x, bytes);
                kernel.prepare(bytes, operand_i16);
            }
        }
        let (bytes, operand_i16) = (&*work.quantised.bytes, &*work.quantised.operand_i16);
        let (plain, stride) = match E::PRECISION {
            Precision::Int8 => (plain, stride),
            Precision::F32 => (from(plain, at), work.stride),
        };
        let queries = Queries { kernel, plain, bytes, operand_i16, stride, scales, count: queried };
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
        let weights = rows_mut(work.scores, cache.tokens, known).take(queried);
        let mut sums = [0.0; BATCH];
        for ((t, weights), sum) in weights.enumerate().zip(&mut sums) {
            *sum = softmax(weights, position + first + t + 1, values.scales);
        }
        let out = Output { data: from_mut(out, at), stride: work.out_stride };
        let weights = Input { data: work.scores, stride: cache.tokens, count: queried };
        av_product_of(queried, &values, weights, &sums, out);
    }
}

/// [`av_product`] for as many queried tokens.
#[inline(always)]
fn av_product_of<E: Element>(
    queried: usize,
    values: &Head<'_, E>,
    weights: Input,
    sums: &[f32; BATCH],
    out: Output,
) {
    match queried {
        1 => av_product::<E, 1>(values, weights, sums, out),
        2 => av_product::<E, 2>(values, weights, sums, out),
        3 => av_product::<E, 3>(values, weights, sums, out),
        4 => av_product::<E, 4>(values, weights, sums, out),
        _ => av_product::<E, 5>(values, weights, sums, out),
    }
}

/// Turns the first `count` scores into unnormalised attention weights times the values' scales and
/// the masked others into zero; returns the sum of the weights.
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

/// Columns that [`av_product`] computes at once: two AVX registers for each of five tokens.
const COLUMNS: usize = 16;
/// Rows of values that [`av_product`] dequantises at once.
const ROWS: usize = 8;

/// The product of attention weights and values for `T` tokens, divided by the sums of the weights;
/// each value is read once. A masked value adds an exact zero, so that a token alone gets the same
/// bits as in a batch.
fn av_product<E: Element, const T: usize>(
    values: &Head<'_, E>,
    weights: Input,
    sums: &[f32; BATCH],
    out: Output,
) {
    let mut of: [&[f32]; T] = [&[]; T];
    for (of, weights) in of.iter_mut().zip(rows(weights.data, weights.stride, values.count)) {
        *of = weights;
    }
    let stride = values.stride.max(1);
    let data = values.data.get(..stride * values.count).unwrap_or(values.data);
    let mut at = 0;
    // Bound: columns.
    while at < values.width {
        let mut totals = [[0.0f32; COLUMNS]; T];
        let mut of = of;
        for data in data.chunks(stride * ROWS) {
            // Copied first and dequantised in one loop, which the compiler vectorises.
            let mut moved = [[E::ZERO; COLUMNS]; ROWS];
            for (moved, row) in moved.iter_mut().zip(data.chunks(stride)) {
                take(from(row, at), moved);
            }
            let mut numbers = [[0.0f32; COLUMNS]; ROWS];
            let to = numbers.as_flattened_mut().iter_mut();
            to.zip(moved.as_flattened()).for_each(|(to, value)| *to = value.value());
            let mut weights = [[0.0f32; ROWS]; T];
            for (weights, of) in weights.iter_mut().zip(&mut of) {
                let (here, rest) = of.split_at_checked(ROWS).unwrap_or((of, &[]));
                weights.iter_mut().zip(here).for_each(|(share, of)| *share = *of);
                *of = rest;
            }
            for (j, numbers) in numbers.iter().enumerate() {
                for (total, weights) in totals.iter_mut().zip(&weights) {
                    for (total, number) in total.iter_mut().zip(numbers) {
                        *total += weights[j] * number;
                    }
                }
            }
        }
        let out =
            rows_mut(from_mut(&mut *out.data, at), out.stride, COLUMNS.min(values.width - at));
        for ((out, total), sum) in out.zip(totals).zip(sums) {
            let inverse = 1.0 / sum;
            for (out, total) in out.iter_mut().zip(total) {
                *out = total * inverse;
            }
        }
        at += COLUMNS;
    }
}

/// Copies the first columns of a row; the last head's may be fewer.
#[inline(always)]
fn take<E: Element>(row: &[E], to: &mut [E; COLUMNS]) {
    match row.first_chunk::<COLUMNS>() {
        Some(full) => *to = *full,
        None => to.iter_mut().zip(row).for_each(|(to, value)| *to = *value),
    }
}
