//! Writing files that belong together: all or none.

use super::partial::{open, partial, resolved};
use crate::error::Error;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes several files that belong together. All are written beside their places before the first is renamed.
/// If one cannot be renamed, those before it are undone. So the old files are left, or none.
///
/// # Errors
/// The file that cannot be written with the reason.
pub fn write_together(files: &[(&Path, Vec<u8>)]) -> Result<(), Error> {
    write_together_by(files, |partial, place| fs::rename(partial, place))
}

/// A file written beside its place.
struct StagedFile<'a> {
    partial: PathBuf,
    /// Holds the partial file against clean-up by another process.
    _handle: File,
    place: PathBuf,
    file: &'a Path,
    /// File that was in its place before.
    old: Option<PathBuf>,
}

fn write_together_by(
    files: &[(&Path, Vec<u8>)],
    rename: impl Fn(&Path, &Path) -> io::Result<()>,
) -> Result<(), Error> {
    let mut staged: Vec<StagedFile<'_>> = Vec::new();
    let written = files.iter().try_for_each(|(file, bytes)| {
        let mut stage = || {
            let place = resolved(file)?;
            let (partial, mut handle) = open(&place)?;
            let written = handle.write_all(bytes).and_then(|()| handle.sync_all());
            staged.push(StagedFile { partial, _handle: handle, place, file, old: None });
            written
        };
        stage().map_err(|cause| Error::output(file, &cause))
    });
    let mut placed = 0;
    let outcome = written.and_then(|()| {
        staged.iter_mut().try_for_each(|one| {
            let take = kept(&one.place).and_then(|old| {
                one.old = old;
                rename(&one.partial, &one.place)
            });
            placed += usize::from(take.is_ok());
            take.map_err(|cause| Error::output(one.file, &cause))
        })
    });
    for (i, StagedFile { partial, place, old, .. }) in staged.iter().enumerate() {
        match (&outcome, old) {
            (Err(_), Some(old)) if i < placed => {
                let _ = fs::rename(old, place).or_else(|_| fs::copy(old, place).map(drop));
            }
            (Err(_), None) if i < placed => drop(fs::remove_file(place)),
            (Err(_), _) => drop(fs::remove_file(partial)),
            (Ok(()), _) => {}
        }
        old.iter().for_each(|old| drop(fs::remove_file(old)));
    }
    outcome
}

/// Makes a second name for the file in a place, or a copy if links fail; none if there is no file.
fn kept(place: &Path) -> io::Result<Option<PathBuf>> {
    if !place.try_exists()? {
        return Ok(None);
    }
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let old = place.with_file_name(partial(&name));
    fs::hard_link(place, &old).or_else(|_| fs::copy(place, &old).map(drop))?;
    Ok(Some(old))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Verifies REM-IO-002.
    #[test]
    fn files_that_belong_together_are_written_together_or_not() {
        let dir = tempfile::tempdir().unwrap();
        let (one, two) = (dir.path().join("a"), dir.path().join("b"));
        let write = |text: &str| {
            write_together(&[(&one, text.as_bytes().into()), (&two, text.as_bytes().into())])
        };
        write("1").unwrap();
        let both = || [&one, &two].map(|file| fs::read(file).unwrap());
        assert_eq!(both(), [b"1", b"1"]);
        write("2").unwrap();
        assert_eq!(both(), [b"2", b"2"]);
        fs::remove_file(&two).unwrap();
        fs::create_dir(&two).unwrap();
        let reason = write("3").unwrap_err().to_string();
        assert!(reason.ends_with("b: is a directory"), "{reason}");
        assert_eq!(fs::read(&one).unwrap(), b"2");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    /// The second of two files cannot be renamed: the first is undone, to the old file or to none.
    // Verifies REM-IO-002.
    #[test]
    fn half_of_a_pair_of_files_is_never_left() {
        let dir = tempfile::tempdir().unwrap();
        let (one, two) = (dir.path().join("a"), dir.path().join("b"));
        let write = |text: &str, fails: &Path| {
            let files: [(&Path, Vec<u8>); 2] = [(&one, text.into()), (&two, text.into())];
            write_together_by(&files, |partial, place| match place == fails {
                true => Err(io::Error::from(io::ErrorKind::StorageFull)),
                false => fs::rename(partial, place),
            })
        };
        for fails in [&one, &two] {
            let reason = write("1", fails).unwrap_err().to_string();
            assert!(reason.starts_with(&fails.display().to_string()), "{reason}");
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        }
        write("1", Path::new("")).unwrap();
        for fails in [&one, &two] {
            write("2", fails).unwrap_err();
            assert_eq!([&one, &two].map(|file| fs::read(file).unwrap()), [b"1", b"1"]);
            assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
        }
        // A single file stays single, and unchanged.
        fs::remove_file(&two).unwrap();
        write("2", &two).unwrap_err();
        assert_eq!(fs::read(&one).unwrap(), b"1");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
