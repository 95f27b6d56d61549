//! A model at work.

use super::arithmetic::{add_multiple, copy, layer_norm, relu};
use super::attention::{Batch, Work, attend, remember};
use super::decoder::{Draw, decode};
use super::element::Element;
use super::error::NetworkError;
use super::header::{Decoder, Dimensions, Layout};
use super::kernels::Kernel;
use super::linear::{Input, Output, apply};
use super::memory::{Cache, Scratch, Storage};
use super::model::{Block, Floats, Model};
use super::rows::{from, from_mut, rows, rows_mut};
use core::ops::Range;

/// A model with the memory it works in. Made once, used for any number of roll-outs.
pub struct Network<'m, 'a, M> {
    model: &'m Model<'a>,
    memory: &'m mut M,
    kernel: Kernel,
    steps: Option<u16>,
    seed: u64,
    /// The next node.
    node: usize,
    /// Tokens in the cache.
    tokens: usize,
}

impl<'m, 'a, M: Storage> Network<'m, 'a, M> {
    /// Sets a model to work, with the fastest kernel of the processor, at the beginning of a
    /// roll-out of seed zero.
    ///
    /// # Errors
    /// [`NetworkError::Memory`] and [`NetworkError::Precision`], where the memory is not for this
    /// model.
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

    /// Uses another kernel from now on: slower, with the same bits.
    pub fn use_kernel(&mut self, kernel: Kernel) {
        self.kernel = kernel;
    }

    /// Euler steps of a flow decoder from now on, at least one; `None`: as the model file says.
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

    /// The node that comes next.
    pub fn node(&self) -> usize {
        self.node
    }

    /// Begins a roll-out. The seed matters to a flow decoder alone.
    pub fn begin(&mut self, seed: u64) {
        (self.seed, self.node, self.tokens) = (seed, 0, 0);
    }

    /// Takes in the next node and predicts its actions. `features`: the inputs of all kinds, raw,
    /// in the header's order (of a separate layout's node 0 the previous action's are not looked
    /// at); `actions`: [`ACTION`] numbers a step of the chunk, raw.
    ///
    /// # Errors
    /// See [`NetworkError`]. After an error other than of length begin anew: nothing is to be made
    /// of the cache.
    pub fn act(&mut self, features: &[f32], actions: &mut [f32]) -> Result<(), NetworkError> {
        self.act_unless(features, actions, &|| false)
    }

    /// [`Network::act`] that gives up where `should_stop` says so, which it is asked before each
    /// step of a flow decoder.
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
        let kinds = self.check(features)?;
        self.pass(features, kinds, 1)?;
        let sound = self.predict(actions, should_stop);
        self.node += 1;
        if sound { Ok(()) } else { Err(NetworkError::Output) }
    }

    /// [`Network::act`] with each token a batch of its own.
    #[cfg(test)]
    pub(super) fn act_one_by_one(
        &mut self,
        features: &[f32],
        actions: &mut [f32],
    ) -> Result<(), NetworkError> {
        for kind in self.check(features)? {
            self.pass(features, kind..kind + 1, 1)?;
        }
        let sound = self.predict(actions, &|| false);
        self.node += 1;
        if sound { Ok(()) } else { Err(NetworkError::Output) }
    }

    /// Takes in the next node without predicting anything, which costs a block less.
    ///
    /// # Errors
    /// As [`Network::act`].
    pub fn observe(&mut self, features: &[f32]) -> Result<(), NetworkError> {
        let kinds = self.check(features)?;
        self.pass(features, kinds, 0)?;
        self.node += 1;
        Ok(())
    }

    /// The kinds of token that the next node has, its features being in order.
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
        let ignored = header.kinds.iter().take(first).map(|inputs| usize::from(*inputs)).sum();
        if !from(features, ignored).iter().all(|x| x.is_finite()) {
            return Err(NetworkError::Input);
        }
        Ok(first..header.kinds.len())
    }

    /// One batch of tokens through all blocks, of which only the last `wanted` are asked about in
    /// the end.
    fn pass(
        &mut self,
        features: &[f32],
        kinds: Range<usize>,
        wanted: usize,
    ) -> Result<(), NetworkError> {
        let size = self.model.dimensions();
        let mut batch = Batch { position: self.tokens, count: kinds.len(), first: 0 };
        let (_, mut scratch) = self.memory.parts(0).ok_or(NetworkError::Memory)?;
        embed(self.model, features, kinds, self.node, &mut scratch);
        // Bound: layers.
        for layer in 0..size.layers {
            if layer + 1 == size.layers {
                batch.first = batch.count - wanted.min(batch.count);
            }
            let block = self.model.block(layer);
            let (cache, scratch) = self.memory.parts(layer).ok_or(NetworkError::Memory)?;
            forward(self.kernel, &block, size, batch, cache, scratch);
        }
        self.tokens += batch.count;
        // The latent asked about is the last row's, which moves to the first.
        let (_, scratch) = self.memory.parts(0).ok_or(NetworkError::Memory)?;
        let last = from(scratch.residual, (batch.count.max(1) - 1) * scratch.width);
        let last = last.get(..size.width).unwrap_or_default();
        let latent = scratch.normal.get_mut(..size.width).unwrap_or_default();
        layer_norm(last, &self.model.norm_out, latent);
        Ok(())
    }

    /// Raw actions from the latent that [`Network::pass`] left; whether they are finite.
    fn predict(&mut self, actions: &mut [f32], should_stop: &impl Fn() -> bool) -> bool {
        let size = self.model.dimensions();
        let Some((_, mut scratch)) = self.memory.parts(0) else { return false };
        let latent = scratch.normal.get(..size.width).unwrap_or_default();
        let draw = Draw { seed: self.seed, node: self.node, steps: self.steps, should_stop };
        let hidden = (&mut *scratch.hidden, 4 * scratch.width);
        let head = &self.model.head;
        let quantised = &mut scratch.quantised;
        let prediction = decode(self.kernel, head, size, latent, draw, hidden, quantised);
        let statistics = self.model.action_mean.iter().zip(self.model.action_std).cycle();
        let mut sound = true;
        for ((action, z), (mean, std)) in actions.iter_mut().zip(prediction).zip(statistics) {
            *action = f32::from_le_bytes(*mean) + f32::from_le_bytes(*std) * z;
            sound &= action.is_finite();
        }
        sound
    }
}

