//! The memory that a network works in: keys and values of the tokens so far, and scratch.

use super::element::Element;
use super::header::{Dimensions, limit};
use super::kernels::BATCH;

/// Keys and values of one block. A scale belongs to a vector's part for one head; scales of one
/// head lie side by side.
struct Layer<const WIDTH: usize, const TOKENS: usize, E> {
    keys: [[E; WIDTH]; TOKENS],
    values: [[E; WIDTH]; TOKENS],
    key_scales: [[f32; TOKENS]; limit::HEADS],
    value_scales: [[f32; TOKENS]; limit::HEADS],
}

/// What one node's tokens need while they pass through the network.
struct Buffers<const WIDTH: usize, const TOKENS: usize> {
    residual: [[f32; WIDTH]; BATCH],
    normal: [[f32; WIDTH]; BATCH],
    hidden: [[[f32; WIDTH]; 4]; BATCH],
    bytes: [[[u8; WIDTH]; 4]; BATCH],
    wide: [[[i16; WIDTH]; 4]; BATCH],
    scores: [[f32; TOKENS]; BATCH],
}

/// Memory for networks of up to so many blocks, width and tokens (five a node and one less, or one
/// a node). The cache holds signed bytes (`E = u8`, their bits); with `E = f32` it is
/// [`ReferenceMemory`].
///
/// Bytes: `LAYERS TOKENS (2 WIDTH + 64)` for the cache, `180 WIDTH + 20 TOKENS` of scratch.
pub struct Memory<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E = u8> {
    layers: [Layer<WIDTH, TOKENS, E>; LAYERS],
    buffers: Buffers<WIDTH, TOKENS>,
}

/// Memory for networks in single precision, to which the quantised ones are held.
pub type ReferenceMemory<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize> =
    Memory<LAYERS, WIDTH, TOKENS, f32>;

impl<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E: Element>
    Memory<LAYERS, WIDTH, TOKENS, E>
{
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// The cache's share of it; the rest is scratch.
    pub const CACHE_BYTES: usize = size_of::<[Layer<WIDTH, TOKENS, E>; LAYERS]>();

    /// Storage for any number of roll-outs, one after the other, all bits zero. Place it in static
    /// memory or on a heap: it is too large for a small stack.
    pub const fn new() -> Self {
        const {
            Self {
                layers: [const {
                    Layer {
                        keys: [[E::ZERO; WIDTH]; TOKENS],
                        values: [[E::ZERO; WIDTH]; TOKENS],
                        key_scales: [[0.0; TOKENS]; limit::HEADS],
                        value_scales: [[0.0; TOKENS]; limit::HEADS],
                    }
                }; LAYERS],
                buffers: Buffers {
                    residual: [[0.0; WIDTH]; BATCH],
                    normal: [[0.0; WIDTH]; BATCH],
                    hidden: [[[0.0; WIDTH]; 4]; BATCH],
                    bytes: [[[0; WIDTH]; 4]; BATCH],
                    wide: [[[0; WIDTH]; 4]; BATCH],
                    scores: [[0.0; TOKENS]; BATCH],
                },
            }
        }
    }
}

impl<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E: Element> Default
    for Memory<LAYERS, WIDTH, TOKENS, E>
{
    fn default() -> Self {
        Self::new()
    }
}

/// The cache of one block as slices: a row a token, `width` apart; a row of scales a head, `tokens`
/// apart.
pub struct Cache<'m, E> {
    pub(super) keys: &'m mut [E],
    pub(super) values: &'m mut [E],
    pub(super) key_scales: &'m mut [f32],
    pub(super) value_scales: &'m mut [f32],
    pub(super) width: usize,
    pub(super) tokens: usize,
}

/// The scratch as slices: a row a token of the batch, `width` apart in the first two, four times
/// that in `hidden` and `quantised`, the cache's
/// `tokens` apart in `scores`.
pub struct Scratch<'m> {
    pub(super) residual: &'m mut [f32],
    pub(super) normal: &'m mut [f32],
    pub(super) hidden: &'m mut [f32],
    pub(super) quantised: Quantised<'m>,
    pub(super) scores: &'m mut [f32],
    pub(super) width: usize,
}

/// Where vectors are rounded to bytes: rows `stride` apart.
pub(super) struct Quantised<'m> {
    pub bytes: &'m mut [u8],
    pub wide: &'m mut [i16],
    pub stride: usize,
}

/// A [`Memory`] of whatever size. Not to be implemented elsewhere.
pub trait Storage {
    /// What its cache holds.
    type Element: Element;

    /// Whether a model fits.
    fn fits(&self, size: &Dimensions) -> bool;

    /// The cache of a block, and the scratch; `None` where there is no such block.
    fn parts(&mut self, layer: usize) -> Option<(Cache<'_, Self::Element>, Scratch<'_>)>;
}

impl<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E: Element> Storage
    for Memory<LAYERS, WIDTH, TOKENS, E>
{
    type Element = E;

    fn fits(&self, size: &Dimensions) -> bool {
        size.layers <= LAYERS && size.width <= WIDTH && size.tokens <= TOKENS
    }

    fn parts(&mut self, layer: usize) -> Option<(Cache<'_, E>, Scratch<'_>)> {
        let layer = self.layers.get_mut(layer)?;
        let cache = Cache {
            keys: layer.keys.as_flattened_mut(),
            values: layer.values.as_flattened_mut(),
            key_scales: layer.key_scales.as_flattened_mut(),
            value_scales: layer.value_scales.as_flattened_mut(),
            width: WIDTH,
            tokens: TOKENS,
        };
        let buffers = &mut self.buffers;
        let scratch = Scratch {
            residual: buffers.residual.as_flattened_mut(),
            normal: buffers.normal.as_flattened_mut(),
            hidden: buffers.hidden.as_flattened_mut().as_flattened_mut(),
            quantised: Quantised {
                bytes: buffers.bytes.as_flattened_mut().as_flattened_mut(),
                wide: buffers.wide.as_flattened_mut().as_flattened_mut(),
                stride: 4 * WIDTH,
            },
            scores: buffers.scores.as_flattened_mut(),
            width: WIDTH,
        };
        Some((cache, scratch))
    }
}
