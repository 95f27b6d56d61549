//! Journals of long work: a header line that says what the work is, then one line a finished part.
//!
//! A journal is appended to while the work runs. After an interruption the same work reads it and
//! goes on; other work is refused, with the first field of the header that differs.

use crate::error::{Error, FieldError, io_reason};
use crate::formats::{json, lock, open_regular, open_to_write};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// The longest line of a journal [bytes]; a part has some hundred.
const LONGEST_LINE: u64 = 1 << 20;

/// A journal's first line: all that the finished parts depend on.
pub trait Heading: Serialize + DeserializeOwned {
    /// Format of the journal.
    const FORMAT: &'static str;
    /// Name of the work, for messages.
    const WORK: &'static str;

    /// The format of this header.
    fn format(&self) -> &str;

    /// The first difference from what was `begun`, as field and reason.
    fn difference(&self, begun: &Self) -> Option<(&'static str, String)>;
}

/// A field of a header: its name, its value, and words for a value that tells a reader nothing.
pub(crate) type Fact = (&'static str, String, &'static str);

/// The first field that differs, and what the work was begun with there.
pub(crate) fn first_difference<const N: usize>(
    now: [Fact; N],
    begun: [Fact; N],
) -> Option<(&'static str, String)> {
    let mut pairs = now.into_iter().zip(begun);
    let ((field, now, words), (_, then, _)) = pairs.find(|(now, then)| now.1 != then.1)?;
    let what = if words.is_empty() { format!("{then}, not {now}") } else { words.into() };
    Some((field, what))
}

/// An open journal of parts `R`, locked against other programs.
pub struct Journal<R> {
    path: PathBuf,
    file: File,
    rows: PhantomData<fn(&R)>,
}

/// Check that refuses parts the work cannot have made, whatever program wrote them.
pub type Check<'a, R> = &'a dyn Fn(&R) -> Result<(), FieldError>;

impl<R: Serialize + DeserializeOwned> Journal<R> {
    /// Refuses a journal of other work, without changing anything. There need not be one.
    pub fn look<H: Heading>(path: &Path, header: &H, check: Check<'_, R>) -> Result<(), Error> {
        let mut each = |_, row: R| check(&row);
        match path.exists() {
            true => {
                let lines = BufReader::new(open_regular(path)?);
                read_lines(path, lines, header, &mut each).map(drop)
            }
            false => Ok(()),
        }
    }

    /// Opens or begins a journal, and reads the parts that are finished. A last line that was torn
    /// by a kill is cut off.
    pub fn open<H: Heading>(
        path: &Path,
        header: &H,
        check: Check<'_, R>,
    ) -> Result<(Self, Vec<R>), Error> {
        let mut rows = Vec::new();
        let journal = Self::open_each(path, header, &mut kept(check, &mut rows))?;
        Ok((journal, rows))
    }

    /// Opens or begins a journal and hands on each part as it is read, with its place. Memory holds
    /// one part.
    pub fn open_each<H: Heading>(
        path: &Path,
        header: &H,
        each: Each<'_, R>,
    ) -> Result<Self, Error> {
        let failed = |cause: std::io::Error| Error::output(path, &cause);
        let mut file = open_to_write(path)?;
        lock(path, &file, &format!("another {} is running in this directory", H::WORK))?;
        let whole = read_lines(path, BufReader::new(&file), header, each)?;
        file.set_len(whole).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let journal = Self { path: path.to_path_buf(), file, rows: PhantomData };
        if whole == 0 {
            journal.write_line(header)?;
        }
        Ok(journal)
    }

    /// The finished parts in what a journal holds, and the length of its whole lines [bytes]; `path` is its
    /// name. A last line that was torn does not count; any other that is no part is an error. Memory: the
    /// parts, and a line.
    pub fn parse<H: Heading>(
        path: &Path,
        lines: impl BufRead,
        header: &H,
        check: Check<'_, R>,
    ) -> Result<(Vec<R>, u64), Error> {
        let mut rows = Vec::new();
        let whole = read_lines(path, lines, header, &mut kept(check, &mut rows))?;
        Ok((rows, whole))
    }

    /// Adds a finished part. The line is in the system's hands when this returns, so that only a
    /// failure of the machine itself can lose it.
    pub fn append(&mut self, row: &R) -> Result<(), Error> {
        self.append_at(row).map(drop)
    }

    /// Adds a finished part and returns its place.
    pub fn append_at(&mut self, row: &R) -> Result<u64, Error> {
        let end = self.file.seek(SeekFrom::End(0));
        let end = end.map_err(|cause| Error::output(&self.path, &cause))?;
        self.write_line(row)?;
        Ok(end)
    }

    /// Reads the part at a place that [`Self::append_at`] or [`Self::open_each`] gave.
    pub fn read(&self, place: u64) -> Result<R, Error> {
        let failed = |cause: std::io::Error| Error::output(&self.path, &cause);
        (&self.file).seek(SeekFrom::Start(place)).map_err(failed)?;
        let line = next_line(&self.path, &mut BufReader::new(&self.file), 0)?.unwrap_or_default();
        json::parse_value(&line)
            .map_err(|error| within(&self.path, &format!("byte {place}"), error))
    }

