//! Random numbers without a state to keep: each use has a stream of its own, a function of seed,
//! purpose and index, so that a resumed training draws what the uninterrupted one would have drawn.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random {
    stream: ChaCha8Rng,
    spare: Option<f64>,
}

impl Random {
    /// Purpose: initial parameters.
    pub const START: u64 = 1;
    /// Purpose: the order of trajectories in an epoch.
    pub const ORDER: u64 = 2;
    /// Purpose: noise and flow times of a batch, and the seed of its dropout.
    pub const BATCH: u64 = 3;
    /// Purpose: the same of a validation.
    pub const VALIDATION: u64 = 4;
    /// Purpose: statistics.
    pub const STATISTICS: u64 = 5;
    /// Purpose: synthetic trajectories.
    pub const SYNTHETIC: u64 = 6;
    /// Purpose: dropout masks, seeded by their batch.
    pub const DROPOUT: u64 = 7;

    /// The stream of a purpose and an index.
    pub fn new(seed: u64, purpose: u64, index: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&purpose.to_le_bytes());
        let mut stream = ChaCha8Rng::from_seed(key);
        stream.set_stream(index);
        Self { stream, spare: None }
    }

    /// The stream itself.
    pub fn stream(&mut self) -> &mut ChaCha8Rng {
        &mut self.stream
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.stream.next_u64()
    }

    /// Uniform in `[0, 1)`.
    pub fn uniform(&mut self) -> f64 {
        uniform(&mut self.stream)
    }

    /// Uniform in `0..count`; the bias of the remainder is far below any count used here.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }

    /// Standard normal, by Marsaglia's polar method.
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let square = x * x + y * y;
            if square < 1.0 && square > 0.0 {
                let factor = (-2.0 * square.ln() / square).sqrt();
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }

    /// `0..count` in random order.
    pub fn order(&mut self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for i in (1..count).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// Uniform in `[0, 1)`, from 53 bits.
pub fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A standard normal number by Box and Muller: models on record have learnt from examples with these.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (a, b) = (1.0 - uniform(random), uniform(random));
    (-2.0 * f64::ln(a)).sqrt() * (std::f64::consts::TAU * b).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_unit_variance() {
        let mut random = Random::new(1, 2, 3);
        let n = 20_000;
        let numbers: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / f64::from(n);
        let square = numbers.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        assert!(mean.abs() < 0.03 && (square - 1.0).abs() < 0.04, "{mean} {square}");
    }

    #[test]
    fn an_order_has_every_index_once() {
        let mut order = Random::new(1, Random::ORDER, 0).order(1000);
        assert!(order.windows(2).any(|w| w[0] > w[1]));
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(i, x)| i as u32 == *x));
    }
}
