//! Linear maps of a batch of vectors, in `i8` or `f32`.

use super::arithmetic::{dot, quantise};
use super::kernels::{BATCH, Kernel, Rows, Sums, TILE, Vectors};
use super::memory::Quantised;
use super::model::{Floats, Linear, Weights};
use super::rows::{from_mut, rows, rows_mut};

/// `count` vectors to read, rows `stride` apart.
#[derive(Clone, Copy)]
pub(super) struct Input<'s> {
    pub data: &'s [f32],
    pub stride: usize,
    pub count: usize,
}

/// Vectors to write, rows `stride` apart.
pub(super) struct Output<'s> {
    pub data: &'s mut [f32],
    pub stride: usize,
}

/// `y = W x + b` for every vector. Cost: one multiplication and one addition for each weight and
/// vector; each weight is read once.
pub(super) fn apply(kernel: Kernel, map: &Linear, x: Input, y: Output, quantised: &mut Quantised) {
    match map.weights {
        Weights::Int8(weights, scales) => {
            Int8 { kernel, weights, scales, bias: map.bias, columns: map.columns }
                .apply(x, y, quantised);
        }
        Weights::F32(weights) => float(map, weights, x, y),
    }
}

/// The map in `f32`.
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

/// A map with `i8` weights, one scale a row.
struct Int8<'a> {
    kernel: Kernel,
    weights: &'a [u8],
    scales: Floats<'a>,
    bias: Floats<'a>,
    columns: usize,
}

impl Int8<'_> {
    fn apply(&self, x: Input, y: Output, quantised: &mut Quantised) {
        let Self { kernel, weights, scales, bias, columns } = *self;
        let mut x_scales = [0.0; BATCH];
        let bytes = rows_mut(quantised.bytes, quantised.stride, columns);
        let operand_i16 = rows_mut(quantised.operand_i16, quantised.stride, columns);
        let to = bytes.zip(operand_i16).zip(&mut x_scales);
        for (x, ((bytes, operand_i16), scale)) in
            rows(x.data, x.stride, columns).take(x.count).zip(to)
        {
            *scale = quantise(x, bytes);
            kernel.prepare(bytes, operand_i16);
        }
        let vectors = Vectors {
            bytes: quantised.bytes,
            operand_i16: quantised.operand_i16,
            stride: quantised.stride,
            count: x.count,
        };

        let mut sums: Sums = [[0; TILE]; BATCH];
        let tiles = weights.chunks((TILE * columns).max(1));
        let tiles = tiles.zip(scales.chunks(TILE)).zip(bias.chunks(TILE));
        for (tile, ((weights, scales), bias)) in tiles.enumerate() {
            let matrix = Rows { bytes: weights, stride: columns, count: scales.len() };
            kernel.products(matrix, columns, vectors, &mut sums);
            let y = y.data.chunks_mut(y.stride.max(1)).take(x.count);
            for ((y, sums), x_scale) in y.zip(&sums).zip(x_scales) {
                let y = from_mut(y, tile * TILE);
                for ((y, sum), (scale, bias)) in y.iter_mut().zip(sums).zip(scales.iter().zip(bias))
                {
                    let scale = x_scale * f32::from_le_bytes(*scale);
                    *y = *sum as f32 * scale + f32::from_le_bytes(*bias);
                }
            }
        }
    }
}
