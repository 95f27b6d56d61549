//! Rows of finished work, as lines of JSON: header, further entries, the rows in their order, an
//! end. The end has their number and the checksums of rows and tables, which show damage.

use crate::error::{Error, FieldError, io_reason};
use crate::fingerprint::Fnv;
use crate::formats::{json, open_regular, write_as_it_comes};
use crate::journal::{Heading, next_line, wrong};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Statements about rows beside their header, by keys.
pub type Entries = BTreeMap<String, String>;

/// Beginning of the last line, which no row has.
const END: &[u8] = b"{\"rows\":";

/// Bytes of a table that are read at once.
const PIECE: usize = 1 << 16;

/// The last line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct End {
    /// Number of rows.
    rows: u64,
    /// FNV-1a of all bytes before this line.
    checksum: String,
    /// FNV-1a of the tables that were made of the rows, by their names in the same directory.
    tables: BTreeMap<String, String>,
}

/// Writes rows as they come, whole or not at all; `tables` are those made of them beside the file.
///
/// # Errors
/// A table that cannot be read; a row that could not be had; the file that cannot be written.
pub fn write<R: Serialize>(
    file: &Path,
    header: &impl Serialize,
    entries: &Entries,
    tables: &[PathBuf],
    rows: impl Iterator<Item = Result<R, Error>>,
) -> Result<(), Error> {
    let name =
        |table: &PathBuf| table.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let tables: Result<BTreeMap<String, String>, Error> =
        tables.iter().map(|table| Ok((name(table), checksum_of(table)?))).collect();
    let tables = tables?;
    write_as_it_comes(file, |handle| {
        let mut out = Out { sink: BufWriter::new(handle), hash: Fnv::default() };
        out.line(header)?;
        out.line(entries)?;
        let mut count = 0;
        for row in rows {
            out.line(&row.map_err(io::Error::other)?)?;
            count += 1;
        }
        let checksum = out.hash.to_string();
        out.line(&End { rows: count, checksum, tables })?;
        out.sink.flush()
    })
}

/// Lines that are written, with their checksum.
struct Out<W: Write> {
    sink: W,
    hash: Fnv,
}

impl<W: Write> Out<W> {
    fn line(&mut self, value: &impl Serialize) -> io::Result<()> {
        let mut line = serde_json::to_vec(value)?;
        line.push(b'\n');
        self.hash.add(&line);
        self.sink.write_all(&line)
    }
}

/// FNV-1a of a file's bytes.
fn checksum_of(file: &Path) -> Result<String, Error> {
    let failed = |cause: io::Error| Error::input(file, "", io_reason(&cause));
    let mut handle = open_regular(file)?;
    let (mut hash, mut piece) = (Fnv::default(), vec![0; PIECE]);
    loop {
        match handle.read(&mut piece).map_err(failed)? {
            0 => return Ok(hash.to_string()),
            length => hash.add(&piece[..length]),
        }
    }
}

/// A file of rows, of which header and entries have been read. Memory: a line.
pub struct RowsFile<H, B = BufReader<File>> {
    /// Header: all that the rows depend on.
    pub header: H,
    /// Further entries on the rows, by key.
    entries: Entries,
    lines: Lines<B>,
}

/// Lines that are read, with their checksum.
struct Lines<B> {
    path: PathBuf,
    from: B,
    hash: Fnv,
    /// Number of the line that was read last.
    number: usize,
}

impl<B: BufRead> Lines<B> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, Error> {
        self.number += 1;
        let line = next_line(&self.path, &mut self.from, self.number)?;
        if line.as_ref().is_some_and(|line| line.last() != Some(&b'\n')) {
            return Err(self.wrong(FieldError::new("", "is cut off")));
        }
        Ok(line)
    }

    /// The next line, which counts for the checksum and must be there.
    fn counted(&mut self) -> Result<Vec<u8>, Error> {
        let reason = "ends before its last line: the file is damaged";
        let line = self.read()?.ok_or_else(|| Error::input(&self.path, "", reason))?;
        if !line.starts_with(END) {
            self.hash.add(&line);
        }
        Ok(line)
    }

    fn value<T: DeserializeOwned>(&mut self) -> Result<T, Error> {
        let line = self.counted()?;
        json::parse_value(&line).map_err(|error| self.wrong(error))
    }

    fn wrong(&self, error: FieldError) -> Error {
        wrong(&self.path, self.number, error)
    }
}

