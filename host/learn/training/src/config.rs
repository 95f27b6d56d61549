//! The configuration of a training, `*.toml`.

use crate::examples::Disturbance;
use remora_core::advanced::nn::limit;
pub use remora_core::advanced::warmstart::{Action, Encoding};
use remora_host::error::{Error, FieldError};
use remora_host::formats::{Limit, read_text, toml_text};
use remora_host::lineage::Source;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// All that decides a training: the same file on the same machine makes the same bits, unless
/// `training.minutes` lets the clock decide.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Data to learn from.
    pub data: Data,
    /// Network that learns.
    pub model: Model,
    /// Settings of the training.
    pub training: Training,
}

/// Section `[data]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Data {
    /// Directory of the dataset, relative to where the program runs; `synthetic` for random
    /// trajectories that only tests and benchmarks want.
    pub path: PathBuf,
    /// Trajectories to learn from, the first of the set; all where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
    /// More directories, mixed with the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extra: Vec<PathBuf>,
    /// Errors in the rates that examples of the training split come back from; none where it is
    /// left out.
    #[serde(default)]
    pub disturbance: Disturbance,
}

/// How a node's features become tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// One token a node.
    Fused,
    /// Five tokens a node, the paper's.
    Separate,
    /// One token a chunk, all of whose actions are executed before the next.
    Chunked,
}

/// How a latent becomes an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Decoder {
    /// A matrix.
    Linear,
    /// Flow matching.
    Flow,
}

/// Section `[model]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Tokens of a node.
    pub layout: Layout,
    /// Features of a node.
    pub encoding: Encoding,
    /// Action that is predicted.
    pub action: Action,
    /// How it is predicted.
    pub decoder: Decoder,
    /// Actions predicted at a node: 1 or 5, with one token a chunk from 2 to 8.
    pub chunk: usize,
    /// Blocks.
    pub layers: usize,
    /// Attention heads a block; `width / heads` is 8, 16, 24, 32, 48, 64 or 96.
    pub heads: usize,
    /// Numbers of a token's latent.
    pub width: usize,
    /// Probability with which a number of a residual branch is dropped in training.
    #[serde(default)]
    pub dropout: f64,
}

impl Model {
    /// Nodes from one that the network sees to the next.
    pub fn stride(&self) -> usize {
        match self.layout {
            Layout::Fused | Layout::Separate => 1,
            Layout::Chunked => self.chunk,
        }
    }
}

/// How the learning rate falls to zero after the warm-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Schedule {
    /// Along a line, the paper's.
    #[default]
    Linear,
    /// Along half a cosine.
    Cosine,
}

/// Section `[training]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Trajectories a batch.
    pub batch: usize,
    /// Batches a step.
    #[serde(default = "one")]
    pub accumulation: usize,
    /// Highest learning rate.
    pub learning_rate: f64,
    /// Steps over which it rises from zero.
    #[serde(default)]
    pub warmup_steps: u64,
    /// How it falls afterwards.
    #[serde(default)]
    pub schedule: Schedule,
    /// AdamW's, on matrices only: not on biases, norms and embeddings.
    #[serde(default)]
    pub weight_decay: f64,
    /// Largest norm of the gradient of all parameters together; longer ones are shortened.
    #[serde(default = "unit")]
    pub clip_norm: f64,
    /// Optimiser steps.
    pub steps: u64,
    /// Ends the schedule after so many minutes of training even where `steps` is not reached: the
    /// learning rate follows whichever is further. The result then depends on the clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Steps that `minutes` must leave time for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_steps: Option<u64>,
    /// Seed of everything random.
    pub seed: u64,
    /// Minutes between checkpoints.
    #[serde(default = "checkpoint_minutes")]
    pub checkpoint_minutes: f64,
    /// Steps between validations.
    pub validate_every: u64,
    /// Trajectories of a validation.
    #[serde(default = "validation_count")]
    pub validation_count: usize,
    /// Weight of the next state's squared error beside the action's.
    #[serde(default)]
    pub state_loss: f64,
    /// Validation scenarios on which the model is rolled out at each validation [default: 64].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rollout_count: Option<usize>,
    /// Directory of a training, a checkpoint in one, or a model file (`*.model`, in bytes or single
    /// precision), whose parameters and statistics this one starts from; the network must be the
    /// same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub init_from: Option<PathBuf>,
    /// Whether means and deviations are those of this training's data, not the model file's: for a
    /// vehicle whose numbers are of another size.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub own_statistics: bool,
    /// Datasets that the parent is known to have learnt from beside those that it names itself, such as
    /// `s1000:90000`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent_learnt_from: Option<String>,
}

fn one() -> usize {
    1
}

fn unit() -> f64 {
    1.0
}

fn checkpoint_minutes() -> f64 {
    5.0
}

fn validation_count() -> usize {
    256
}

/// Head sizes that the attention kernels are built for.
pub const HEAD_SIZES: [usize; 7] = [8, 16, 24, 32, 48, 64, 96];

