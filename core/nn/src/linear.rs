//! Linear maps of a batch of vectors, in either precision.

use super::arithmetic::{dot, quantise};
use super::kernels::{BATCH, Kernel, Rows, Sums, TILE, Vectors};
use super::memory::Quantised;
use super::model::{Floats, Linear, Weights};
use super::rows::{from_mut, rows, rows_mut};

/// Vectors to read, rows `stride` apart.
#[derive(Clone, Copy)]
pub(super) struct Input<'s> {
    pub data: &'s [f32],
    pub stride: usize,
    pub count: usize,
}

/// Where the results go, rows `stride` apart.
pub(super) struct Output<'s> {
    pub data: &'s mut [f32],
    pub stride: usize,
}

/// `y = W x + b` for every vector. Cost: a multiplication and an addition a weight and vector; each
/// weight is read once.
pub(super) fn apply(kernel: Kernel, map: &Linear, x: Input, y: Output, quantised: &mut Quantised) {
    match map.weights {
        Weights::Int8(weights, scales) => int8(kernel, map, weights, scales, x, y, quantised),
        Weights::F32(weights) => float(map, weights, x, y),
    }
}

fn float(map: &Linear, weights: Floats, x: Input, y: Output) {
    let weights = weights.chunks(map.columns.max(1));
    for (r, (weights, bias)) in weights.zip(map.bias).enumerate() {
        let x = rows(x.data, x.stride, map.columns).take(x.count);
        for (x, y) in x.zip(y.data.chunks_mut(y.stride.max(1))) {
            if let Some(y) = y.get_mut(r) {
                *y = dot(weights, x) + f32::from_le_bytes(*bias);
            }
        }
    }
}

fn int8(
    kernel: Kernel,
    map: &Linear,
    weights: &[u8],
    scales: Floats,
    x: Input,
    y: Output,
    quantised: &mut Quantised,
) {
    let columns = map.columns;
    let mut x_scales = [0.0; BATCH];
    let bytes = rows_mut(quantised.bytes, quantised.stride, columns);
    let wide = rows_mut(quantised.wide, quantised.stride, columns);
    let to = bytes.zip(wide).zip(&mut x_scales);
    for (x, ((bytes, wide), scale)) in rows(x.data, x.stride, columns).take(x.count).zip(to) {
        *scale = quantise(x, bytes);
        kernel.prepare(bytes, wide);
    }
    let vectors = Vectors {
        bytes: quantised.bytes,
        wide: quantised.wide,
        stride: quantised.stride,
        count: x.count,
    };

    let mut sums: Sums = [[0; TILE]; BATCH];
    let tiles = weights.chunks((TILE * columns).max(1));
    let tiles = tiles.zip(scales.chunks(TILE)).zip(map.bias.chunks(TILE));
    for (tile, ((weights, scales), bias)) in tiles.enumerate() {
        let matrix = Rows { bytes: weights, stride: columns, count: scales.len() };
        kernel.products(matrix, columns, vectors, &mut sums);
        let y = y.data.chunks_mut(y.stride.max(1)).take(x.count);
        for ((y, sums), x_scale) in y.zip(&sums).zip(x_scales) {
            let y = from_mut(y, tile * TILE);
            for ((y, sum), (scale, bias)) in y.iter_mut().zip(sums).zip(scales.iter().zip(bias)) {
                let scale = x_scale * f32::from_le_bytes(*scale);
                *y = *sum as f32 * scale + f32::from_le_bytes(*bias);
            }
        }
    }
}