    /// Empties the journal, header and all: nothing came of the work, and other work may begin. The file stays,
    /// since another program may wait for its lock.
    ///
    /// # Errors
    /// The journal with the reason why it cannot be written.
    pub fn clear(self) -> Result<(), Error> {
        self.file.set_len(0).map_err(|cause| Error::output(&self.path, &cause))
    }

    /// Gives everything to the disk, so that not even a failure of the machine loses it.
    pub fn sync(&self) -> Result<(), Error> {
        self.file.sync_all().map_err(|cause| Error::output(&self.path, &cause))
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

/// Receiver of each part that is read, with its place in the file.
pub type Each<'a, R> = &'a mut dyn FnMut(u64, R) -> Result<(), FieldError>;

/// Keeps each part that passes the check.
fn kept<'a, R>(
    check: Check<'a, R>,
    rows: &'a mut Vec<R>,
) -> impl FnMut(u64, R) -> Result<(), FieldError> + 'a {
    |_, row| {
        check(&row)?;
        rows.push(row);
        Ok(())
    }
}

/// Reads the parts of a journal; the length of its whole lines [bytes]. A last line that is not a part
/// was torn and does not count; any other is an error. Memory: a line.
fn read_lines<H: Heading, R: DeserializeOwned>(
    path: &Path,
    mut lines: impl BufRead,
    header: &H,
    each: Each<'_, R>,
) -> Result<u64, Error> {
    let mut whole = 0;
    for number in 1.. {
        let Some(line) = next_line(path, &mut lines, number)? else { break };
        let is_last = lines.fill_buf().map_err(|cause| Error::output(path, &cause))?.is_empty();
        if is_last && line.last() != Some(&b'\n') {
            break;
        }
        if number == 1 {
            let begun = json::parse_value(&line).map_err(|error| wrong(path, 1, error))?;
            agree(path, header, &begun)?;
        } else {
            match json::parse_value(&line) {
                Ok(row) => {
                    each(whole, row).map_err(|error| wrong(path, number, error))?;
                }
                Err(_) if is_last => break,
                Err(error) => return Err(wrong(path, number, error)),
            }
        }
        whole += line.len() as u64;
    }
    Ok(whole)
}

/// The next line with its end, none where there is no more.
pub(crate) fn next_line(
    path: &Path,
    lines: &mut impl BufRead,
    number: usize,
) -> Result<Option<Vec<u8>>, Error> {
    let mut line = Vec::new();
    let mut bounded = lines.take(LONGEST_LINE + 1);
    bounded.read_until(b'\n', &mut line).map_err(|cause| Error::output(path, &cause))?;
    if line.len() as u64 > LONGEST_LINE {
        let reason = format!("has more than {LONGEST_LINE} bytes");
        return Err(Error::input(path, format!("line {number}"), reason));
    }
    Ok(Some(line).filter(|line| !line.is_empty()))
}

/// An error of a part at a line.
pub(crate) fn wrong(path: &Path, line: usize, error: FieldError) -> Error {
    // The position that the parser adds is that within the line.
    within(path, &format!("line {line}"), error)
}

/// An error of a part at some place.
fn within(path: &Path, place: &str, error: FieldError) -> Error {
    let colon = if error.field.is_empty() { "" } else { ": " };
    Error::input(path, format!("{place}{colon}{}", error.field), error.reason)
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

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Serialize, Deserialize)]
    struct Header {
        format: String,
    }

    impl Heading for Header {
        const FORMAT: &'static str = "test/1";
        const WORK: &'static str = "test";

        fn format(&self) -> &str {
            &self.format
        }

        fn difference(&self, _: &Self) -> Option<(&'static str, String)> {
            None
        }
    }

    #[derive(Serialize, Deserialize)]
    struct Part {
        steps: [u32; 2],
    }

    #[test]
    fn a_part_with_an_array_too_long_is_refused_by_line_key_and_length() {
        let header = Header { format: "test/1".into() };
        let read = |second: &str| {
            let lines =
                format!("{{\"format\":\"test/1\"}}\n{{\"steps\":{second}}}\n{{\"steps\":[3,4]}}\n");
            Journal::<Part>::parse(Path::new("a"), lines.as_bytes(), &header, &|_| Ok(()))
                .map(|(parts, _)| parts.iter().map(|part| part.steps).collect::<Vec<_>>())
                .map_err(|error| error.to_string())
        };
        assert_eq!(read("[1,2]"), Ok(vec![[1, 2], [3, 4]]));
        for (second, count) in [("[1,2,9]", 3), ("[1]", 1)] {
            let error = read(second).unwrap_err();
            let expected =
                format!("a: line 2: steps: invalid length {count}, expected an array of length 2");
            assert!(error.starts_with(&expected), "{error}");
        }
    }
}