impl Config {
    /// Reads and validates a file.
    ///
    /// # Errors
    /// File, field and reason.
    pub fn read(file: &Path) -> Result<Self, Error> {
        Self::parse(&read_text(file, Limit::TEXT)?).map_err(|error| error.at(file))
    }

    /// Parses and validates a file's text.
    ///
    /// # Errors
    /// Field and reason.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let config: Self = toml_text::parse(text, None)?;
        config.validate()?;
        Ok(config)
    }

    /// The file's text, with every default spelled out.
    pub fn text(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// CRC-32 of [`text`](Self::text), in hexadecimal: which configuration made a model. Of paths
    /// only the last names count, for it is all the same where data and checkpoints lie.
    pub fn digest(&self) -> String {
        let mut placeless = self.clone();
        let Data { path, extra, .. } = &mut placeless.data;
        let paths = extra.iter_mut().chain([path]).chain(&mut placeless.training.init_from);
        for path in paths {
            *path = path.file_name().unwrap_or_default().into();
        }
        format!("{:08x}", crc32fast::hash(placeless.text().as_bytes()))
    }

    fn validate(&self) -> Result<(), FieldError> {
        let refuse = |field: &str, reason: &str| Err(FieldError::new(field, reason));
        let count = |field: &str, value: usize, most: usize| match value {
            v if (1..=most).contains(&v) => Ok(()),
            _ => Err(FieldError::new(field, format!("must be from 1 to {most}"))),
        };
        let (m, t) = (&self.model, &self.training);
        match m.layout {
            Layout::Chunked if !(2..=limit::CHUNK).contains(&m.chunk) => {
                return refuse("model.chunk", "must be from 2 to 8 with one token a chunk");
            }
            Layout::Fused | Layout::Separate if ![1, 5].contains(&m.chunk) => {
                return refuse("model.chunk", "must be 1 or 5");
            }
            _ => {}
        }
        count("model.layers", m.layers, 12)?;
        count("model.width", m.width, 768)?;
        count("model.heads", m.heads, m.width)?;
        if m.width % m.heads != 0 || !HEAD_SIZES.contains(&(m.width / m.heads)) {
            return refuse("model.heads", "width / heads must be 8, 16, 24, 32, 48, 64 or 96");
        }
        count("training.batch", t.batch, 4096)?;
        count("training.accumulation", t.accumulation, 1024)?;
        count("training.validation_count", t.validation_count, 100_000)?;
        count("training.steps", t.steps.try_into().unwrap_or(usize::MAX), 100_000_000)?;
        count("training.validate_every", t.validate_every as usize, usize::MAX)?;
        self.validate_numbers()
    }

    fn validate_numbers(&self) -> Result<(), FieldError> {
        let (m, t) = (&self.model, &self.training);
        let number = |field: &str, value: f64, good: bool, reason: &str| {
            if good && value.is_finite() { Ok(()) } else { Err(FieldError::new(field, reason)) }
        };
        let (positive, negative) = ("must be positive", "must not be negative");
        let dropout = "must be at least 0 and below 1";
        number("model.dropout", m.dropout, (0.0..1.0).contains(&m.dropout), dropout)?;
        number("training.learning_rate", t.learning_rate, t.learning_rate > 0.0, positive)?;
        number("training.weight_decay", t.weight_decay, t.weight_decay >= 0.0, negative)?;
        number("training.clip_norm", t.clip_norm, t.clip_norm > 0.0, positive)?;
        let checkpoint = t.checkpoint_minutes;
        number("training.checkpoint_minutes", checkpoint, checkpoint > 0.0, positive)?;
        for (field, value) in [
            ("data.disturbance.bus_rate_rad_s", self.data.disturbance.bus_rate_rad_s),
            ("data.disturbance.joint_rate_rad_s", self.data.disturbance.joint_rate_rad_s),
        ] {
            number(field, value, value >= 0.0, negative)?;
        }
        if let Some(text) = &t.parent_learnt_from {
            let field = "training.parent_learnt_from";
            Source::parse_all(text).map_err(|reason| FieldError::new(field, reason))?;
            if t.init_from.is_none() {
                return Err(FieldError::new(field, "is of use with init_from only"));
            }
        }
        number("training.state_loss", t.state_loss, t.state_loss >= 0.0, negative)?;
        let minutes = t.minutes.unwrap_or(1.0);
        number("training.minutes", minutes, minutes > 0.0, positive)
    }
}

impl Training {
    /// Learning rate of a step, given how far the training is, from 0 to 1.
    pub fn rate(&self, step: u64, progress: f64) -> f64 {
        let rise = (step + 1) as f64 / (self.warmup_steps + 1) as f64;
        let left = (1.0 - progress).clamp(0.0, 1.0);
        let fall = match self.schedule {
            Schedule::Linear => left,
            Schedule::Cosine => 0.5 - 0.5 * (core::f64::consts::PI * left).cos(),
        };
        self.learning_rate * rise.min(1.0) * fall
    }
}
