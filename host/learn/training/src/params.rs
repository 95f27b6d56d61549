//! The parameters: one flat vector, and a table that says which tensor is where.
//!
//! Optimiser, checkpoint, model file and every device share this one order: for each kind of token
//! weight and bias; the nodes' embedding; the first norm; block by block; the last norm; the
//! decoder; last the state head, which is not part of the model file.

use crate::config::{Config, Decoder, Layout};
use crate::random::Random;
use crate::shape::Shape;
use remora_core::advanced::nn;

/// How a tensor starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// All zero.
    Zero,
    /// All one.
    One,
    /// Normal with this deviation.
    Normal(f64),
}

/// One tensor of the flat vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Such as `block0.qkv.weight`.
    pub name: String,
    /// Rows; 1 for vectors.
    pub rows: usize,
    /// Columns: inputs of a matrix, which is `[outputs][inputs]`.
    pub columns: usize,
    /// Where it starts in the vector.
    pub offset: usize,
    /// Whether weight decay applies: matrices of linear layers that are no embeddings.
    pub decays: bool,
    /// Initial values.
    pub start: Start,
}

impl Entry {
    /// Numbers of the tensor.
    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Its place in the flat vector.
    pub fn range(&self) -> core::ops::Range<usize> {
        self.offset..self.offset + self.len()
    }
}

/// Sizes of the network and the table of its tensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Tokens of a node.
    pub layout: Layout,
    /// Decoder of the network.
    pub decoder: Decoder,
    /// Input numbers of each kind of token, in the order of a node's features.
    pub token_types: Vec<usize>,
    /// Nodes of a trajectory.
    pub nodes: usize,
    /// Nodes from one that the network sees to the next.
    pub stride: usize,
    /// Blocks.
    pub layers: usize,
    /// Heads.
    pub heads: usize,
    /// Width.
    pub width: usize,
    /// Numbers of an action.
    pub action: usize,
    /// Outputs of the decoder: actions of a chunk.
    pub outputs: usize,
    /// Numbers of a next state.
    pub states: usize,
    /// The tensors.
    pub entries: Vec<Entry>,
}

impl Table {
    /// The network of a configuration, for examples of a shape.
    pub fn new(config: &Config, shape: &Shape) -> Self {
        let m = &config.model;
        let token_types = match m.layout {
            Layout::Fused | Layout::Chunked => vec![shape.groups.iter().sum()],
            Layout::Separate => shape.groups.clone(),
        };
        let mut table = Self {
            layout: m.layout,
            decoder: m.decoder,
            token_types,
            nodes: shape.nodes,
            stride: shape.stride,
            layers: m.layers,
            heads: m.heads,
            width: m.width,
            action: shape.action(),
            outputs: shape.action() * m.chunk,
            states: shape.states,
            entries: Vec::new(),
        };
        table.fill();
        table
    }

    /// Nodes of a trajectory that the network sees.
    pub fn seen(&self) -> usize {
        nn::seen(self.nodes, self.stride)
    }

    /// Hidden numbers of the flow decoder.
    pub fn hidden(&self) -> usize {
        2 * self.width
    }

    /// Numbers of all parameters.
    pub fn len(&self) -> usize {
        self.entries.last().map_or(0, |last| last.range().end)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers of the parameters that belong to the model file: all but the state head.
    pub fn inference_len(&self) -> usize {
        self.len() - (self.width + 1) * self.states
    }

    /// Initial parameters.
    pub fn start(&self, seed: u64) -> Vec<f32> {
        let mut random = Random::new(seed, Random::START, 0);
        let mut values = Vec::with_capacity(self.len());
        for entry in &self.entries {
            values.extend((0..entry.len()).map(|_| match entry.start {
                Start::Zero => 0.0,
                Start::One => 1.0,
                Start::Normal(deviation) => (deviation * random.normal()) as f32,
            }));
        }
        values
    }

    fn push(&mut self, name: String, rows: usize, columns: usize, decays: bool, start: Start) {
        let offset = self.len();
        self.entries.push(Entry { name, rows, columns, offset, decays, start });
    }

    /// Weight and bias; the deviation is that of PyTorch's default, times `gain`.
    fn linear(&mut self, name: &str, outputs: usize, inputs: usize, decays: bool, gain: f64) {
        let start = Start::Normal(gain / (3.0 * inputs as f64).sqrt());
        self.push(format!("{name}.weight"), outputs, inputs, decays, start);
        self.push(format!("{name}.bias"), 1, outputs, false, Start::Zero);
    }

    fn norm(&mut self, name: &str) {
        self.push(format!("{name}.gain"), 1, self.width, false, Start::One);
        self.push(format!("{name}.bias"), 1, self.width, false, Start::Zero);
    }

    fn fill(&mut self) {
        let width = self.width;
        for (kind, inputs) in self.token_types.clone().into_iter().enumerate() {
            self.linear(&format!("kind{kind}"), width, inputs, false, 1.0);
        }
        self.push("nodes".into(), self.nodes, width, false, Start::Normal(0.1));
        self.norm("norm");
        // Residual branches start small, so that the depth does not matter at first.
        let branch = 1.0 / (2.0 * self.layers as f64).sqrt();
        for block in 0..self.layers {
            self.norm(&format!("block{block}.norm1"));
            self.linear(&format!("block{block}.qkv"), 3 * width, width, true, 1.0);
            self.linear(&format!("block{block}.out"), width, width, true, branch);
            self.norm(&format!("block{block}.norm2"));
            self.linear(&format!("block{block}.up"), 4 * width, width, true, 1.0);
            self.linear(&format!("block{block}.down"), width, 4 * width, true, branch);
        }
        self.norm("last");
        let (outputs, hidden) = (self.outputs, self.hidden());
        match self.decoder {
            Decoder::Linear => self.linear("head", outputs, width, true, 1.0),
            Decoder::Flow => {
                self.linear("flow1", hidden, outputs + 1 + width, true, 1.0);
                self.linear("flow2", hidden, hidden, true, 1.0);
                self.linear("flow3", outputs, hidden, true, 1.0);
            }
        }
        self.linear("state", self.states, width, true, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::advanced::stages::{LINKS, NODES};
    use std::fs;

    const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/models");
    const TABLES: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/lab/2026-11-27-reproduction/README.md");

    fn table(name: &str) -> Table {
        let config =
            Config::parse(&fs::read_to_string(format!("{MODELS}/{name}.toml")).unwrap()).unwrap();
        Table::new(&config, &Shape::of(&config.model, NODES, LINKS))
    }

    /// A whole number as pages write it: 349,062.
    fn thousands(number: usize) -> String {
        let digits = number.to_string();
        let groups = digits.as_bytes().rchunks(3).rev().map(|group| str::from_utf8(group).unwrap());
        groups.collect::<Vec<_>>().join(",")
    }

    #[test]
    fn pages_tell_how_many_parameters_the_networks_have() {
        let models = fs::read_to_string(format!("{MODELS}/README.md")).unwrap();
        for name in ["euler", "rk4", "small"] {
            let number = thousands(table(name).inference_len());
            assert!(models.contains(&number), "fixtures/models/README.md: {name} has {number}");
        }
        let published = table("published");
        let number = thousands(published.inference_len());
        assert!(models.contains(&number), "fixtures/models/README.md: published has {number}");
        let number = thousands(published.len());
        let tables = fs::read_to_string(TABLES).unwrap();
        assert!(tables.contains(&number), "{TABLES}: published has {number}");
        let config = fs::read_to_string(format!("{MODELS}/published.toml")).unwrap();
        assert!(config.contains(&number), "published.toml: it has {number}");
    }
}
