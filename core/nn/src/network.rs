//! Inference: a model with its memory.

use super::arithmetic::{add_multiple, copy, layer_norm};
use super::attention::Batch;
use super::block::{Place, Step};
use super::decoder::{Sampling, Workbench, decode};
use super::element::Element;
use super::error::NetworkError;
use super::header::{Decoder, Layout};
use super::kernels::Kernel;
use super::memory::{Scratch, Storage};
use super::model::{Floats, Model};
use super::rows::{from, rows_mut};
use core::ops::Range;

/// A model with its KV cache and scratch memory, for any number of rollouts one after the other.
pub struct Network<'m, 'a, M> {
    model: &'m Model<'a>,
    memory: &'m mut M,
    kernel: Kernel,
    steps: Option<u16>,
    seed: u64,
    /// Index of the next node.
    node: usize,
    /// Number of tokens in the KV cache.
    tokens: usize,
}

impl<'m, 'a, M: Storage> Network<'m, 'a, M> {
    /// A network at the beginning of a rollout of seed zero, with the processor's fastest kernel.
    ///
    /// # Errors
    /// [`NetworkError::Memory`] where the memory is too small, [`NetworkError::Precision`] where it is
    /// for another precision.
    pub fn new(model: &'m Model<'a>, memory: &'m mut M) -> Result<Self, NetworkError> {
        if model.header().precision != M::Element::PRECISION {
            return Err(NetworkError::Precision);
        }
        if !memory.fits(model.dimensions()) {
            return Err(NetworkError::Memory);
        }
        let kernel = Kernel::best();
        Ok(Self { model, memory, kernel, steps: None, seed: 0, node: 0, tokens: 0 })
    }

    /// Chooses another kernel: slower, with the same bits.
    pub fn use_kernel(&mut self, kernel: Kernel) {
        self.kernel = kernel;
    }

    /// Sets the Euler steps of a flow decoder, at least one; `None`: as the model file says.
    pub fn set_flow_steps(&mut self, steps: Option<u16>) {
        self.steps = steps;
    }

    /// Euler steps of a flow decoder; zero with a linear one.
    pub fn flow_steps(&self) -> u16 {
        match self.model.header().decoder {
            Decoder::Linear => 0,
            Decoder::Flow { steps } => self.steps.unwrap_or(steps),
        }
    }

    /// The model.
    pub fn model(&self) -> &'m Model<'a> {
        self.model
    }

    /// Index of the next node that it sees, from zero.
    pub fn node(&self) -> usize {
        self.node
    }

    /// Begins a rollout and empties the KV cache. Only a flow decoder uses the seed.
    pub fn begin(&mut self, seed: u64) {
        (self.seed, self.node, self.tokens) = (seed, 0, 0);
    }

    /// Appends the next node and predicts its actions. `features`: the raw inputs of all token types
    /// in the header's order (those of the previous action are ignored at node 0 of a separate
    /// layout); `actions`: as many raw numbers as an action has for each step of
    /// the chunk.
    ///
    /// # Errors
    /// See [`NetworkError`]. After an error other than of length the KV cache is invalid: call
    /// [`Network::begin`].
    pub fn act(&mut self, features: &[f32], actions: &mut [f32]) -> Result<(), NetworkError> {
        self.act_unless(features, actions, &|| false)
    }

    /// [`Network::act`] that stops where `should_stop` returns true; a flow decoder calls it before
    /// each step.
    ///
    /// # Errors
    /// As [`Network::act`]; [`NetworkError::Output`] where it was stopped.
    pub fn act_unless(
        &mut self,
        features: &[f32],
        actions: &mut [f32],
        should_stop: &impl Fn() -> bool,
    ) -> Result<(), NetworkError> {
        if actions.len() != self.model.dimensions().actions {
            return Err(NetworkError::Length);
        }
        let token_types = self.check(features)?;
        self.pass(features, token_types, 1)?;
        let sound = self.predict(actions, should_stop);
        self.node += self.model.dimensions().stride;
        if sound { Ok(()) } else { Err(NetworkError::Output) }
    }

    /// [`Network::act`] with each token in a batch of its own.
    #[cfg(test)]
    pub(super) fn act_one_by_one(
        &mut self,
        features: &[f32],
        actions: &mut [f32],
    ) -> Result<(), NetworkError> {
        for token_type in self.check(features)? {
            self.pass(features, token_type..token_type + 1, 1)?;
        }
        let sound = self.predict(actions, &|| false);
        self.node += self.model.dimensions().stride;
        if sound { Ok(()) } else { Err(NetworkError::Output) }
    }

    /// Appends the next node without a prediction, which costs a block less.
    ///
    /// # Errors
    /// As [`Network::act`].
    pub fn observe(&mut self, features: &[f32]) -> Result<(), NetworkError> {
        let token_types = self.check(features)?;
        self.pass(features, token_types, 0)?;
        self.node += self.model.dimensions().stride;
        Ok(())
    }

