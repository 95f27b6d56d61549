//! Models: `*.model`. The core owns the format (`remora_core::advanced::nn`, described in
//! `docs/reference/model-file.md`) and reads it where it lies; here files are put together and taken apart,
//! tensor by tensor.

use super::{Kind, Limit, write_atomically};
use crate::error::{Error, FieldError};
use remora_core::advanced::nn::{
    Crc32, Header, Model, Precision, Tensor, TensorElement, tensors, write_header,
};
use std::path::Path;

/// Room for any header: its strings are short.
const HEADER_BYTES: usize = 1024;

/// The numbers of a tensor, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Single precision.
    F32(Vec<f32>),
    /// Signed bytes.
    Int8(Vec<i8>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::Int8(values) => values.len(),
        }
    }
}

/// A tensor of a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedTensor {
    /// Its name, such as `block.0.qkv.weight`.
    pub name: String,
    /// Rows.
    pub rows: usize,
    /// Numbers of a row.
    pub columns: usize,
    /// The numbers.
    pub values: Values,
}

/// A model file in parts, all of its tensors there.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFile {
    header: Header,
    tensors: Vec<NamedTensor>,
}

/// The tensors that a file with this header has, in their order.
///
/// # Errors
/// The reason why the header is refused.
pub fn model_layout(header: &Header) -> Result<Vec<Tensor>, FieldError> {
    let mut all = Vec::new();
    tensors(header, |tensor| all.push(tensor))
        .map_err(|e| FieldError::new("header", e.reason()))?;
    Ok(all)
}

/// A model file in the making.
#[derive(Clone, Debug)]
pub struct ModelBuilder {
    header: Header,
    layout: Vec<Tensor>,
    values: Vec<Option<Values>>,
}

impl ModelBuilder {
    /// A file of this header, without tensors yet.
    ///
    /// # Errors
    /// The reason why the header is refused.
    pub fn new(header: Header) -> Result<Self, FieldError> {
        let layout = model_layout(&header)?;
        let values = vec![None; layout.len()];
        Ok(Self { header, layout, values })
    }

    /// Puts in a tensor, row by row; its numbers must be as many as its shape says, and finite.
    ///
    /// # Errors
    /// A name that is unknown or values that do not fit, with the reason.
    pub fn set(&mut self, name: &str, values: Values) -> Result<(), FieldError> {
        let refuse = |reason: String| Err(FieldError::new(name, reason));
        let place = self.layout.iter().position(|tensor| tensor.name.to_string() == name);
        let Some((tensor, slot)) =
            place.and_then(|i| self.layout.get(i).zip(self.values.get_mut(i)))
        else {
            return refuse("no such tensor".into());
        };
        let (rows, columns) = (tensor.rows, tensor.columns);
        match (&values, tensor.element) {
            (Values::F32(numbers), TensorElement::F32) => {
                if let Some(odd) = numbers.iter().find(|x| !x.is_finite()) {
                    return refuse(format!("holds {odd}"));
                }
            }
            (Values::Int8(_), TensorElement::Int8) => {}
            (_, element) => return refuse(format!("must be {element:?}")),
        }
        if values.len() != rows * columns {
            return refuse(format!("has {} numbers, not {rows} x {columns}", values.len()));
        }
        *slot = Some(values);
        Ok(())
    }

    /// [`ModelBuilder::set`] for single precision.
    ///
    /// # Errors
    /// Likewise.
    pub fn set_f32(&mut self, name: &str, values: &[f32]) -> Result<(), FieldError> {
        self.set(name, Values::F32(values.to_vec()))
    }

    /// The file.
    ///
    /// # Errors
    /// The first tensor that is missing.
    pub fn finish(self) -> Result<ModelFile, FieldError> {
        let mut tensors = Vec::new();
        for (tensor, values) in self.layout.iter().zip(self.values) {
            let name = tensor.name.to_string();
            let Some(values) = values else { return Err(FieldError::new(name, "is missing")) };
            tensors.push(NamedTensor { name, rows: tensor.rows, columns: tensor.columns, values });
        }
        Ok(ModelFile { header: self.header, tensors })
    }
}

impl ModelFile {
    /// Takes a file apart.
    ///
    /// # Errors
    /// The reason why the core refuses it.
    pub fn parse(bytes: &[u8]) -> Result<Self, FieldError> {
        let model = Model::open(bytes).map_err(|e| FieldError::new("", e.reason()))?;
        let header = model.header().clone();
        let layout = model_layout(&header)?;
        // All that is checked: the tensors end where the checksum begins.
        let length: usize = layout.iter().map(Tensor::bytes).sum();
        let end = bytes.len().saturating_sub(size_of::<u32>());
        let mut rest = bytes.get(end.saturating_sub(length)..end).unwrap_or_default();
        let mut tensors = Vec::new();
        for tensor in layout {
            let (here, others) = rest.split_at_checked(tensor.bytes()).unwrap_or_default();
            rest = others;
            let values = match tensor.element {
                TensorElement::Int8 => Values::Int8(here.iter().map(|byte| *byte as i8).collect()),
                TensorElement::F32 => {
                    let numbers = here.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
                    Values::F32(numbers.collect())
                }
            };
            let name = tensor.name.to_string();
            let (rows, columns) = (tensor.rows, tensor.columns);
            tensors.push(NamedTensor { name, rows, columns, values });
        }
        Ok(Self { header, tensors })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// File and reason.
    pub fn read(file: &Path) -> Result<Self, Error> {
        Kind::Model.read(file, Limit::BINARY, Self::parse)
    }

    /// The header, in which the file describes itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// All tensors in their order.
    pub fn tensors(&self) -> &[NamedTensor] {
        &self.tensors
    }

    /// A tensor by its name.
    pub fn tensor(&self, name: &str) -> Option<&NamedTensor> {
        self.tensors.iter().find(|tensor| tensor.name == name)
    }

    /// Whether its weights are bytes.
    pub fn is_quantised(&self) -> bool {
        self.header.precision == Precision::Int8
    }

    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; HEADER_BYTES];
        let length = write_header(&self.header, &mut bytes).expect("headers are short");
        bytes.truncate(length);
        for tensor in &self.tensors {
            match &tensor.values {
                Values::F32(numbers) => bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes())),
                Values::Int8(numbers) => bytes.extend(numbers.iter().map(|x| *x as u8)),
            }
        }
        bytes.extend(Crc32::of(&bytes).to_le_bytes());
        bytes
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// File and reason.
    pub fn write(&self, file: &Path) -> Result<(), Error> {
        write_atomically(file, &self.bytes())
    }
}
