//! The network and its loss, on any of Burn's backends that differentiates.
//!
//! Latents are matrices `[trajectory * tokens][width]` throughout: a linear layer is one matrix
//! product, and so is the gradient of its weight.

use crate::config::{Decoder, Layout};
use crate::kernels::Kernels;
use crate::params::{Entry, Table};
use crate::random::Random;
use crate::source::Batch;
use burn::prelude::Tensor;
use burn::tensor::{Bool, Int, TensorData};
use rayon::prelude::*;

/// Mean squared errors, of normalised numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// Of actions, or of velocities where they are the flow decoder's.
    pub action: f64,
    /// Of next states.
    pub state: f64,
}

/// The network on a device.
pub struct Network<'a, B: Kernels> {
    table: &'a Table,
    device: B::Device,
    dropout: f64,
    state_loss: f64,
}

/// The parameters on the device, handed out in the table's order.
struct Weights<B: Kernels> {
    all: Vec<Tensor<B, 2>>,
    next: usize,
}

impl<B: Kernels> Weights<B> {
    fn take(&mut self) -> Tensor<B, 2> {
        self.next += 1;
        self.all[self.next - 1].clone()
    }

    fn linear(&mut self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let (weight, bias) = (self.take(), self.take());
        B::dense(x, weight, bias, false)
    }

    fn linear_relu(&mut self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let (weight, bias) = (self.take(), self.take());
        B::dense(x, weight, bias, true)
    }

    fn norm(&mut self, x: Tensor<B, 2>) -> Tensor<B, 2> {
        let (gain, bias) = (self.take(), self.take());
        B::standardise(x, gain, bias)
    }
}

impl<'a, B: Kernels> Network<'a, B> {
    /// A network of the table's sizes.
    pub fn new(table: &'a Table, device: B::Device, dropout: f64, state_loss: f64) -> Self {
        Self { table, device, dropout, state_loss }
    }

    /// Losses of a batch without gradients and dropout.
    pub fn losses(&self, parameters: &[f32], batch: &Batch) -> Losses {
        let weights = self.weights(parameters, false);
        let [action, state] = self.forward(weights, batch, false);
        Losses { action: scalar(action), state: scalar(state) }
    }

    /// Losses of a batch; adds the gradient of action loss + `state_loss` * state loss, times
    /// `factor`.
    pub fn gradient(
        &self,
        parameters: &[f32],
        batch: &Batch,
        factor: f32,
        gradient: &mut [f32],
    ) -> Losses {
        let weights = self.weights(parameters, true);
        let all = weights.all.clone();
        let [action, state] = self.forward(weights, batch, true);
        let total = match self.state_loss {
            0.0 => action.clone(),
            weight => action.clone() + state.clone() * weight,
        };
        let gradients = total.backward();
        // Read only now: a GPU works on while the host has not asked it for a number.
        let losses = Losses { action: scalar(action), state: scalar(state) };
        let (entries, found): (Vec<&Entry>, Vec<_>) = self
            .table
            .entries
            .iter()
            .zip(all)
            .filter_map(|(entry, tensor)| Some((entry, tensor.grad(&gradients)?)))
            .map(|(entry, found)| (entry, found.reshape([entry.len()])))
            .unzip();
        // All in one piece: a read of each tensor would wait for a GPU as often.
        let found = Tensor::cat(found, 0).into_data();
        let Ok(mut values) = found.as_slice::<f32>() else { return losses };
        for entry in entries {
            let (own, rest) = values.split_at(entry.len());
            for (sum, value) in gradient[entry.range()].iter_mut().zip(own) {
                *sum += factor * value;
            }
            values = rest;
        }
        losses
    }

    fn weights(&self, parameters: &[f32], track: bool) -> Weights<B> {
        let tensor = |entry: &Entry| {
            let tensor = self.tensor(&parameters[entry.range()], entry.columns);
            if track { tensor.require_grad() } else { tensor }
        };
        Weights { all: self.table.entries.iter().map(tensor).collect(), next: 0 }
    }

    fn tensor(&self, values: &[f32], columns: usize) -> Tensor<B, 2> {
        let data = TensorData::new(values.to_vec(), [values.len() / columns, columns]);
        Tensor::from_data(data, &self.device)
    }