impl<H: Heading> RowsFile<H> {
    /// Opens a file and reads its header and entries.
    ///
    /// # Errors
    /// A file that cannot be read or is of another format.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::of(path, BufReader::new(open_regular(path)?))
    }
}

impl<H: Heading, B: BufRead> RowsFile<H, B> {
    /// Reads header and entries from the contents of a file called `path`.
    ///
    /// # Errors
    /// Contents that cannot be read or are of another format.
    pub fn of(path: &Path, from: B) -> Result<Self, Error> {
        let mut lines = Lines { path: path.into(), from, hash: Fnv::default(), number: 0 };
        let header: H = lines.value()?;
        if header.format() != H::FORMAT {
            let reason = format!("unknown format {:?}: expected {:?}", header.format(), H::FORMAT);
            return Err(Error::input(path, "format", reason));
        }
        let entries = lines.value()?;
        Ok(Self { header, entries, lines })
    }

    /// The entry on the rows under `key`, parsed from JSON.
    ///
    /// # Errors
    /// A file without the entry, or with one that does not parse.
    pub fn said<T: DeserializeOwned>(&self, key: &str) -> Result<T, Error> {
        let file = &self.lines.path;
        let text = self.entries.get(key).ok_or_else(|| Error::input(file, key, "is missing"))?;
        json::parse_value(text.as_bytes()).map_err(|error| {
            let dot = if error.field.is_empty() { "" } else { "." };
            Error::input(file, format!("{key}{dot}{}", error.field), error.reason)
        })
    }

    /// Hands each row on; then number and checksums must be right. How many there are.
    ///
    /// # Errors
    /// A line that is no row or is refused; a file, or a table made of its rows, that is not as it was written.
    pub fn each<R: DeserializeOwned>(
        mut self,
        mut each: impl FnMut(R) -> Result<(), FieldError>,
    ) -> Result<u64, Error> {
        let mut count = 0;
        loop {
            let line = self.lines.counted()?;
            if line.starts_with(END) {
                return self.end(&line, count).map(|()| count);
            }
            let taken = json::parse_value(&line).and_then(&mut each);
            taken.map_err(|error| self.lines.wrong(error))?;
            count += 1;
        }
    }

