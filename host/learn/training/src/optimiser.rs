//! AdamW as PyTorch defines it, and the clipping of the gradient's norm over all parameters.

use crate::params::Table;
use rayon::prelude::*;

const BETA: [f64; 2] = [0.9, 0.999];
const EPSILON: f64 = 1e-8;
/// Numbers that a thread takes at once.
const PART: usize = 1 << 16;

/// The optimiser's memory.
#[derive(Clone, Debug, PartialEq)]
pub struct AdamW {
    /// Running mean of the gradient.
    pub first: Vec<f32>,
    /// Running mean of its square.
    pub second: Vec<f32>,
    /// Steps done.
    pub step: u64,
}

impl AdamW {
    /// For so many parameters.
    pub fn new(count: usize) -> Self {
        Self { first: vec![0.0; count], second: vec![0.0; count], step: 0 }
    }

    /// One step along `gradient`.
    pub fn update(
        &mut self,
        table: &Table,
        parameters: &mut [f32],
        gradient: &[f32],
        rate: f64,
        weight_decay: f64,
    ) {
        self.step += 1;
        let bias = BETA.map(|beta| 1.0 - beta.powf(self.step as f64));
        let rate_now = (rate / bias[0]) as f32;
        let root = (1.0 / bias[1].sqrt()) as f32;
        let [one, two] = BETA.map(|beta| beta as f32);
        let (first, second) = (&mut self.first[..], &mut self.second[..]);
        let mut rest = (parameters, first, second);
        let parts: Vec<_> = table
            .entries
            .iter()
            .map(|entry| {
                let (x, m, v) = std::mem::take(&mut rest);
                let (x, m, v) = (
                    x.split_at_mut(entry.len()),
                    m.split_at_mut(entry.len()),
                    v.split_at_mut(entry.len()),
                );
                rest = (x.1, m.1, v.1);
                (entry, x.0, m.0, v.0)
            })
            .collect();
        parts.into_par_iter().for_each(|(entry, parameters, first, second)| {
            let decay = if entry.decays { (1.0 - rate * weight_decay) as f32 } else { 1.0 };
            let values = parameters.iter_mut().zip(&gradient[entry.range()]);
            for ((x, g), (m, v)) in values.zip(first.iter_mut().zip(second)) {
                *m = one * *m + (1.0 - one) * g;
                *v = two * *v + (1.0 - two) * g * g;
                *x = *x * decay - rate_now * *m / (v.sqrt() * root + EPSILON as f32);
            }
        });
    }
}

/// Shortens the gradient to `limit`, all parameters together; returns the norm that it had.
pub fn clip(gradient: &mut [f32], limit: f64) -> f64 {
    let square = |part: &[f32]| part.iter().map(|g| f64::from(*g) * f64::from(*g)).sum::<f64>();
    // The sums of parts of one size are added in order, so that threads do not change the bits.
    let squares: Vec<f64> = gradient.par_chunks(PART).map(square).collect();
    let norm = squares.iter().sum::<f64>().sqrt();
    if norm > limit {
        let factor = (limit / norm) as f32;
        gradient.par_iter_mut().with_min_len(PART).for_each(|g| *g *= factor);
    }
    norm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_norm_is_that_of_all_parameters() {
        let mut gradient = vec![3.0, 4.0, 0.0, 12.0];
        assert_eq!(clip(&mut gradient, 20.0), 13.0);
        assert_eq!(gradient[3], 12.0);
        assert_eq!(clip(&mut gradient, 1.3), 13.0);
        assert!((gradient[3] - 1.2).abs() < 1e-6);
    }
}
