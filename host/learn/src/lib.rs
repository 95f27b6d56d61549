//! Learned starts: trajectories to train on, training, quantisation, the paper's tables.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`dataset`]: trajectories to train on, from a seed, in shards;
//! - [`quantise`]: models from single precision to bytes;
//! - `training`, with the feature of that name: networks for the learned start;
//! - [`reproduce`]: the paper's tables for learned starts;
//! - `learning`, with that feature: all of it for a mission, from nothing to a model that was tested.
#![forbid(unsafe_code)]

pub mod dataset;
#[cfg(feature = "training")]
pub mod learning;
pub mod quantise;
pub mod reproduce;
#[cfg(feature = "training")]
pub mod training;
