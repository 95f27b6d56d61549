//! The three operations that the network is made of: composed of Burn's own for any backend, and
//! replaced where a backend has better.

use burn::prelude::Tensor;
use burn::tensor::backend::AutodiffBackend;
use burn::tensor::{TensorData, activation};

/// Added to the variance of a layer norm.
pub const NORM_EPSILON: f32 = 1e-5;

/// A backend that differentiates, with the network's operations.
pub trait Kernels: AutodiffBackend {
    /// `x W^T + b`, and its positive part if so wished: `x` is `[rows][inputs]`, `weight`
    /// `[outputs][inputs]`, `bias` `[1][outputs]`.
    fn dense(
        x: Tensor<Self, 2>,
        weight: Tensor<Self, 2>,
        bias: Tensor<Self, 2>,
        relu: bool,
    ) -> Tensor<Self, 2> {
        composed::dense(x, weight, bias, relu)
    }

    /// Each row with mean zero and variance one, times `gain` plus `bias`, both `[1][columns]`.
    fn standardise(
        x: Tensor<Self, 2>,
        gain: Tensor<Self, 2>,
        bias: Tensor<Self, 2>,
    ) -> Tensor<Self, 2> {
        composed::standardise(x, gain, bias)
    }

    /// Causal attention within each of `size` sequences: `[size * tokens][3 * width]`, a row the
    /// query, key and value of all heads, to `[size * tokens][width]`.
    fn attend(qkv: Tensor<Self, 2>, size: usize, heads: usize) -> Tensor<Self, 2> {
        composed::attend(qkv, size, heads)
    }
}

/// The operations of Burn's own.
pub mod composed {
    use super::*;
    use burn::tensor::backend::Backend;

    /// See [`Kernels::dense`].
    pub fn dense<B: Backend>(
        x: Tensor<B, 2>,
        weight: Tensor<B, 2>,
        bias: Tensor<B, 2>,
        relu: bool,
    ) -> Tensor<B, 2> {
        let y = x.matmul(weight.transpose()) + bias;
        if relu { activation::relu(y) } else { y }
    }

    /// See [`Kernels::standardise`].
    pub fn standardise<B: Backend>(
        x: Tensor<B, 2>,
        gain: Tensor<B, 2>,
        bias: Tensor<B, 2>,
    ) -> Tensor<B, 2> {
        let mean = x.clone().mean_dim(1);
        let x = x - mean;
        let variance = (x.clone() * x.clone()).mean_dim(1);
        x / (variance + NORM_EPSILON).sqrt() * gain + bias
    }

    /// See [`Kernels::attend`].
    pub fn attend<B: Backend>(qkv: Tensor<B, 2>, size: usize, heads: usize) -> Tensor<B, 2> {
        let [rows, columns] = qkv.dims();
        let (tokens, width) = (rows / size, columns / 3);
        let head = width / heads;
        let device = qkv.device();
        let qkv = qkv.reshape([size, tokens, 3, heads, head]).permute([2, 0, 3, 1, 4]);
        let part = |i: usize| -> Tensor<B, 4> {
            qkv.clone().narrow(0, i, 1).reshape([size, heads, tokens, head])
        };
        let scores = part(0).matmul(part(1).transpose()) / (head as f32).sqrt();
        let ahead: Vec<f32> = (0..tokens * tokens)
            .map(|i| if i % tokens > i / tokens { -1e9 } else { 0.0 })
            .collect();
        let ahead = TensorData::new(ahead, [1, 1, tokens, tokens]);
        let scores = scores + Tensor::<B, 4>::from_data(ahead, &device);
        let y = activation::softmax(scores, 3).matmul(part(2));
        y.swap_dims(1, 2).reshape([rows, width])
    }
}
