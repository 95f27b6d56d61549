//! Learned starts: trajectories to train on, training, quantisation, the paper's tables.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`dataset`]: trajectories to train on, from a seed, in shards;
//! - [`quantise`]: models from single precision to bytes;
//! - `training`, with the feature of that name: networks for the learned start;
//! - [`reproduce`]: the paper's tables for learned starts.
#![forbid(unsafe_code)]

pub mod dataset;
pub mod quantise;
pub mod reproduce;
#[cfg(feature = "training")]
pub mod training;
