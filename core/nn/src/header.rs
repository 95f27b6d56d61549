//! What a model file says about itself before its tensors.

use super::error::ModelError;
use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

/// The first bytes of every model file.
pub const MAGIC: [u8; 4] = *b"RMRN";
/// The format this code reads and writes.
pub const VERSION: u16 = 1;

/// Numbers of one action in this version of the format.
pub const ACTION: usize = 6;

/// What the header may ask for. They bound memory on the stack and keep every product of
/// dimensions below 2^32.
pub mod limit {
    /// Kinds of tokens.
    pub const KINDS: usize = 5;
    /// Inputs of one kind.
    pub const INPUTS: usize = 128;
    /// Actions predicted at once.
    pub const CHUNK: usize = 8;
    /// Nodes.
    pub const NODES: usize = 1024;
    /// Transformer blocks.
    pub const LAYERS: usize = 16;
    /// Attention heads.
    pub const HEADS: usize = 8;
    /// Width of a latent.
    pub const WIDTH: usize = 1024;
    /// Steps of the flow decoder.
    pub const STEPS: usize = 256;
}

/// How weights are stored, and with which arithmetic the network runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Weights, activations and cache of eight bits; what flies.
    Int8,
    /// Everything `f32`: what training writes, and the reference.
    F32,
}

/// How a node becomes tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Layout {
    /// Five tokens a node, the first of which, what was done at the node before, does not exist
    /// at node 0.
    Separate,
    /// One token a node.
    Fused,
}

/// How a latent becomes actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decoder {
    /// One linear map.
    Linear,
    /// Flow matching: noise is carried to the action by a velocity network.
    Flow {
        /// Euler steps, unless told otherwise at run time.
        steps: u16,
    },
}

/// Where a model comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// The discretisation whose solutions it learned, as the host names it.
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
    /// [`VERSION`].
    pub version: u16,
    /// Precision of weights and arithmetic.
    pub precision: Precision,
    /// Tokens of a node.
    pub layout: Layout,
    /// What the inputs are: a number of the application's, below 128, of which the network makes
    /// nothing.
    pub inputs: u8,
    /// What the outputs are: likewise.
    pub outputs: u8,
    /// Last part of the network.
    pub decoder: Decoder,
    /// Actions predicted at once.
    pub chunk: u16,
    /// Nodes of a sequence, rows of the node embedding.
    pub nodes: u16,
    /// Transformer blocks.
    pub layers: u16,
    /// Attention heads.
    pub heads: u16,
    /// Width of a latent.
    pub width: u16,
    /// Inputs of each kind of token, in the order in which they stand in the features.
    pub kinds: Vec<u16, { limit::KINDS }>,
    /// Where it comes from.
    pub provenance: Provenance,
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
    /// Width of a latent.
    pub width: usize,
    /// Width of a latent's part for one head: `width / heads`.
    pub head_width: usize,
    /// Numbers of one action.
    pub action: usize,
    /// Inputs of a node: the sum over its kinds.
    pub features: usize,
    /// Numbers of a prediction: [`ACTION`] times the chunk.
    pub actions: usize,
    /// Tokens of a whole sequence.
    pub tokens: usize,
}

impl Header {
    /// The dimensions.
    ///
    /// # Errors
    /// [`ModelError::Shape`] where one is zero or beyond its [`limit`], where the heads do not
    /// divide the width, or where the number of kinds is not the layout's.
    pub fn dimensions(&self) -> Result<Dimensions, ModelError> {
        let within = |value: u16, most: usize| match usize::from(value) {
            value if (1..=most).contains(&value) => Ok(value),
            _ => Err(ModelError::Shape),
        };
        let (width, heads) = (within(self.width, limit::WIDTH)?, within(self.heads, limit::HEADS)?);
        let head_width = width.checked_div(heads).ok_or(ModelError::Shape)?;
        let nodes = within(self.nodes, limit::NODES)?;
        let mut features = 0;
        for kind in &self.kinds {
            features += within(*kind, limit::INPUTS)?;
        }
        let (kinds, tokens) = match self.layout {
            Layout::Separate => (5, 5 * nodes - 1),
            Layout::Fused => (1, nodes),
        };
        if let Decoder::Flow { steps } = self.decoder {
            within(steps, limit::STEPS)?;
        }
        if head_width * heads != width || self.kinds.len() != kinds {
            return Err(ModelError::Shape);
        }
        let actions = ACTION * within(self.chunk, limit::CHUNK)?;
        let layers = within(self.layers, limit::LAYERS)?;
        Ok(Dimensions {
            nodes,
            layers,
            heads,
            width,
            head_width,
            action: ACTION,
            features,
            actions,
            tokens,
        })
    }
}