    /// Checks the features; returns the token types of the next node.
    fn check(&self, features: &[f32]) -> Result<Range<usize>, NetworkError> {
        let size = self.model.dimensions();
        if features.len() != size.features {
            return Err(NetworkError::Length);
        }
        if self.node >= size.nodes {
            return Err(NetworkError::Nodes);
        }
        let header = self.model.header();
        let first = usize::from(header.layout == Layout::Separate && self.node == 0);
        let ignored =
            header.token_types.iter().take(first).map(|inputs| usize::from(*inputs)).sum();
        if !from(features, ignored).iter().all(|x| x.is_finite()) {
            return Err(NetworkError::Input);
        }
        Ok(first..header.token_types.len())
    }

    /// Forward pass of one batch of tokens; only the last `wanted` are queried in the last block.
    fn pass(
        &mut self,
        features: &[f32],
        token_types: Range<usize>,
        wanted: usize,
    ) -> Result<(), NetworkError> {
        let size = self.model.dimensions();
        let mut batch = Batch { position: self.tokens, count: token_types.len(), first: 0 };
        let (_, mut scratch) = self.memory.parts(0).ok_or(NetworkError::Memory)?;
        embed(self.model, features, token_types, self.node, &mut scratch);
        // Bound: layers.
        for layer in 0..size.layers {
            if layer + 1 == size.layers {
                batch.first = batch.count - wanted.min(batch.count);
            }
            let kernel = self.kernel;
            let at = Place { kernel, block: &self.model.block(layer), size, batch };
            for step in Step::ALL {
                let (cache, scratch) = self.memory.parts(layer).ok_or(NetworkError::Memory)?;
                at.forward(step, cache, scratch);
            }
        }
        self.tokens += batch.count;
        // The last row holds the hidden state of the last token; it moves to the first.
        let (_, scratch) = self.memory.parts(0).ok_or(NetworkError::Memory)?;
        let last = from(scratch.residual, (batch.count.max(1) - 1) * scratch.width);
        let last = last.get(..size.width).unwrap_or_default();
        let hidden_state = scratch.normal.get_mut(..size.width).unwrap_or_default();
        layer_norm(last, &self.model.norm_out, hidden_state);
        Ok(())
    }

    /// Decodes the hidden state that [`Network::pass`] left into raw actions; returns whether they are
    /// finite.
    fn predict(&mut self, actions: &mut [f32], should_stop: &impl Fn() -> bool) -> bool {
        let size = self.model.dimensions();
        let Some((_, mut scratch)) = self.memory.parts(0) else { return false };
        let hidden_state = scratch.normal.get(..size.width).unwrap_or_default();
        let sampling =
            Sampling { seed: self.seed, node: self.node, steps: self.steps, should_stop };
        let work = Workbench {
            kernel: self.kernel,
            size,
            sampling,
            intermediate: &mut *scratch.intermediate,
            stride: 4 * scratch.width,
            quantised: &mut scratch.quantised,
        };
        let prediction = decode(&self.model.head, hidden_state, work);
        let statistics = self.model.action_mean.iter().zip(self.model.action_std).cycle();
        let mut sound = true;
        for ((action, z), (mean, std)) in actions.iter_mut().zip(prediction).zip(statistics) {
            *action = f32::from_le_bytes(*mean) + f32::from_le_bytes(*std) * z;
            sound &= action.is_finite();
        }
        sound
    }
}

/// Embeds the tokens of a node into the residual rows.
fn embed(
    model: &Model,
    features: &[f32],
    token_types: Range<usize>,
    node: usize,
    scratch: &mut Scratch,
) {
    let w = model.dimensions().width;
    let separate = model.header().layout == Layout::Separate;
    let normal = rows_mut(scratch.normal, scratch.width, w);
    let residual = rows_mut(scratch.residual, scratch.width, w);
    let mut places = normal.zip(residual);
    let mut rest = features;
    for (token_type, embedding) in model.embeddings.iter().enumerate().take(token_types.end) {
        let (inputs, others) = rest.split_at_checked(embedding.inputs).unwrap_or_default();
        rest = others;
        if token_type < token_types.start {
            continue;
        }
        let Some((sum, token)) = places.next() else { return };
        copy(sum, embedding.bias);
        let statistics = embedding.mean.iter().zip(embedding.std);
        let rows = embedding.weight.chunks(w.max(1));
        for ((input, (mean, std)), row) in inputs.iter().zip(statistics).zip(rows) {
            let input = (input - f32::from_le_bytes(*mean)) / f32::from_le_bytes(*std);
            add_multiple(sum, input, row);
        }
        // The token of the previous action belongs to the node before.
        let node = if separate && token_type == 0 { node.saturating_sub(1) } else { node };
        let place: Floats = from(model.nodes, node * w);
        add_multiple(sum, 1.0, place);
        layer_norm(sum, &model.norm_in, token);
    }
}
