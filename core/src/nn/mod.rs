//! The quantised transformer: a model file in read-only memory, the kernels that multiply bytes, a
//! roll-out token by token with its keys and values remembered, and the heads that make actions.
//!
//! Nothing here knows what the features mean: that is for whoever makes them. `docs/model.md`
//! describes the file, the network and what it costs.

mod arithmetic;
mod attention;
mod check;
mod crc;
mod decoder;
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

pub use attention::Element;
pub use check::Check;
pub use crc::Crc32;
pub use error::{ModelError, NetworkError};
pub use header::{
    ACTION, Action, Decoder, Dimensions, Encoding, Header, Layout, MAGIC, Precision, Provenance,
    VERSION, limit,
};
pub use kernels::{Kernel, TILE};
pub use layout::{Element as TensorElement, Tensor, TensorName, tensors};
pub use memory::{Memory, ReferenceMemory, Storage};
pub use model::Model;
pub use network::Network;
pub use specimen::{specimen, write_header};
pub use upset::{Part, Strike, Upset};
