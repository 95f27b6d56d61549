//! A model file in read-only memory, as views of its tensors.

use super::crc::Crc32;
use super::error::ModelError;
use super::header::{
    ACTION, Decoder, Dimensions, Header, MAGIC, Precision, VERSION, VERSION_OF_ANY_ACTION, limit,
};

/// Numbers of single precision in their little-endian bytes, wherever they lie.
pub(super) type Floats<'a> = &'a [[u8; 4]];

/// Gain and bias of a layer norm.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Norm<'a> {
    pub gain: Floats<'a>,
    pub bias: Floats<'a>,
}

/// The weights of a linear map, row by row.
#[derive(Clone, Copy, Debug)]
pub(super) enum Weights<'a> {
    /// Signed bytes, and the scale of each row.
    Int8(&'a [u8], Floats<'a>),
    F32(Floats<'a>),
}

/// A linear map: `y = W x + b`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear<'a> {
    pub weights: Weights<'a>,
    pub bias: Floats<'a>,
    pub columns: usize,
}

impl Default for Linear<'_> {
    fn default() -> Self {
        Self { weights: Weights::F32(&[]), bias: &[], columns: 0 }
    }
}

impl Linear<'_> {
    /// The first `count` rows, and the others.
    pub fn split(&self, count: usize) -> (Self, Self) {
        let at = count * self.columns;
        let (first, last) = match self.weights {
            Weights::Int8(weights, scales) => {
                let (weights, scales) = (split(weights, at), split(scales, count));
                (Weights::Int8(weights.0, scales.0), Weights::Int8(weights.1, scales.1))
            }
            Weights::F32(weights) => {
                let weights = split(weights, at);
                (Weights::F32(weights.0), Weights::F32(weights.1))
            }
        };
        let bias = split(self.bias, count);
        let with = |weights, bias| Self { weights, bias, columns: self.columns };
        (with(first, bias.0), with(last, bias.1))
    }
}

/// `split_at` that returns empty slices where `slice` is too short.
fn split<T>(slice: &[T], at: usize) -> (&[T], &[T]) {
    slice.split_at_checked(at).unwrap_or_default()
}

/// The embedding of one token type.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Embedding<'a> {
    pub inputs: usize,
    pub mean: Floats<'a>,
    pub std: Floats<'a>,
    /// One row an input, so that the sum over inputs runs along rows.
    pub weight: Floats<'a>,
    pub bias: Floats<'a>,
}

/// One transformer block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Block<'a> {
    pub norm1: Norm<'a>,
    pub qkv: Linear<'a>,
    pub out: Linear<'a>,
    pub norm2: Norm<'a>,
    pub up: Linear<'a>,
    pub down: Linear<'a>,
}

/// The decoder's weights.
#[derive(Clone, Copy, Debug)]
pub(super) enum Head<'a> {
    Linear(Linear<'a>),
    Flow(Flow<'a>),
}

/// The velocity network of the flow decoder. Its first map is split, because the part of the hidden
/// state is the same in every step; the rows of `action` belong to the action's numbers and, last, to
/// the time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow<'a> {
    pub steps: u16,
    pub latent: Linear<'a>,
    pub action: Floats<'a>,
    pub hidden: Linear<'a>,
    pub out: Linear<'a>,
}

/// A model file, checked: views into the caller's bytes, nothing copied.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    header: Header,
    size: Dimensions,
    checksum: u32,
    /// Bytes that the checksum covers.
    covered: &'a [u8],
    pub(super) embeddings: [Embedding<'a>; limit::TOKEN_TYPES],
    pub(super) nodes: Floats<'a>,
    pub(super) norm_in: Norm<'a>,
    blocks: &'a [u8],
    block_bytes: usize,
    pub(super) norm_out: Norm<'a>,
    pub(super) head: Head<'a>,
    pub(super) action_mean: Floats<'a>,
    pub(super) action_std: Floats<'a>,
}

impl<'a> Model<'a> {
    /// Checks a model file and finds its tensors. Cost: one pass over the bytes for the checksum;
    /// [`super::Check`] does that in slices.
    ///
    /// # Errors
    /// The first reason found for refusing the file.
    // Not inlined: an entry point with a stack bound of its own.
    #[inline(never)]
    pub fn open(bytes: &'a [u8]) -> Result<Self, ModelError> {
        Self::open_with(bytes, Crc32::of)
    }

    /// [`Model::open`] with the checksum computed by `checksum`.
    pub(super) fn open_with(
        bytes: &'a [u8],
        checksum: impl FnOnce(&[u8]) -> u32,
    ) -> Result<Self, ModelError> {
        let (header, tensors) = Self::read_header(bytes)?;
        let (tensors, stored) = tensors.split_last_chunk::<4>().ok_or(ModelError::Missing)?;
        let mut model = Self::view(header, tensors)?;
        let covered = bytes.split_last_chunk::<4>().ok_or(ModelError::Missing)?.0;
        model.checksum = u32::from_le_bytes(*stored);
        model.covered = covered;
        if checksum(covered) != model.checksum {
            return Err(ModelError::Crc);
        }
        Ok(model)
    }