    fn end(mut self, line: &[u8], rows: u64) -> Result<(), Error> {
        let end: End = json::parse_value(line).map_err(|error| self.lines.wrong(error))?;
        let refused =
            |field: &str, reason: String| Err(Error::input(&self.lines.path, field, reason));
        if end.rows != rows {
            return refused("rows", format!("is {}, and there are {rows}", end.rows));
        }
        if end.checksum != self.lines.hash.to_string() {
            return refused("checksum", "does not match the rows: the file is damaged".into());
        }
        for (name, checksum) in &end.tables {
            if Path::new(name).file_name() != Some(name.as_ref()) {
                return refused("tables", format!("{name:?} is no name of a file"));
            }
            let table = self.lines.path.with_file_name(name);
            if checksum_of(&table)? != *checksum {
                let reason = "is not as it was written: its checksum is another";
                return Err(Error::input(&table, "", reason));
            }
        }
        match self.lines.read()? {
            None => Ok(()),
            Some(_) => Err(self.lines.wrong(FieldError::new("", "stands behind the end"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
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

    fn written(directory: &Path) -> PathBuf {
        let (file, table) = (directory.join("a.jsonl"), directory.join("a.parquet"));
        std::fs::write(&table, "a table").unwrap();
        let header = Header { format: "test/1".into() };
        let entries = Entries::from([("b".into(), "[7]".into())]);
        let rows = (0..3u64).map(|i| Ok([i, 10]));
        write(&file, &header, &entries, &[table], rows).unwrap();
        file
    }

    fn read(file: &Path) -> Result<Vec<[u64; 2]>, String> {
        let told = |error: Error| error.to_string();
        let mut rows = Vec::new();
        RowsFile::<Header>::open(file)
            .and_then(|opened| {
                opened.each(|row| {
                    rows.push(row);
                    Ok(())
                })
            })
            .map_err(told)?;
        Ok(rows)
    }

    #[test]
    fn what_was_written_is_read_again() {
        let dir = tempfile::tempdir().unwrap();
        let file = written(dir.path());
        assert_eq!(read(&file), Ok(vec![[0, 10], [1, 10], [2, 10]]));
        let opened = RowsFile::<Header>::open(&file).unwrap();
        assert_eq!(opened.header, Header { format: "test/1".into() });
        assert_eq!(opened.said::<Vec<u32>>("b").unwrap(), [7]);
        let error = opened.said::<Vec<u32>>("c").unwrap_err().to_string();
        assert!(error.ends_with("a.jsonl: c: is missing"), "{error}");
        let failed = Err::<u64, _>(Error::Scenario { id: "x".into(), reason: "is gone".into() });
        let other = dir.path().join("b.jsonl");
        let error = write(&other, &7, &Entries::new(), &[], [failed].into_iter()).unwrap_err();
        assert!(error.to_string().contains("is gone") && !other.exists(), "{error}");
    }

    // Verifies REM-IO-005.
    #[test]
    fn each_kind_of_damage_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = written(dir.path());
        let whole = std::fs::read_to_string(&file).unwrap();
        let reason = |text: &str| {
            std::fs::write(&file, text).unwrap();
            let error = read(&file).unwrap_err();
            error.split_once("a.jsonl: ").map(|(_, reason)| reason.to_string()).unwrap_or(error)
        };
        let lines: Vec<&str> = whole.split_inclusive('\n').collect();
        let damaged = "checksum: does not match the rows: the file is damaged";
        let ends = "ends before its last line: the file is damaged";
        assert_eq!(reason(""), ends);
        assert_eq!(reason(&lines[..1].concat()), ends);
        assert_eq!(reason(&lines[..5].concat()), ends);
        assert_eq!(reason(&whole[..whole.len() - 1]), "line 6: is cut off");
        assert_eq!(
            reason(&whole.replacen("test/1", "test/2", 1)),
            "format: unknown format \"test/2\": expected \"test/1\""
        );
        assert_eq!(reason(&whole.replacen("[7]", "[8]", 1)), damaged);
        assert_eq!(reason(&whole.replacen("[1,10]", "[1,11]", 1)), damaged);
        assert_eq!(reason(&whole.replacen("[1,10]\n", "", 1)), "rows: is 3, and there are 2");
        let swapped = [lines[0], lines[1], lines[3], lines[2], lines[4], lines[5]].concat();
        assert_eq!(reason(&swapped), damaged);
        assert_eq!(reason(&format!("{whole}[3,10]\n")), "line 7: stands behind the end");
        let long = reason(&whole.replacen("[1,10]", "[1,10,3]", 1));
        assert!(long.starts_with("line 4: "), "{long}");
        let away = reason(&whole.replacen("a.parquet", "../a.parquet", 1));
        assert_eq!(away, "tables: \"../a.parquet\" is no name of a file");
        std::fs::write(&file, &whole).unwrap();
        assert!(read(&file).is_ok());
        std::fs::write(dir.path().join("a.parquet"), "a table!").unwrap();
        let error = read(&file).unwrap_err();
        assert!(error.ends_with("a.parquet: is not as it was written: its checksum is another"));
        std::fs::remove_file(dir.path().join("a.parquet")).unwrap();
        assert!(read(&file).unwrap_err().ends_with("a.parquet: no such file or directory"));
    }

    /// Wherever a byte is another, the file is refused.
    // Verifies REM-IO-005.
    #[test]
    fn damage_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let file = written(dir.path());
        let whole = std::fs::read(&file).unwrap();
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut bytes = whole.clone();
                bytes[at] ^= 1 << bit;
                std::fs::write(&file, bytes).unwrap();
                assert!(read(&file).is_err(), "{at} {bit}");
            }
        }
    }
}
