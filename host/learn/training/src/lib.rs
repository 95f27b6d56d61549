//! Training of the learned warm start, in Rust with Burn; the program `remora-train` calls it.
//!
//! - [`config`]: the file that decides a training;
//! - [`examples`]: what a network is to learn of a trajectory; [`recorded`]: those of datasets;
//! - [`shape`]: sizes of what is learned; [`source`]: any examples, their statistics, batches;
//! - [`params`]: the parameters, one flat vector with a table of its tensors;
//! - [`network`]: forward pass and loss on Burn's tensors, of the operations in [`kernels`],
//!   which `flex` makes fast on the CPU; `gpu`: an NVIDIA GPU;
//! - [`optimiser`]: AdamW, the global norm clipped;
//! - [`model`]: the model file; [`fitted`]: another one's, made fit for what this network sees;
//!   [`rollout`]: what it is worth rolled out;
//! - [`run`]: the loop; [`checkpoint`]: what it needs to resume bit for bit; [`output`]
//!   and [`curve`]: what is left of it;
//! - [`learning`]: all of it for a mission, from nothing to a model that was tested.
//!
//! Burn differentiates; the parameters stay here, in one vector on the host. So optimiser,
//! checkpoint and model file need nothing of Burn, and are the same on every device.
#![forbid(unsafe_code)]

pub mod checkpoint;
pub mod config;
pub mod curve;
pub mod examples;
pub mod fitted;
mod flex;
#[cfg(feature = "cuda")]
mod gpu;
pub mod kernels;
pub mod learning;
pub mod model;
pub mod network;
pub mod optimiser;
pub mod output;
pub mod params;
pub mod random;
pub mod recorded;
pub mod rollout;
pub mod run;
pub mod shape;
pub mod source;

pub use config::Config;
#[cfg(feature = "cuda")]
pub use gpu::{Gpu, try_gpu};
pub use output::Outcome;
pub use run::{Observer, Run};

use burn::backend::{Autodiff, Flex};

/// The CPU.
pub type Cpu = Autodiff<Flex>;
