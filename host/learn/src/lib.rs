//! Learned starts: trajectories to train on, quantisation, the paper's tables. Training itself is the
//! workspace `host/learn/training`.
//!
//! Data goes down this list, imports go up it:
//!
//! - [`dataset`]: trajectories to train on, from a seed, in shards;
//! - [`quantise`]: models from single precision to bytes;
//! - [`reproduce`]: the paper's tables for learned starts.
#![forbid(unsafe_code)]

pub mod dataset;
pub mod quantise;
pub mod reproduce;