/// The tokens of a node into the residual rows.
fn embed(model: &Model, features: &[f32], kinds: Range<usize>, node: usize, scratch: &mut Scratch) {
    let w = model.dimensions().width;
    let separate = model.header().layout == Layout::Separate;
    let normal = rows_mut(scratch.normal, scratch.width, w);
    let residual = rows_mut(scratch.residual, scratch.width, w);
    let mut places = normal.zip(residual);
    let mut rest = features;
    for (kind, embedding) in model.embeddings.iter().enumerate().take(kinds.end) {
        let (inputs, others) = rest.split_at_checked(embedding.inputs).unwrap_or_default();
        rest = others;
        if kind < kinds.start {
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
        // The previous action belongs to the node before.
        let node = if separate && kind == 0 { node.saturating_sub(1) } else { node };
        let place: Floats = from(model.nodes, node * w);
        add_multiple(sum, 1.0, place);
        layer_norm(sum, &model.norm_in, token);
    }
}

/// One block: keys and values of all tokens, the rest for those asked about.
fn forward<E: Element>(
    kernel: Kernel,
    block: &Block,
    size: &Dimensions,
    batch: Batch,
    mut cache: Cache<E>,
    mut scratch: Scratch,
) {
    let (w, width, stride) = (size.width, scratch.width, 4 * scratch.width);
    let Batch { count, first, .. } = batch;
    let asked = count - first.min(count);
    let quantised = &mut scratch.quantised;

    normalise(scratch.residual, &block.norm1, scratch.normal, (w, width), count);
    let (query, key_value) = block.qkv.split(w);
    let x = Input { data: scratch.normal, stride: width, count };
    let y = Output { data: from_mut(scratch.hidden, w), stride };
    apply(kernel, &key_value, x, y, quantised);
    remember(size, scratch.hidden, stride, batch, &mut cache);
    if asked == 0 {
        return;
    }
    let x = Input { data: from(scratch.normal, first * width), stride: width, count: asked };
    let y = Output { data: from_mut(scratch.hidden, first * stride), stride };
    apply(kernel, &query, x, y, quantised);
    let work = Work {
        queries: scratch.hidden,
        stride,
        quantised,
        scores: scratch.scores,
        out: scratch.normal,
        out_stride: width,
    };
    attend(kernel, size, batch, &cache, work);

    let residual = from_mut(scratch.residual, first * width);
    let normal = from_mut(scratch.normal, first * width);
    let x = Input { data: normal, stride: width, count: asked };
    apply(kernel, &block.out, x, Output { data: scratch.hidden, stride }, quantised);
    add(residual, (w, width), scratch.hidden, stride, asked);

    normalise(residual, &block.norm2, normal, (w, width), asked);
    let x = Input { data: normal, stride: width, count: asked };
    apply(kernel, &block.up, x, Output { data: scratch.hidden, stride }, quantised);
    rows_mut(scratch.hidden, stride, 4 * w).take(asked).for_each(relu);
    let x = Input { data: scratch.hidden, stride, count: asked };
    apply(kernel, &block.down, x, Output { data: normal, stride: width }, quantised);
    add(residual, (w, width), normal, width, asked);
}

/// Layer norm of the first `count` rows.
fn normalise(
    x: &[f32],
    norm: &super::model::Norm,
    y: &mut [f32],
    (w, stride): (usize, usize),
    count: usize,
) {
    for (x, y) in rows(x, stride, w).zip(rows_mut(y, stride, w)).take(count) {
        layer_norm(x, norm, y);
    }
}

/// `x += y`, the first `count` rows.
fn add(x: &mut [f32], (w, stride): (usize, usize), y: &[f32], y_stride: usize, count: usize) {
    for (x, y) in rows_mut(x, stride, w).zip(rows(y, y_stride, w)).take(count) {
        x.iter_mut().zip(y).for_each(|(x, y)| *x += y);
    }
}
