#![doc = include_str!("../README.md")]
#![no_std]

mod arithmetic;
mod attention;
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
mod specimen;
#[cfg(test)]
mod tests;
mod upset;

pub use check::Check;
pub use crc::Crc32;
pub use element::Element;
pub use error::{ModelError, NetworkError};
pub use header::{
    ACTION, Decoder, Dimensions, Header, Layout, MAGIC, Precision, Provenance, VERSION, limit,
};
pub use kernels::{Kernel, TILE};
pub use layout::{Element as TensorElement, Tensor, TensorName, tensors};
pub use memory::{Memory, ReferenceMemory, Storage};
pub use model::Model;
pub use network::Network;
pub use specimen::{specimen, write_header};
pub use upset::{Part, Strike, Upset};
