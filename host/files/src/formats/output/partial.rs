//! Partial files: hidden beside the file that they become, and locked until then.

use std::collections::HashSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::path::{Path, PathBuf};

const PARTIAL: &str = ".partial";

/// Most of a file's name that its partial one bears [bytes].
const LONGEST_NAME: usize = 200;

/// Name of the hidden file beside `name` that becomes it. A random number keeps several writers of
/// one file apart; process numbers would not, since every container counts from one.
pub(super) fn partial(name: &str) -> String {
    let number = RandomState::new().hash_one(());
    format!(".{}.{number:016x}{PARTIAL}", shortened(name))
}

/// The part of a file's name that its partial one bears, whose own is longer: a name has at most 255 bytes.
fn shortened(name: &str) -> &str {
    let mut ends = (0..=LONGEST_NAME.min(name.len())).rev();
    &name[..ends.find(|end| name.is_char_boundary(*end)).unwrap_or(0)]
}

/// The name of the file that a partial one was to become, shortened.
fn meant(partial: &str) -> Option<&str> {
    let (name, _) = partial.strip_prefix('.')?.strip_suffix(PARTIAL)?.rsplit_once('.')?;
    Some(name)
}

/// The file that a name stands for: a symbolic link stays, and what it leads to is written.
pub(super) fn resolved(file: &Path) -> io::Result<PathBuf> {
    match fs::symlink_metadata(file) {
        Ok(found) if found.is_symlink() => fs::canonicalize(file),
        _ => Ok(file.to_path_buf()),
    }
}

/// Creates the partial file of `file`, which is no link. Its lock, held until it is closed, keeps
/// programs that tidy up from removing it.
pub(super) fn open(file: &Path) -> io::Result<(PathBuf, File)> {
    let name = file.file_name().filter(|_| !ends_in_separator(file));
    let name = name.ok_or_else(|| io::Error::other("is not a file name"))?.to_string_lossy();
    if let Ok(existing) = fs::metadata(file) {
        if existing.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        if !existing.is_file() {
            // A device or a pipe must not be replaced by a file.
            return Err(io::Error::other("is not a regular file"));
        }
    }
    loop {
        let partial = file.with_file_name(partial(&name));
        let handle = OpenOptions::new().write(true).create_new(true).open(&partial)?;
        // A program that tidies up may remove the file between creation and lock.
        let is_held = matches!(handle.try_lock(), Err(TryLockError::WouldBlock));
        if !is_held && partial.try_exists().unwrap_or(true) {
            return Ok((partial, handle));
        }
        remove_file(&partial)?;
    }
}

fn ends_in_separator(file: &Path) -> bool {
    file.as_os_str().to_string_lossy().ends_with(std::path::is_separator)
}

/// Removes a file. One that is gone another program has removed, or swept away.
///
/// # Errors
/// The reason why it stays.
pub fn remove_file(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(cause),
        _ => Ok(()),
    }
}

/// Removes what a killed program left half-written in `directory`. What another program is writing stays.
pub fn remove_partials(directory: &Path) {
    remove_hidden(directory, |_| true);
}

/// Removes the partial files of one file. Other programs may write other files beside it.
pub fn remove_partials_of(file: &Path) {
    if let (Some(directory), Some(name)) = (file.parent(), file.file_name()) {
        remove_partials_among(directory, [name.to_string_lossy()]);
    }
}

/// Removes the partial files of the files with these names in a directory.
pub fn remove_partials_among<N: AsRef<str>>(directory: &Path, names: impl IntoIterator<Item = N>) {
    let names: HashSet<String> =
        names.into_iter().map(|name| shortened(name.as_ref()).into()).collect();
    remove_hidden(directory, |name| names.contains(name));
}

/// Removes the partial files that were to become files with such names.
fn remove_hidden(directory: &Path, is_such: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && meant(&name.to_string_lossy()).is_some_and(&is_such) {
            remove_left(&entry.path());
        }
    }
}

/// Removes a partial file that no program holds. The lock tells a program that has just created
/// it that it goes.
fn remove_left(partial: &Path) {
    if let Ok(handle) = OpenOptions::new().write(true).open(partial)
        && handle.try_lock().is_ok()
    {
        let _ = fs::remove_file(partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::write_as_it_comes;
    use std::io::Write;

    /// A program that tidies up while another writes, also in the middle of a look at whether it could.
    // Verifies REM-IO-002.
    #[test]
    fn what_is_being_written_is_not_swept_away() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.json");
        let swept = || {
            remove_partials(dir.path());
            remove_partials_of(&file);
            fs::read_dir(dir.path()).unwrap().count()
        };
        let written = write_as_it_comes(&file, |handle| {
            assert_eq!(swept(), 1);
            handle.write_all(b"one")
        });
        assert_eq!(written, Ok(()));
        assert_eq!(fs::read(&file).unwrap(), b"one");
        let (partial, handle) = open(&file).unwrap();
        assert_eq!(swept(), 2);
        drop(handle);
        assert_eq!(swept(), 1);
        // A missing file is no error; a directory cannot be removed as a file.
        assert!(remove_file(&partial).is_ok());
        assert!(remove_file(dir.path()).is_err());
    }

    /// Files whose names begin with a file's are not that file.
    #[test]
    fn another_files_leftovers_stay() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let names = [".a.json.77.partial", ".a.json.b.77.partial", ".b.json.77.partial"];
        names.iter().for_each(|name| fs::write(at(name), b"{").unwrap());
        remove_partials_of(&at("a.json"));
        assert_eq!(names.map(|name| at(name).exists()), [false, true, true]);
        remove_partials_among(dir.path(), ["a.json", "b.json"]);
        assert_eq!(names.map(|name| at(name).exists()), [false, true, false]);
    }

    #[test]
    fn leftovers_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join(".a.json.77.partial"), b"{").unwrap();
        fs::write(dir.path().join("a.json"), b"{}").unwrap();
        fs::write(dir.path().join(".b.json.77.partial"), b"{").unwrap();
        remove_partials_of(&dir.path().join("b.json"));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
        remove_partials(dir.path());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
