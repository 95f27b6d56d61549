//! Reading files: regular ones only, and no more of them than their kind may have.

use crate::error::{Error, FieldError, io_reason};
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// The most that a file of some kind may have [bytes]. Far above what is ever needed, and low enough that
/// whatever is read in its place fits into memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit(u64);

impl Limit {
    /// Missions, errors, orbits, manifests: short texts. Parsing TOML takes up to eighty times its size.
    pub const TEXT: Self = Self(1 << 20);
    /// Plans, subproblems, records and pages.
    pub const DOCUMENT: Self = Self(16 << 20);
    /// Scenario sets: half a million scenarios.
    pub const SET: Self = Self(256 << 20);
    /// Models, checkpoints, logs: read as they are.
    pub const BINARY: Self = Self(1 << 29);

    /// A limit of this many bytes, the size of a whole file.
    pub fn of(bytes: u64) -> Self {
        Self(bytes)
    }
}

/// Opens a file to read. Refuses all but regular files: a pipe may have no writer, a device may
/// never end.
///
/// # Errors
/// The file with the reason.
pub fn open_regular(file: &Path) -> Result<File, Error> {
    let failed = |cause: std::io::Error| Error::input(file, "", io_reason(&cause));
    look(file, &fs::metadata(file).map_err(failed)?)?;
    open_without_waiting(file, OpenOptions::new().read(true), failed)
}

/// Opens a file to read and to write and keeps its contents; creates it where there is none.
/// Refuses all but regular files.
///
/// # Errors
/// The file with the reason.
pub fn open_to_write(file: &Path) -> Result<File, Error> {
    if let Ok(found) = fs::metadata(file) {
        look(file, &found)?;
    }
    let mut options = OpenOptions::new();
    let options = options.read(true).write(true).create(true).truncate(false);
    open_without_waiting(file, options, |cause| Error::output(file, &cause))
}

/// Looks at a file before it is opened, since opening a pipe or a device may do something already.
fn look(file: &Path, found: &Metadata) -> Result<(), Error> {
    if found.is_dir() {
        return Err(Error::input(file, "", io_reason(&ErrorKind::IsADirectory.into())));
    }
    if found.is_file() { Ok(()) } else { Err(Error::input(file, "", "is not a regular file")) }
}

/// Opens a file that was regular when it was looked at, and refuses a pipe put in its place since.
/// A file that has to be waited for, such as the kernel's log, is an error when it is read.
fn open_without_waiting(
    file: &Path,
    options: &mut OpenOptions,
    failed: impl Fn(std::io::Error) -> Error,
) -> Result<File, Error> {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    }
    let handle = options.open(file).map_err(&failed)?;
    look(file, &handle.metadata().map_err(&failed)?)?;
    Ok(handle)
}

/// Reads a whole file. Memory: its size.
///
/// # Errors
/// The file with the reason why it cannot be read; more than it may have.
pub fn read_bytes(file: &Path, limit: Limit) -> Result<Vec<u8>, Error> {
    let failed = |cause: std::io::Error| Error::input(file, "", io_reason(&cause));
    let handle = open_regular(file)?;
    let size = handle.metadata().map_err(failed)?.len();
    let too_large = |size: u64| {
        let reason = format!("has {size} bytes; a file of its kind has at most {}", limit.0);
        Err(Error::input(file, "", reason))
    };
    if size > limit.0 {
        return too_large(size);
    }
    let mut bytes = Vec::with_capacity(size as usize);
    // Somebody may write to it at this moment.
    handle.take(limit.0.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    match bytes.len() as u64 {
        size if size > limit.0 => too_large(size),
        _ => Ok(bytes),
    }
}

/// Reads a whole text file.
///
/// # Errors
/// The error of [`read_bytes`]; bytes that are not UTF-8.
pub fn read_text(file: &Path, limit: Limit) -> Result<String, Error> {
    String::from_utf8(read_bytes(file, limit)?)
        .map_err(|_| Error::input(file, "", "is not valid UTF-8"))
}

/// The text that bytes are.
///
/// # Errors
/// They are not valid.
pub fn as_text(bytes: &[u8]) -> Result<&str, FieldError> {
    std::str::from_utf8(bytes).map_err(|_| FieldError::new("", "is not valid UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Verifies REM-IO-004.
    #[test]
    fn no_more_is_read_than_a_file_may_have() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a");
        fs::write(&file, b"12345").unwrap();
        assert_eq!(read_bytes(&file, Limit(5)).unwrap(), b"12345");
        let reason = |limit| read_bytes(&file, limit).unwrap_err().to_string();
        assert!(reason(Limit(4)).ends_with("a: has 5 bytes; a file of its kind has at most 4"));
        // A file that is all hole takes no time to refuse.
        File::create(&file).unwrap().set_len(1 << 40).unwrap();
        assert!(reason(Limit::BINARY).contains("has 1099511627776 bytes"));
    }

    #[test]
    fn what_is_no_text_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a");
        fs::write(&file, b"\xff\xfe").unwrap();
        let reason = read_text(&file, Limit::TEXT).unwrap_err().to_string();
        assert!(reason.ends_with("a: is not valid UTF-8"), "{reason}");
        let reason = read_text(dir.path(), Limit::TEXT).unwrap_err().to_string();
        assert!(reason.ends_with("is a directory"), "{reason}");
        let reason = read_text(&dir.path().join("b"), Limit::TEXT).unwrap_err().to_string();
        assert!(reason.ends_with("no such file or directory"), "{reason}");
    }

    // Verifies REM-IO-004.
    #[cfg(target_os = "linux")]
    #[test]
    fn what_became_a_pipe_is_not_waited_for() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("a");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let failed = |cause: std::io::Error| Error::output(&pipe, &cause);
        let late =
            |options: &mut OpenOptions| open_without_waiting(&pipe, options.read(true), failed);
        let opened = [
            open_regular(&pipe),
            open_to_write(&pipe),
            late(&mut OpenOptions::new()),
            late(OpenOptions::new().write(true)),
        ];
        for opened in opened {
            let reason = opened.unwrap_err().to_string();
            assert!(reason.ends_with("a: is not a regular file"), "{reason}");
        }
    }

    // Verifies REM-IO-004.
    #[cfg(unix)]
    #[test]
    fn devices_are_not_read() {
        for device in ["/dev/zero", "/dev/null"] {
            let reason = read_bytes(Path::new(device), Limit::BINARY).unwrap_err().to_string();
            assert_eq!(reason, format!("{device}: is not a regular file"));
        }
    }
}
