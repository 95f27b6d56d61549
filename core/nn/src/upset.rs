//! Memory in which a bit flips: for fault injection.

use super::element::Element;
use super::header::Dimensions;
use super::memory::{Cache, Scratch, Storage};

/// What of a network's memory is struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Keys of the cache of the block that is next: a row a token.
    Keys,
    /// Its values.
    Values,
    /// Scales of the keys: a row a head.
    KeyScales,
    /// Scales of the values.
    ValueScales,
    /// The residual stream, what goes from block to block.
    Residual,
    /// Normalised vectors; between the last block and the decoder, the latent.
    Normal,
    /// What a block keeps between two of its linear maps.
    Hidden,
    /// Vectors rounded to bytes.
    Quantised,
    /// The same as the kernels take them, in sixteen bits.
    Wide,
    /// Scores of the attention.
    Scores,
}

/// One flipped bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strike {
    /// Before which use of the memory: they are counted from zero since [`Upset::new`]. A node has
    /// three and one a block: embedding, each block, the final norm, the decoder.
    pub call: u32,
    /// What is struck.
    pub part: Part,
    /// Which number of it, its rows as far apart as the memory is wide (scales and scores: as it
    /// has tokens).
    pub element: usize,
    /// Which bit of the number, modulo those it has.
    pub bit: u32,
}

/// A network's memory in which one bit flips between two uses.
///
/// What lives only within a block (hidden and rounded vectors, scores) is overwritten before it
/// is read again, so that there a strike shows that nothing of it is carried on. An image that does
/// not use this type has nothing of it.
pub struct Upset<'m, M> {
    memory: &'m mut M,
    strike: Option<Strike>,
    calls: u32,
    struck: bool,
}

impl<'m, M: Storage> Upset<'m, M> {
    /// `memory`, to be struck once, or never.
    pub fn new(memory: &'m mut M, strike: Option<Strike>) -> Self {
        Self { memory, strike, calls: 0, struck: false }
    }

    /// How often the memory was used.
    pub fn calls(&self) -> u32 {
        self.calls
    }

    /// Whether the bit was flipped: not before its time, and not where there is no such element.
    pub fn is_struck(&self) -> bool {
        self.struck
    }
}

impl<M: Storage> Storage for Upset<'_, M> {
    type Element = M::Element;

    fn fits(&self, size: &Dimensions) -> bool {
        self.memory.fits(size)
    }

    fn parts(&mut self, layer: usize) -> Option<(Cache<'_, Self::Element>, Scratch<'_>)> {
        let (mut cache, mut scratch) = self.memory.parts(layer)?;
        let strike = self.strike.filter(|strike| strike.call == self.calls);
        self.calls = self.calls.saturating_add(1);
        if let Some(strike) = strike {
            self.struck |= flip(&strike, &mut cache, &mut scratch).is_some();
        }
        Some((cache, scratch))
    }
}

fn flip<E: Element>(strike: &Strike, cache: &mut Cache<E>, scratch: &mut Scratch) -> Option<()> {
    let Strike { part, element, bit, .. } = *strike;
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
        Part::Hidden => float(scratch.hidden),
        Part::Scores => float(scratch.scores),
        Part::Quantised => {
            let byte = scratch.quantised.bytes.get_mut(element)?;
            *byte = byte.flipped(bit);
            Some(())
        }
        Part::Wide => {
            let word = scratch.quantised.wide.get_mut(element)?;
            *word ^= 1 << (bit % i16::BITS);
            Some(())
        }
    }
}
