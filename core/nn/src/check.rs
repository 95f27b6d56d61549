//! The check of a model file in slices.

use super::crc::Crc32;
use super::error::ModelError;
use super::model::Model;

/// A check of a model file's checksum, a slice at a time.
///
/// [`Model::open`] passes over the whole file. Where that is too long for one turn of a cyclic
/// executive, step through it and open what was found sound. The same check, begun anew and
/// stepped between plans, tells whether memory that was sound when the model was opened still is.
///
/// It borrows the file: what it has seen cannot change by any code of the program until the verdict
/// is used, only by the memory itself.
#[derive(Clone, Copy, Debug)]
pub struct Check<'a> {
    bytes: &'a [u8],
    crc: Crc32,
    at: usize,
}

impl<'a> Check<'a> {
    /// A check of which nothing is done yet.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, crc: Crc32::new(), at: 0 }
    }

    /// Goes on by at most so many bytes; the verdict, once there is one. Cost: one table look-up a
    /// byte. With zero bytes it goes nowhere.
    pub fn step(&mut self, most: usize) -> Option<Result<(), ModelError>> {
        let length = self.left().min(most);
        let slice = self.bytes.get(self.at..).and_then(|rest| rest.get(..length));
        self.crc.update(slice.unwrap_or_default());
        self.at += length;
        self.verdict()
    }

    /// Bytes that are left to be checked.
    pub fn left(&self) -> usize {
        self.covered().saturating_sub(self.at)
    }

    /// Whether the file is the one that was written, once all of it has been seen: nothing wrong,
    /// or [`ModelError::Crc`]; [`ModelError::Missing`] where there is no room for a checksum.
    pub fn verdict(&self) -> Option<Result<(), ModelError>> {
        let Some((_, stored)) = self.bytes.split_last_chunk::<4>() else {
            return Some(Err(ModelError::Missing));
        };
        let sound = self.crc.value() == u32::from_le_bytes(*stored);
        (self.left() == 0).then_some(if sound { Ok(()) } else { Err(ModelError::Crc) })
    }

    /// Begins anew.
    pub fn restart(&mut self) {
        *self = Self::new(self.bytes);
    }

    /// Opens the file without another pass over it. Cost: header and views, microseconds.
    ///
    /// # Errors
    /// [`ModelError::Unchecked`] before the end of the check, then those of [`Model::open`].
    pub fn open(&self) -> Result<Model<'a>, ModelError> {
        match self.verdict() {
            None => Err(ModelError::Unchecked),
            Some(_) => Model::open_with(self.bytes, |_| self.crc.value()),
        }
    }

    /// Bytes that the checksum covers: all but its own.
    fn covered(&self) -> usize {
        self.bytes.len().saturating_sub(4)
    }
}
