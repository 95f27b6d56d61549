#![doc = include_str!("../README.md")]
//! ## Reading the code
//!
//! Data goes down this list, imports go up it: errors, checksum, noise, rows of a slice; the header, the
//! tensors of a file and the file as views ([`Model`]), its check in slices and a synthetic one; single
//! precision arithmetic and integer kernels; KV cache and scratch memory, linear maps, attention, blocks,
//! the decoders; [`Network`], which puts them together; bit flips for fault injection.
#![no_std]

mod arithmetic;
mod attention;
mod bit_flip;
mod block;
mod check;
mod crc;
mod decoder;
mod element;
mod error;
mod header;
mod kernels;
mod layout;
mod linear;
mod memory;
mod model;
mod network;
mod noise;
mod rows;
mod synthetic;
#[cfg(test)]
mod tests;

pub use bit_flip::{BitFlip, FaultyMemory, Part};
pub use check::Check;
pub use crc::Crc32;
pub use element::Element;
pub use error::{ModelError, NetworkError};
pub use header::{
    ACTION, Decoder, Dimensions, Header, Layout, MAGIC, Precision, Provenance, VERSION,
    VERSION_OF_ANY_ACTION, limit, seen,
};
pub use kernels::{Kernel, TILE};
pub use layout::{Element as TensorElement, Tensor, TensorName, tensors};
pub use memory::{Memory, ReferenceMemory, Storage};
pub use model::Model;
pub use network::Network;
pub use synthetic::{synthetic_model, write_header};
