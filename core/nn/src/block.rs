//! One transformer block, in steps: the memory is handed over anew for each, so that what lives between
//! them can be reached.

use super::arithmetic::{layer_norm, relu};
use super::attention::{Batch, Work, append_to_cache, attend};
use super::element::Element;
use super::header::Dimensions;
use super::kernels::Kernel;
use super::linear::{Input, Output, apply};
use super::memory::{Cache, Scratch};
use super::model::{Block, Norm};
use super::rows::{from, from_mut, rows, rows_mut};

/// A step of a block: keys and values of all tokens, the rest for the queried ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Writes keys and values to the cache and computes queries; needs the residual stream.
    Project,
    /// Computes attention; needs cache and queries.
    Attend,
    /// Adds attention to the residual stream, then computes the wide layer; needs attention.
    Widen,
    /// Adds the wide layer to the residual stream; needs the wide layer.
    Narrow,
}

impl Step {
    /// All of them, in order.
    pub const ALL: [Self; 4] = [Self::Project, Self::Attend, Self::Widen, Self::Narrow];
}

/// A block at work on a batch of tokens.
pub(super) struct Place<'a> {
    pub kernel: Kernel,
    pub block: &'a Block<'a>,
    pub size: &'a Dimensions,
    pub batch: Batch,
}

impl Place<'_> {
    /// One step.
    pub fn forward<E: Element>(&self, step: Step, cache: Cache<E>, scratch: Scratch) {
        match step {
            Step::Project => self.project(cache, scratch),
            _ if self.queried() == 0 => {}
            Step::Attend => self.attend(cache, scratch),
            Step::Widen => self.widen(scratch),
            Step::Narrow => self.narrow(scratch),
        }
    }

    /// Number of tokens that are queried.
    fn queried(&self) -> usize {
        self.batch.count - self.batch.first.min(self.batch.count)
    }

    fn project<E: Element>(&self, mut cache: Cache<E>, mut scratch: Scratch) {
        let Self { kernel, block, size, batch } = *self;
        let (w, width, stride) = (size.width, scratch.width, 4 * scratch.width);
        let (Batch { count, first, .. }, quantised) = (batch, &mut scratch.quantised);
        let x = Input { data: scratch.residual, stride: width, count };
        normalise(x, &block.norm1, Output { data: scratch.normal, stride: width }, w);
        let (query, key_value) = block.qkv.split(w);
        let x = Input { data: scratch.normal, stride: width, count };
        let y = Output { data: from_mut(scratch.intermediate, w), stride };
        apply(kernel, &key_value, x, y, quantised);
        append_to_cache(size, scratch.intermediate, stride, batch, &mut cache);
        if self.queried() == 0 {
            return;
        }
        let data = from(scratch.normal, first * width);
        let x = Input { data, stride: width, count: self.queried() };
        let y = Output { data: from_mut(scratch.intermediate, first * stride), stride };
        apply(kernel, &query, x, y, quantised);
    }

    fn attend<E: Element>(&self, cache: Cache<E>, mut scratch: Scratch) {
        let work = Work {
            queries: scratch.intermediate,
            stride: 4 * scratch.width,
            quantised: &mut scratch.quantised,
            scores: scratch.scores,
            out: scratch.normal,
            out_stride: scratch.width,
        };
        attend(self.kernel, self.size, self.batch, &cache, work);
    }

    fn widen(&self, mut scratch: Scratch) {
        let Self { kernel, block, size, batch } = *self;
        let (w, width, stride) = (size.width, scratch.width, 4 * scratch.width);
        let (queried, quantised) = (self.queried(), &mut scratch.quantised);
        let residual = from_mut(scratch.residual, batch.first * width);
        let normal = from_mut(scratch.normal, batch.first * width);
        let x = Input { data: normal, stride: width, count: queried };
        apply(kernel, &block.out, x, Output { data: scratch.intermediate, stride }, quantised);
        let y = Input { data: scratch.intermediate, stride, count: queried };
        add(Output { data: residual, stride: width }, y, w);

        let x = Input { data: residual, stride: width, count: queried };
        normalise(x, &block.norm2, Output { data: normal, stride: width }, w);
        let x = Input { data: normal, stride: width, count: queried };
        apply(kernel, &block.up, x, Output { data: scratch.intermediate, stride }, quantised);
        rows_mut(scratch.intermediate, stride, 4 * w).take(queried).for_each(relu);
    }

    fn narrow(&self, mut scratch: Scratch) {
        let (width, stride, first) = (scratch.width, 4 * scratch.width, self.batch.first);
        let (queried, quantised) = (self.queried(), &mut scratch.quantised);
        let residual = from_mut(scratch.residual, first * width);
        let normal = from_mut(scratch.normal, first * width);
        let x = Input { data: scratch.intermediate, stride, count: queried };
        let y = Output { data: normal, stride: width };
        apply(self.kernel, &self.block.down, x, y, quantised);
        let y = Input { data: normal, stride: width, count: queried };
        add(Output { data: residual, stride: width }, y, self.size.width);
    }
}

/// Layer norm of the first `w` numbers of every row.
fn normalise(x: Input, norm: &Norm, y: Output, w: usize) {
    let to = rows_mut(y.data, y.stride, w);
    for (x, y) in rows(x.data, x.stride, w).zip(to).take(x.count) {
        layer_norm(x, norm, y);
    }
}

/// `x += y`, the first `w` numbers of every row of `y`.
fn add(x: Output, y: Input, w: usize) {
    for (x, y) in rows_mut(x.data, x.stride, w).zip(rows(y.data, y.stride, w)).take(y.count) {
        x.iter_mut().zip(y).for_each(|(x, y)| *x += y);
    }
}
