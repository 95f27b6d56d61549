//! A network's memory in which one bit flips, for fault injection (single-event upsets).

use super::block::Step;
use super::element::Element;
use super::header::Dimensions;
use super::memory::{Cache, Scratch, Storage};

/// The part of a network's memory in which the bit flips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Keys in the KV cache of the next block, one row a token.
    Keys,
    /// Values in the KV cache of the next block, one row a token.
    Values,
    /// Scales of the keys, one row a head.
    KeyScales,
    /// Scales of the values, one row a head.
    ValueScales,
    /// The residual stream between blocks.
    Residual,
    /// Normalised vectors; after the last block the hidden state.
    Normal,
    /// Intermediate vectors between two linear maps of a block.
    Intermediate,
    /// Vectors quantised to bytes.
    Quantised,
    /// The quantised vectors as `i16` operands of the kernels.
    I16Operand,
    /// Attention scores.
    Scores,
}

/// One bit flip: when and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitFlip {
    /// Use of the memory before which the bit flips, counted from zero since [`FaultyMemory::new`]. A
    /// node has [`BitFlip::USES`] a block and three more: embedding, final norm, decoder.
    pub call: u32,
    /// The part of the memory.
    pub part: Part,
    /// Index of the number in it; the row stride is the memory's width (scales and scores: its number
    /// of tokens).
    pub element: usize,
    /// Index of the bit, modulo the number's size.
    pub bit: u32,
}

impl BitFlip {
    /// Uses of the memory by a block: before keys, values and queries, before attention, before the wide
    /// layer, and before what of it goes on.
    pub const USES: usize = Step::ALL.len();
}

/// A network's memory in which one bit flips between two uses.
///
/// Quantised vectors and scores are overwritten before they are read again: a flip there must change
/// nothing. An image that does not use this type contains no code of it.
pub struct FaultyMemory<'m, M> {
    memory: &'m mut M,
    bit_flip: Option<BitFlip>,
    calls: u32,
    injected: bool,
}

impl<'m, M: Storage> FaultyMemory<'m, M> {
    /// Wraps `memory`; `None` injects nothing.
    pub fn new(memory: &'m mut M, bit_flip: Option<BitFlip>) -> Self {
        Self { memory, bit_flip, calls: 0, injected: false }
    }

    /// Number of uses of the memory so far.
    pub fn calls(&self) -> u32 {
        self.calls
    }

    /// Whether the bit was flipped: false before its time and where there is no such element.
    pub fn is_injected(&self) -> bool {
        self.injected
    }
}

impl<M: Storage> Storage for FaultyMemory<'_, M> {
    type Element = M::Element;

    fn fits(&self, size: &Dimensions) -> bool {
        self.memory.fits(size)
    }

    fn parts(&mut self, layer: usize) -> Option<(Cache<'_, Self::Element>, Scratch<'_>)> {
        let (mut cache, mut scratch) = self.memory.parts(layer)?;
        let bit_flip = self.bit_flip.filter(|bit_flip| bit_flip.call == self.calls);
        self.calls = self.calls.saturating_add(1);
        if let Some(bit_flip) = bit_flip {
            self.injected |= flip(&bit_flip, &mut cache, &mut scratch).is_some();
        }
        Some((cache, scratch))
    }
}

fn flip<E: Element>(bit_flip: &BitFlip, cache: &mut Cache<E>, scratch: &mut Scratch) -> Option<()> {
    let BitFlip { part, element, bit, .. } = *bit_flip;
    let float = |numbers: &mut [f32]| {
        let number = numbers.get_mut(element)?;
        *number = number.flipped(bit);
        Some(())
    };
    let cached = |numbers: &mut [E]| {
        let number = numbers.get_mut(element)?;
        *number = number.flipped(bit);
        Some(())
    };
    match part {
        Part::Keys => cached(cache.keys),
        Part::Values => cached(cache.values),
        Part::KeyScales => float(cache.key_scales),
        Part::ValueScales => float(cache.value_scales),
        Part::Residual => float(scratch.residual),
        Part::Normal => float(scratch.normal),
        Part::Intermediate => float(scratch.intermediate),
        Part::Scores => float(scratch.scores),
        Part::Quantised => {
            let byte = scratch.quantised.bytes.get_mut(element)?;
            *byte = byte.flipped(bit);
            Some(())
        }
        Part::I16Operand => {
            let word = scratch.quantised.operand_i16.get_mut(element)?;
            *word ^= 1 << (bit % i16::BITS);
            Some(())
        }
    }
}
