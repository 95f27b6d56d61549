//! The check of a model file, slice by slice.

use super::crc::Crc32;
use super::error::ModelError;
use super::model::Model;

/// A check of a model file's checksum, slice by slice.
///
/// [`Model::open`] reads the whole file at once. A cyclic executive instead steps through the check and
/// then calls [`Check::open`]. Restarted and stepped between plans, the same check scrubs the memory of
/// an open model.
///
/// It borrows the file, so that no code can change what was checked; only the memory itself can.
#[derive(Clone, Copy, Debug)]
pub struct Check<'a> {
    bytes: &'a [u8],
    crc: Crc32,
    at: usize,
}

impl<'a> Check<'a> {
    /// A check that has read nothing yet.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, crc: Crc32::new(), at: 0 }
    }

    /// Reads at most `most` bytes; returns the verdict once all are read. Cost: one table look-up a
    /// byte.
    pub fn step(&mut self, most: usize) -> Option<Result<(), ModelError>> {
        let length = self.left().min(most);
        let slice = self.bytes.get(self.at..).and_then(|rest| rest.get(..length));
        self.crc.update(slice.unwrap_or_default());
        self.at += length;
        self.verdict()
    }

    /// Number of bytes not yet read.
    pub fn left(&self) -> usize {
        self.covered().saturating_sub(self.at)
    }

    /// The verdict once all bytes are read: `Ok`, or [`ModelError::Crc`]; [`ModelError::Missing`] where
    /// the file is too short for a checksum.
    pub fn verdict(&self) -> Option<Result<(), ModelError>> {
        let Some((_, stored)) = self.bytes.split_last_chunk::<4>() else {
            return Some(Err(ModelError::Missing));
        };
        let sound = self.crc.value() == u32::from_le_bytes(*stored);
        (self.left() == 0).then_some(if sound { Ok(()) } else { Err(ModelError::Crc) })
    }

    /// Starts the check again from the first byte.
    pub fn restart(&mut self) {
        *self = Self::new(self.bytes);
    }

    /// Opens the file without reading it again. Cost: header and views, microseconds.
    ///
    /// # Errors
    /// [`ModelError::Unchecked`] before the end of the check, then those of [`Model::open`].
    pub fn open(&self) -> Result<Model<'a>, ModelError> {
        match self.verdict() {
            None => Err(ModelError::Unchecked),
            Some(_) => Model::open_with(self.bytes, |_| self.crc.value()),
        }
    }

    /// Number of bytes that the checksum covers: all but its own.
    fn covered(&self) -> usize {
        self.bytes.len().saturating_sub(4)
    }
}
