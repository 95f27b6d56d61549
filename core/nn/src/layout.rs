//! Names and shapes of a model file's tensors in their order, for writers and inspection.

use super::error::ModelError;
use super::header::{Decoder, Header, Precision};
use core::fmt;

/// How a tensor's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// Signed bytes.
    Int8,
    /// IEEE single precision, little endian, not aligned.
    F32,
}

impl Element {
    /// Bytes of one number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Int8 => 1,
            Self::F32 => 4,
        }
    }
}

/// A tensor's name; its text, such as `block.0.qkv.weight`, is what [`fmt::Display`] writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TensorName {
    group: &'static str,
    index: Option<usize>,
    part: &'static str,
    field: &'static str,
}

impl TensorName {
    /// Its last word: `weight`, `scale`, `bias`, `gain`, `embedding`, `mean` or `std`.
    pub const fn field(&self) -> &'static str {
        self.field
    }
}

impl fmt::Display for TensorName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.group)?;
        if let Some(index) = self.index {
            write!(f, ".{index}")?;
        }
        for name in [self.part, self.field] {
            if !name.is_empty() {
                write!(f, ".{name}")?;
            }
        }
        Ok(())
    }
}

/// A tensor: its name and shape, rows of `columns` numbers one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tensor {
    /// Name.
    pub name: TensorName,
    /// Rows.
    pub rows: usize,
    /// Numbers of a row.
    pub columns: usize,
    /// How they are stored.
    pub element: Element,
}

impl Tensor {
    /// Bytes in the file.
    pub const fn bytes(&self) -> usize {
        self.rows * self.columns * self.element.bytes()
    }
}

/// Calls `visit` with every tensor of a file with this header, in the file's order.
///
/// # Errors
/// Those of [`Header::dimensions`].
pub fn tensors(header: &Header, mut visit: impl FnMut(Tensor)) -> Result<(), ModelError> {
    let size = header.dimensions()?;
    let (w, a) = (size.width, size.actions);
    let mut walk = Walk { precision: header.precision, visit: &mut visit };

    walk.float(("input", None, ""), "mean", [1, size.features]);
    walk.float(("input", None, ""), "std", [1, size.features]);
    walk.float(("action", None, ""), "mean", [1, size.action]);
    walk.float(("action", None, ""), "std", [1, size.action]);
    for (token_type, inputs) in header.token_types.iter().enumerate() {
        walk.float(("embed", Some(token_type), ""), "weight", [usize::from(*inputs), w]);
        walk.float(("embed", Some(token_type), ""), "bias", [1, w]);
    }
    walk.float(("node", None, ""), "embedding", [size.nodes, w]);
    walk.norm(("embed", None, "norm"), w);
    for layer in 0..size.layers {
        walk.norm(("block", Some(layer), "norm1"), w);
        walk.linear(("block", Some(layer), "qkv"), [3 * w, w]);
        walk.linear(("block", Some(layer), "out"), [w, w]);
        walk.norm(("block", Some(layer), "norm2"), w);
        walk.linear(("block", Some(layer), "up"), [4 * w, w]);
        walk.linear(("block", Some(layer), "down"), [w, 4 * w]);
    }
    walk.norm(("norm", None, ""), w);
    match header.decoder {
        Decoder::Linear => {
            walk.float(("head", None, ""), "weight", [a, w]);
            walk.float(("head", None, ""), "bias", [1, a]);
        }
        Decoder::Flow { .. } => {
            walk.linear(("flow", None, "latent"), [2 * w, w]);
            walk.float(("flow", None, "action"), "weight", [a + 1, 2 * w]);
            walk.linear(("flow", None, "hidden"), [2 * w, 2 * w]);
            walk.float(("flow", None, "out"), "weight", [a, 2 * w]);
            walk.float(("flow", None, "out"), "bias", [1, a]);
        }
    }
    Ok(())
}

struct Walk<'v, V> {
    precision: Precision,
    visit: &'v mut V,
}

type Place = (&'static str, Option<usize>, &'static str);

impl<V: FnMut(Tensor)> Walk<'_, V> {
    fn tensor(&mut self, place: Place, field: &'static str, shape: [usize; 2], element: Element) {
        let (group, index, part) = place;
        let name = TensorName { group, index, part, field };
        let [rows, columns] = shape;
        (self.visit)(Tensor { name, rows, columns, element });
    }

    fn float(&mut self, place: Place, field: &'static str, shape: [usize; 2]) {
        self.tensor(place, field, shape, Element::F32);
    }

    fn norm(&mut self, place: Place, width: usize) {
        self.float(place, "gain", [1, width]);
        self.float(place, "bias", [1, width]);
    }

    fn linear(&mut self, place: Place, shape: [usize; 2]) {
        match self.precision {
            Precision::Int8 => {
                self.tensor(place, "weight", shape, Element::Int8);
                self.float(place, "scale", [1, shape[0]]);
            }
            Precision::F32 => self.float(place, "weight", shape),
        }
        self.float(place, "bias", [1, shape[0]]);
    }
}