    /// Computes the decoder's outputs, `[rows][outputs]`, normalised.
    pub fn answers(&self, parameters: &[f32], batch: &Batch) -> Vec<f32> {
        let (answer, _) = self.answer(&mut self.weights(parameters, false), batch, false);
        answer.into_data().iter::<f32>().collect()
    }

    /// Action loss and state loss.
    fn forward(&self, mut weights: Weights<B>, batch: &Batch, train: bool) -> [Tensor<B, 1>; 2] {
        let (answer, after) = self.answer(&mut weights, batch, train);
        let target = self.tensor(&batch.target, self.table.outputs);
        let weight = self.tensor(&batch.weight, self.table.outputs);
        let error = answer - target;
        let action = (error.clone() * error * weight).sum();
        if self.state_loss == 0.0 {
            return [action, Tensor::zeros([1], &self.device)];
        }
        let error = weights.linear(after) - self.next_states(batch);
        [action, (error.clone() * error).mean()]
    }

    /// The decoder's answers, and the latents that next states are read from.
    fn answer(
        &self,
        weights: &mut Weights<B>,
        batch: &Batch,
        train: bool,
    ) -> (Tensor<B, 2>, Tensor<B, 2>) {
        let mut masks = Masks::new(if train { self.dropout } else { 0.0 }, batch.dropout_seed);
        let x = self.embed(weights, batch);
        let mut x = masks.apply(weights.norm(x), &self.device);
        for _ in 0..self.table.layers {
            x = self.block(weights, x, batch.size, &mut masks);
        }
        let x = weights.norm(x);
        let (latent, after) = self.read(x, batch.size);
        (self.decode(weights, latent, batch), after)
    }

    /// Tokens with the nodes' embedding added, `[trajectory * tokens][width]`.
    fn embed(&self, weights: &mut Weights<B>, batch: &Batch) -> Tensor<B, 2> {
        let (seen, width) = (self.table.seen(), self.table.width);
        let tokens: Vec<Tensor<B, 3>> = batch
            .token_types
            .iter()
            .zip(&self.table.token_types)
            .map(|(values, inputs)| weights.linear(self.tensor(values, *inputs)).unsqueeze_dim(1))
            .collect();
        let nodes = weights.take();
        let (x, index) = match self.table.layout {
            Layout::Fused | Layout::Chunked => {
                let [x] = tokens.try_into().unwrap_or_else(|_| unreachable!("one kind"));
                let index = (0..seen).map(|token| (token * self.table.stride) as i32);
                (x.reshape([batch.size, seen, width]), index.collect())
            }
            Layout::Separate => {
                let token_types = tokens.len();
                let x = Tensor::cat(tokens, 1).reshape([batch.size, token_types * seen, width]);
                // Nothing was done before the first node. Later, what was done carries the index
                // of the node where it was.
                let index: Vec<i32> = (1..token_types * seen)
                    .map(|token| (token / token_types) as i32 - i32::from(token % token_types == 0))
                    .collect();
                (x.narrow(1, 1, token_types * seen - 1), index)
            }
        };
        let tokens = index.len();
        let index = Tensor::<B, 1, Int>::from_data(TensorData::new(index, [tokens]), &self.device);
        (x + nodes.select(0, index).unsqueeze_dim(0)).reshape([batch.size * tokens, width])
    }

    fn block(
        &self,
        weights: &mut Weights<B>,
        x: Tensor<B, 2>,
        size: usize,
        masks: &mut Masks,
    ) -> Tensor<B, 2> {
        let y = weights.norm(x.clone());
        let y = B::attend(weights.linear(y), size, self.table.heads);
        let x = x + masks.apply(weights.linear(y), &self.device);
        let y = weights.norm(x.clone());
        let y = weights.linear_relu(y);
        x + masks.apply(weights.linear(y), &self.device)
    }

    /// The latents that actions are read from, and those that next states are.
    fn read(&self, x: Tensor<B, 2>, size: usize) -> (Tensor<B, 2>, Tensor<B, 2>) {
        if self.table.layout != Layout::Separate {
            return (x.clone(), x);
        }
        let wanted = self.state_loss != 0.0;
        let token_types = self.table.token_types.len();
        let seen = self.table.seen();
        let tokens = token_types * seen - 1;
        let rows = |first: usize, count: usize| {
            let rows: Vec<i32> = (0..size)
                .flat_map(|i| {
                    (0..count).map(move |k| (i * tokens + first + token_types * k) as i32)
                })
                .collect();
            let data = TensorData::new(rows, [size * count]);
            x.clone().select(0, Tensor::<B, 1, Int>::from_data(data, &self.device))
        };
        (rows(token_types - 2, seen), rows(token_types - 1, if wanted { seen - 1 } else { 1 }))
    }