    /// The header, and the bytes after it.
    fn read_header(bytes: &'a [u8]) -> Result<(Header, &'a [u8]), ModelError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(ModelError::Magic)?;
        // Reads only the version of a file in another format version.
        let (version, _) =
            postcard::take_from_bytes::<u16>(rest).map_err(|_| ModelError::Version)?;
        if version != VERSION && version != VERSION_OF_ANY_ACTION {
            return Err(ModelError::Version);
        }
        let (mut header, mut rest) =
            postcard::take_from_bytes::<Header>(rest).map_err(|_| ModelError::Header)?;
        header.action = ACTION as u16;
        if version == VERSION_OF_ANY_ACTION {
            (header.action, rest) =
                postcard::take_from_bytes(rest).map_err(|_| ModelError::Header)?;
        }
        Ok((header, rest))
    }

    fn view(header: Header, tensors: &'a [u8]) -> Result<Self, ModelError> {
        let size = header.dimensions()?;
        let w = size.width;
        let mut cursor = Cursor { rest: tensors, precision: header.precision };
        let (mut mean, mut std) = (cursor.floats(size.features)?, cursor.floats(size.features)?);
        let (action_mean, action_std) = (cursor.floats(size.action)?, cursor.floats(size.action)?);
        let mut embeddings = [Embedding::default(); limit::TOKEN_TYPES];
        for (embedding, inputs) in embeddings.iter_mut().zip(&header.token_types) {
            let inputs = usize::from(*inputs);
            let (mean_here, std_here) = (split(mean, inputs), split(std, inputs));
            let (weight, bias) = (cursor.floats(inputs * w)?, cursor.floats(w)?);
            *embedding = Embedding { inputs, mean: mean_here.0, std: std_here.0, weight, bias };
            (mean, std) = (mean_here.1, std_here.1);
        }
        let nodes = cursor.floats(size.nodes * w)?;
        let norm_in = cursor.norm(w)?;
        let blocks = cursor.rest;
        let mut block_bytes = 0;
        for _ in 0..size.layers {
            let before = cursor.rest.len();
            cursor.block(w)?;
            block_bytes = before - cursor.rest.len();
        }
        let norm_out = cursor.norm(w)?;
        let head = cursor.head(header.decoder, w, size.actions)?;
        if !cursor.rest.is_empty() {
            return Err(ModelError::Trailing);
        }
        Ok(Self {
            header,
            size,
            checksum: 0,
            covered: &[],
            embeddings,
            nodes,
            norm_in,
            blocks,
            block_bytes,
            norm_out,
            head,
            action_mean,
            action_std,
        })
    }

    /// The file's header.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// CRC-32 of the file without its last four bytes, which hold it.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Whether the file still has the checksum that it had when it was opened. Cost: one pass over it.
    // Not inlined, as opening it.
    #[inline(never)]
    pub fn is_intact(&self) -> bool {
        Crc32::of(self.covered) == self.checksum
    }

    /// Its dimensions.
    pub fn dimensions(&self) -> &Dimensions {
        &self.size
    }

    /// How far the features of a node are from those that the model has learnt from: the largest distance
    /// of one from its mean, in standard deviations. NaN where one is not a number.
    pub fn deviation(&self, features: &[f32]) -> f32 {
        let statistics = |e: &Embedding<'a>| e.mean.iter().zip(e.std);
        let statistics = self.embeddings.iter().flat_map(statistics);
        features.iter().zip(statistics).fold(0.0, |most, (feature, (mean, std))| {
            let off = ((feature - f32::from_le_bytes(*mean)) / f32::from_le_bytes(*std)).abs();
            // NaN is farther than all.
            if off <= most || most.is_nan() { most } else { off }
        })
    }

    pub(super) fn block(&self, layer: usize) -> Block<'a> {
        // All blocks have the same size and were checked when the file was opened.
        let bytes = self.blocks.get(layer * self.block_bytes..).unwrap_or_default();
        let mut cursor = Cursor { rest: bytes, precision: self.header.precision };
        cursor.block(self.size.width).unwrap_or_default()
    }
}

/// Reads tensors one after the other.
struct Cursor<'a> {
    rest: &'a [u8],
    precision: Precision,
}

impl<'a> Cursor<'a> {
    fn bytes(&mut self, count: usize) -> Result<&'a [u8], ModelError> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(ModelError::Missing)?;
        self.rest = rest;
        Ok(taken)
    }

    fn floats(&mut self, count: usize) -> Result<Floats<'a>, ModelError> {
        Ok(self.bytes(4 * count)?.as_chunks().0)
    }

    fn norm(&mut self, width: usize) -> Result<Norm<'a>, ModelError> {
        Ok(Norm { gain: self.floats(width)?, bias: self.floats(width)? })
    }

    fn linear(&mut self, rows: usize, columns: usize) -> Result<Linear<'a>, ModelError> {
        let weights = match self.precision {
            Precision::Int8 => Weights::Int8(self.bytes(rows * columns)?, self.floats(rows)?),
            Precision::F32 => Weights::F32(self.floats(rows * columns)?),
        };
        Ok(Linear { weights, bias: self.floats(rows)?, columns })
    }

    /// A linear map in `f32` whatever the precision.
    fn exact(&mut self, rows: usize, columns: usize) -> Result<Linear<'a>, ModelError> {
        let weights = Weights::F32(self.floats(rows * columns)?);
        Ok(Linear { weights, bias: self.floats(rows)?, columns })
    }

    fn block(&mut self, w: usize) -> Result<Block<'a>, ModelError> {
        Ok(Block {
            norm1: self.norm(w)?,
            qkv: self.linear(3 * w, w)?,
            out: self.linear(w, w)?,
            norm2: self.norm(w)?,
            up: self.linear(4 * w, w)?,
            down: self.linear(w, 4 * w)?,
        })
    }

    fn head(&mut self, decoder: Decoder, w: usize, a: usize) -> Result<Head<'a>, ModelError> {
        Ok(match decoder {
            Decoder::Linear => Head::Linear(self.exact(a, w)?),
            Decoder::Flow { steps } => Head::Flow(Flow {
                steps,
                latent: self.linear(2 * w, w)?,
                action: self.floats((a + 1) * 2 * w)?,
                hidden: self.linear(2 * w, 2 * w)?,
                out: self.exact(a, 2 * w)?,
            }),
        })
    }
}
