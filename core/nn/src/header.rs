//! The header of a model file.

use super::error::ModelError;
use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

/// First bytes of every model file.
pub const MAGIC: [u8; 4] = *b"RMRN";
/// First version of the format: an action has [`ACTION`] numbers.
pub const VERSION: u16 = 1;
/// Second version: after the header of the first stands how many numbers an action has.
pub const VERSION_OF_ANY_ACTION: u16 = 2;

/// Numbers of an action in the first version of the format.
pub const ACTION: usize = 6;

/// Limits of the header's dimensions. They bound memory on the stack and keep every product of
/// dimensions below 2^32.
pub mod limit {
    /// Token types.
    pub const TOKEN_TYPES: usize = 5;
    /// Inputs of one token type.
    pub const INPUTS: usize = 128;
    /// Actions predicted at once.
    pub const CHUNK: usize = 8;
    /// Numbers of all actions predicted at once.
    pub const ACTIONS: usize = 50;
    /// Nodes.
    pub const NODES: usize = 1024;
    /// Transformer blocks.
    pub const LAYERS: usize = 16;
    /// Attention heads.
    pub const HEADS: usize = 8;
    /// Width of the hidden state.
    pub const WIDTH: usize = 1024;
    /// Steps of the flow decoder.
    pub const STEPS: usize = 256;
}

/// Precision of the weights and of inference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Weights, activations and KV cache in `i8`: the flight version.
    Int8,
    /// Everything in `f32`: what training writes, and the reference.
    F32,
}

/// Tokens of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Layout {
    /// Five tokens a node; the first, the previous action, does not exist at node 0.
    Separate,
    /// One token a node.
    Fused,
    /// One token a chunk: only the first node of each is seen, and all of its actions are executed (action
    /// chunking).
    Chunked,
}

/// How the hidden state becomes actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decoder {
    /// One linear map.
    Linear,
    /// Flow matching: a velocity network moves noise to the action.
    Flow {
        /// Euler steps, unless set at run time.
        steps: u16,
    },
}

/// Where a model comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Discretisation of the solutions it learned, as the host names it.
    pub integrator: String<16>,
    /// The data set.
    pub dataset: String<64>,
    /// Digest of the training's configuration.
    pub config: String<64>,
    /// Revision of the program that trained it.
    pub revision: String<48>,
    /// Seed of the training.
    pub seed: u64,
    /// Optimiser steps taken.
    pub steps: u64,
}

/// The header of a model file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// That of [`Header::version_of`] its actions.
    pub version: u16,
    /// Precision of weights and arithmetic.
    pub precision: Precision,
    /// Tokens of a node.
    pub layout: Layout,
    /// Meaning of the inputs: a number below 128 of the application's, which the network ignores.
    pub inputs: u8,
    /// Meaning of the outputs, likewise.
    pub outputs: u8,
    /// The decoder, the last part of the network.
    pub decoder: Decoder,
    /// Actions predicted at once.
    pub chunk: u16,
    /// Nodes of a sequence, rows of the node embedding.
    pub nodes: u16,
    /// Transformer blocks.
    pub layers: u16,
    /// Attention heads.
    pub heads: u16,
    /// Width of a hidden state.
    pub width: u16,
    /// Inputs of each token type, in the order of the features.
    pub token_types: Vec<u16, { limit::TOKEN_TYPES }>,
    /// Where it comes from.
    pub provenance: Provenance,
    /// Numbers of an action. In a file it follows the header, where the version says that it is there.
    #[serde(skip)]
    pub action: u16,
}

/// The header's dimensions, checked, as sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimensions {
    /// Nodes of a sequence.
    pub nodes: usize,
    /// Transformer blocks.
    pub layers: usize,
    /// Attention heads.
    pub heads: usize,
    /// Width of a hidden state.
    pub width: usize,
    /// Width of one head: `width / heads`.
    pub head_width: usize,
    /// Numbers of one action.
    pub action: usize,
    /// Inputs of a node: the sum over its token types.
    pub features: usize,
    /// Numbers of a prediction: those of an action times the chunk.
    pub actions: usize,
    /// Nodes from one that is seen to the next.
    pub stride: usize,
    /// Tokens of a whole sequence.
    pub tokens: usize,
}

/// How many of a sequence's nodes a network sees when it sees every `stride`th from the first on; the last node has
/// no action and need not be seen.
pub const fn seen(nodes: usize, stride: usize) -> usize {
    nodes.saturating_sub(1).div_ceil(stride)
}

impl Header {
    /// The version of the format that a file with actions of so many numbers has: the first where that
    /// one has room for it.
    pub const fn version_of(action: u16) -> u16 {
        if action as usize == ACTION { VERSION } else { VERSION_OF_ANY_ACTION }
    }

    /// The dimensions.
    ///
    /// # Errors
    /// [`ModelError::Shape`] where one is zero or beyond its [`limit`], where the heads do not divide
    /// the width, where the number of token types is not the layout's, or where the version has no room
    /// for the actions.
    pub fn dimensions(&self) -> Result<Dimensions, ModelError> {
        let within = |value: u16, most: usize| match usize::from(value) {
            value if (1..=most).contains(&value) => Ok(value),
            _ => Err(ModelError::Shape),
        };
        let (width, heads) = (within(self.width, limit::WIDTH)?, within(self.heads, limit::HEADS)?);
        let head_width = width.checked_div(heads).ok_or(ModelError::Shape)?;
        let nodes = within(self.nodes, limit::NODES)?;
        let mut features = 0;
        for token_type in &self.token_types {
            features += within(*token_type, limit::INPUTS)?;
        }
        let chunk = within(self.chunk, limit::CHUNK)?;
        let stride = match self.layout {
            Layout::Separate | Layout::Fused => 1,
            Layout::Chunked => chunk,
        };
        let (token_types, tokens) = match self.layout {
            Layout::Separate => (5, 5 * nodes - 1),
            Layout::Fused | Layout::Chunked => (1, nodes.div_ceil(stride)),
        };
        if let Decoder::Flow { steps } = self.decoder {
            within(steps, limit::STEPS)?;
        }
        let action = within(self.action, limit::ACTIONS)?;
        let actions = action * chunk;
        if head_width * heads != width
            || self.token_types.len() != token_types
            || actions > limit::ACTIONS
            || self.version < Self::version_of(self.action)
        {
            return Err(ModelError::Shape);
        }
        let layers = within(self.layers, limit::LAYERS)?;
        Ok(Dimensions {
            nodes,
            layers,
            heads,
            width,
            head_width,
            action,
            features,
            actions,
            stride,
            tokens,
        })
    }
}
