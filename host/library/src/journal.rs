//! Journals of long work: a header line that says what the work is, then one line a finished part.
//!
//! A journal is appended to while the work runs. After an interruption the same work reads it and
//! goes on; other work is refused, with the first field of the header that differs.

use crate::error::{Error, io_reason};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A journal's first line: all that the finished parts depend on.
pub trait Heading: Serialize + DeserializeOwned {
    /// Format of the journal.
    const FORMAT: &'static str;
    /// What the work is called.
    const WORK: &'static str;

    /// The format of this header.
    fn format(&self) -> &str;

    /// The first difference from what was `begun`, as field and reason.
    fn difference(&self, begun: &Self) -> Option<(&'static str, String)>;
}

/// An open journal of parts `R`, locked against other programs.
pub struct Journal<R> {
    path: PathBuf,
    file: File,
    rows: PhantomData<fn(&R)>,
}

impl<R: Serialize + DeserializeOwned> Journal<R> {
    /// Refuses a journal of other work, without changing anything. There need not be one.
    pub fn look<H: Heading>(path: &Path, header: &H) -> Result<(), Error> {
        match std::fs::read(path) {
            Ok(bytes) => read_lines::<H, R>(path, &bytes, header).map(drop),
            Err(_) => Ok(()),
        }
    }

    /// Opens or begins a journal, and reads the parts that are finished. A last line that was torn
    /// by a kill is cut off.
    pub fn open<H: Heading>(path: &Path, header: &H) -> Result<(Self, Vec<R>), Error> {
        let failed = |cause: std::io::Error| Error::output(path, &cause);
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(path).map_err(failed)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => {
                let reason = format!("another {} is running in this directory", H::WORK);
                Error::input(path, "", reason)
            }
            TryLockError::Error(cause) => failed(cause),
        })?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let (rows, whole) = read_lines(path, &bytes, header)?;
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let journal = Self { path: path.to_path_buf(), file, rows: PhantomData };
        if whole == 0 {
            journal.write_line(header)?;
        }
        Ok((journal, rows))
    }

    /// Adds a finished part. The line is in the system's hands when this returns, so that only a
    /// failure of the machine itself can lose it.
    pub fn append(&mut self, row: &R) -> Result<(), Error> {
        self.write_line(row)
    }

    fn write_line(&self, value: &impl Serialize) -> Result<(), Error> {
        let write = || {
            let mut line = serde_json::to_vec(value)?;
            line.push(b'\n');
            (&self.file).write_all(&line)
        };
        write()
            .map_err(|cause| Error::Output { file: self.path.clone(), reason: io_reason(&cause) })
    }
}

/// The parts of a journal, and the length of its whole lines. A last line that is not a part was
/// torn and does not count; any other is an error.
fn read_lines<H: Heading, R: DeserializeOwned>(
    path: &Path,
    bytes: &[u8],
    header: &H,
) -> Result<(Vec<R>, usize), Error> {
    let mut lines = bytes.split_inclusive(|byte| *byte == b'\n').enumerate().peekable();
    let (mut rows, mut whole) = (Vec::new(), 0);
    while let Some((i, line)) = lines.next() {
        let torn = lines.peek().is_none();
        if torn && line.last() != Some(&b'\n') {
            break;
        }
        if i == 0 {
            let begun = serde_json::from_slice(line).map_err(|error| wrong(path, 1, &error))?;
            agree(path, header, &begun)?;
        } else {
            match serde_json::from_slice(line) {
                Ok(row) => rows.push(row),
                Err(_) if torn => break,
                Err(error) => return Err(wrong(path, i + 1, &error)),
            }
        }
        whole += line.len();
    }
    Ok((rows, whole))
}

fn wrong(path: &Path, line: usize, error: &serde_json::Error) -> Error {
    // The position that the parser adds is that within the line.
    Error::input(path, format!("line {line}"), error.to_string())
}

/// Refuses to go on with work that was begun with something else.
fn agree<H: Heading>(path: &Path, header: &H, begun: &H) -> Result<(), Error> {
    if begun.format() != H::FORMAT {
        let reason = format!("unknown format {:?}: expected {:?}", begun.format(), H::FORMAT);
        return Err(Error::input(path, "format", reason));
    }
    match header.difference(begun) {
        Some((field, reason)) => Err(Error::input(path, field, reason)),
        None => Ok(()),
    }
}