    /// Next states, normalised, for the latents that [`read`](Self::read) finds.
    fn next_states(&self, batch: &Batch) -> Tensor<B, 2> {
        let row = self.table.seen() * self.table.states;
        // The last action has no token.
        let kept = match self.table.layout {
            Layout::Fused | Layout::Chunked => row,
            Layout::Separate => row - self.table.states,
        };
        let values: Vec<f32> =
            batch.states.chunks_exact(row).flat_map(|states| &states[..kept]).copied().collect();
        self.tensor(&values, self.table.states)
    }

    fn decode(
        &self,
        weights: &mut Weights<B>,
        latent: Tensor<B, 2>,
        batch: &Batch,
    ) -> Tensor<B, 2> {
        match self.table.decoder {
            Decoder::Linear => weights.linear(latent),
            Decoder::Flow => {
                let question = self.tensor(&batch.question, self.table.outputs + 1);
                let x = weights.linear_relu(Tensor::cat(vec![question, latent], 1));
                let x = weights.linear_relu(x);
                weights.linear(x)
            }
        }
    }
}

fn scalar<B: Kernels>(tensor: Tensor<B, 1>) -> f64 {
    tensor.into_data().iter::<f64>().next().unwrap_or(f64::NAN)
}

/// Dropout, of streams of its own so that a resumed training drops the same: one for each mask and
/// each [`PART`](Masks::PART) of it, so that threads can share a mask.
struct Masks {
    probability: f64,
    seed: u64,
    made: u64,
}

impl Masks {
    /// Numbers of a stream.
    const PART: usize = 1 << 16;

    fn new(probability: f64, seed: u64) -> Self {
        Self { probability, seed, made: 0 }
    }

    /// Draws which of so many numbers are dropped.
    fn dropped(&mut self, count: usize) -> Vec<bool> {
        let mut dropped = vec![false; count];
        let first = self.made << 32;
        self.made += 1;
        let threshold = (self.probability * 65536.0) as u64;
        dropped.par_chunks_mut(Self::PART).enumerate().for_each(|(part, dropped)| {
            let stream = Random::new(self.seed, Random::DROPOUT, first + part as u64);
            drop_below(threshold, stream, dropped);
        });
        dropped
    }

    fn apply<B: Kernels>(&mut self, x: Tensor<B, 2>, device: &B::Device) -> Tensor<B, 2> {
        if self.probability == 0.0 {
            return x;
        }
        let [rows, columns] = x.dims();
        // A byte a number, where a factor would take four to a device.
        let data = TensorData::new(self.dropped(rows * columns), [rows, columns]);
        let dropped = Tensor::<B, 2, Bool>::from_data(data, device);
        x.mask_fill(dropped, 0.0) * (1.0 / (1.0 - self.probability))
    }
}

/// Four numbers of 16 bits a step of an xorshift generator: masks are large.
fn drop_below(threshold: u64, mut stream: Random, dropped: &mut [bool]) {
    let mut state = stream.bits() | 1;
    for four in dropped.chunks_mut(4) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let bits = state.wrapping_mul(0x2545_f491_4f6c_dd1d);
        for (part, dropped) in four.iter_mut().enumerate() {
            *dropped = (bits >> (16 * part)) & 0xffff < threshold;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_drop_their_share_each_its_own_and_the_same_again() {
        let count = 3 * Masks::PART + 17;
        let mut masks = Masks::new(0.1, 5);
        let (first, second) = (masks.dropped(count), masks.dropped(count));
        assert_eq!(first, Masks::new(0.1, 5).dropped(count));
        let share = |chosen: &dyn Fn(usize) -> bool| {
            (0..count).filter(|i| chosen(*i)).count() as f64 / count as f64
        };
        assert!((share(&|i| first[i]) - 0.1).abs() < 0.005);
        // Independent masks, and independent parts of a mask, drop one per cent together.
        assert!((share(&|i| first[i] && second[i]) - 0.01).abs() < 0.002);
        let shifted = |i| first[i] && first[(i + Masks::PART) % count];
        assert!((share(&shifted) - 0.01).abs() < 0.002);
    }
}
