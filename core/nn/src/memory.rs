//! The memory of a network: KV cache and scratch.

use super::element::Element;
use super::header::{Dimensions, limit};
use super::kernels::BATCH;

/// KV cache of one block. Each head's part of a vector has one scale; scales of one head are
/// contiguous.
struct Layer<const WIDTH: usize, const TOKENS: usize, E> {
    keys: [[E; WIDTH]; TOKENS],
    values: [[E; WIDTH]; TOKENS],
    key_scales: [[f32; TOKENS]; limit::HEADS],
    value_scales: [[f32; TOKENS]; limit::HEADS],
}

/// Scratch of one node's tokens during a forward pass.
struct Buffers<const WIDTH: usize, const TOKENS: usize> {
    residual: [[f32; WIDTH]; BATCH],
    normal: [[f32; WIDTH]; BATCH],
    intermediate: [[[f32; WIDTH]; 4]; BATCH],
    bytes: [[[u8; WIDTH]; 4]; BATCH],
    operand_i16: [[[i16; WIDTH]; 4]; BATCH],
    scores: [[f32; TOKENS]; BATCH],
}

/// Memory for networks of at most `LAYERS` blocks, width `WIDTH` and `TOKENS` tokens (five a node less
/// one, or one a node). The KV cache holds the bits of signed bytes (`E = u8`); with `E = f32` it is
/// [`ReferenceMemory`].
///
/// Bytes: `LAYERS TOKENS (2 WIDTH + 64)` for the cache, `180 WIDTH + 20 TOKENS` of scratch.
pub struct Memory<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E = u8> {
    layers: [Layer<WIDTH, TOKENS, E>; LAYERS],
    buffers: Buffers<WIDTH, TOKENS>,
}

/// Memory for networks in single precision, the reference of the quantised ones.
pub type ReferenceMemory<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize> =
    Memory<LAYERS, WIDTH, TOKENS, f32>;

impl<const LAYERS: usize, const WIDTH: usize, const TOKENS: usize, E: Element>
    Memory<LAYERS, WIDTH, TOKENS, E>
{
    /// Size in bytes.
    pub const BYTES: usize = size_of::<Self>();

    /// Size of the KV cache in bytes; the rest is scratch.
    pub const CACHE_BYTES: usize = size_of::<[Layer<WIDTH, TOKENS, E>; LAYERS]>();

    /// Storage for any number of rollouts, one after the other, all bits zero. Place it in static
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
                    intermediate: [[[0.0; WIDTH]; 4]; BATCH],
                    bytes: [[[0; WIDTH]; 4]; BATCH],
                    operand_i16: [[[0; WIDTH]; 4]; BATCH],
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

/// KV cache of one block as slices: one row a token with stride `width`, one row of scales a head with
/// stride `tokens`.
pub struct Cache<'m, E> {
    pub(super) keys: &'m mut [E],
    pub(super) values: &'m mut [E],
    pub(super) key_scales: &'m mut [f32],
    pub(super) value_scales: &'m mut [f32],
    pub(super) width: usize,
    pub(super) tokens: usize,
}

/// Scratch as slices, one row a token of the batch. The stride is `width` for the first two, four times
/// that for `intermediate` and `quantised`, the cache's `tokens` for `scores`.
pub struct Scratch<'m> {
    pub(super) residual: &'m mut [f32],
    pub(super) normal: &'m mut [f32],
    pub(super) intermediate: &'m mut [f32],
    pub(super) quantised: Quantised<'m>,
    pub(super) scores: &'m mut [f32],
    pub(super) width: usize,
}

/// Vectors quantised to bytes, and their `i16` operands; rows `stride` apart.
pub(super) struct Quantised<'m> {
    pub bytes: &'m mut [u8],
    pub operand_i16: &'m mut [i16],
    pub stride: usize,
}

/// A [`Memory`] of any size. Only this crate implements it.
pub trait Storage {
    /// Number type of its KV cache.
    type Element: Element;

    /// Whether a model of these dimensions fits.
    fn fits(&self, size: &Dimensions) -> bool;

    /// KV cache of a block and the scratch; `None` where there is no such block.
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
            intermediate: buffers.intermediate.as_flattened_mut().as_flattened_mut(),
            quantised: Quantised {
                bytes: buffers.bytes.as_flattened_mut().as_flattened_mut(),
                operand_i16: buffers.operand_i16.as_flattened_mut().as_flattened_mut(),
                stride: 4 * WIDTH,
            },
            scores: buffers.scores.as_flattened_mut(),
            width: WIDTH,
        };
        Some((cache, scratch))
    }
}
