//! Layer norm, row by row.

use super::lanes::sum;
use crate::kernels::NORM_EPSILON;

/// Gradients of a layer norm.
pub struct Gradients {
    /// Of its input.
    pub x: Vec<f32>,
    /// Of its gain.
    pub gain: Vec<f32>,
    /// Of its bias.
    pub bias: Vec<f32>,
}

/// The normalised rows, and of each row mean and reciprocal deviation.
pub fn forward(x: &[f32], gain: &[f32], bias: &[f32]) -> (Vec<f32>, Vec<[f32; 2]>) {
    let columns = gain.len();
    let mut y = vec![0.0; x.len()];
    let mut moments = Vec::with_capacity(x.len() / columns);
    for (x, y) in x.chunks_exact(columns).zip(y.chunks_exact_mut(columns)) {
        let mean = sum(columns, |i| x[i]) / columns as f32;
        let variance = sum(columns, |i| (x[i] - mean) * (x[i] - mean)) / columns as f32;
        let factor = 1.0 / (variance + NORM_EPSILON).sqrt();
        moments.push([mean, factor]);
        for ((x, y), (gain, bias)) in x.iter().zip(y).zip(gain.iter().zip(bias)) {
            *y = (x - mean) * factor * gain + bias;
        }
    }
    (y, moments)
}

/// The way back, given the gradient of the normalised rows.
pub fn backward(x: &[f32], gain: &[f32], moments: &[[f32; 2]], gradient: &[f32]) -> Gradients {
    let columns = gain.len();
    let mut out =
        Gradients { x: vec![0.0; x.len()], gain: vec![0.0; columns], bias: vec![0.0; columns] };
    let mut unit = vec![0.0; columns];
    let mut wanted = vec![0.0; columns];
    let rows = x.chunks_exact(columns).zip(gradient.chunks_exact(columns));
    for (((x, g), dx), [mean, factor]) in rows.zip(out.x.chunks_exact_mut(columns)).zip(moments) {
        for i in 0..columns {
            unit[i] = (x[i] - mean) * factor;
            wanted[i] = g[i] * gain[i];
            out.gain[i] += g[i] * unit[i];
            out.bias[i] += g[i];
        }
        let one = sum(columns, |i| wanted[i]) / columns as f32;
        let two = sum(columns, |i| wanted[i] * unit[i]) / columns as f32;
        for i in 0..columns {
            dx[i] = factor * (wanted[i] - one - unit[i] * two);
        }
    }
    out
}
