//! Writing a file whole or not at all.

use super::partial::{open, remove_file, resolved};
use crate::error::{Error, io_reason};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

/// Fails now if [`write_atomically`] could not write `file` later; leaves nothing behind. To be
/// called before a long computation.
///
/// # Errors
/// The file with the reason why it cannot be written.
pub fn check_writable(file: &Path) -> Result<(), Error> {
    let check = || {
        let (partial, handle) = open(&resolved(file)?)?;
        drop(handle);
        remove_file(&partial)
    };
    check().map_err(|cause| Error::output(file, &cause))
}

/// Writes `bytes` beside `file`, then renames: a reader sees the old file or the new one, never
/// a part of it.
///
/// # Errors
/// The file with the reason why it cannot be written; what was there before still is.
pub fn write_atomically(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_as_it_comes(file, |handle| handle.write_all(bytes))
}

/// Writes a file like [`write_atomically`]; `fill` writes it piece by piece.
///
/// # Errors
/// The error of [`write_atomically`].
pub fn write_as_it_comes(
    file: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), Error> {
    write(file, fill, |_, partial, file| fs::rename(partial, file))
}

/// Writes a file like [`write_atomically`] if there is none yet. Where several programs write it
/// at once, one does.
///
/// # Errors
/// The error of [`write_atomically`]; none where another was first: then `false`.
pub fn write_first(file: &Path, bytes: &[u8]) -> Result<bool, Error> {
    let mut is_first = true;
    write(
        file,
        |handle| handle.write_all(bytes),
        |handle, partial, file| {
            // A program that finds the file may lock it at once.
            let _ = handle.unlock();
            match fs::hard_link(partial, file) {
                Ok(()) => remove_file(partial),
                Err(_) if file.exists() => {
                    is_first = false;
                    remove_file(partial)
                }
                // A file system without links.
                Err(_) => fs::rename(partial, file),
            }
        },
    )?;
    Ok(is_first)
}

/// Writes beside a file, and lets that become it.
fn write(
    file: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<()>,
    become_it: impl FnOnce(&File, &Path, &Path) -> io::Result<()>,
) -> Result<(), Error> {
    let write = || {
        let file = resolved(file)?;
        let (partial, mut handle) = open(&file)?;
        let written = fill(&mut handle)
            .and_then(|()| handle.sync_all())
            .and_then(|()| become_it(&handle, &partial, &file));
        if written.is_err() {
            let _ = fs::remove_file(&partial);
        }
        written
    };
    write().map_err(|cause| Error::output(file, &cause))
}

/// Makes a directory and those above it, where they do not exist.
///
/// # Errors
/// The directory with the reason why it cannot be made.
pub fn make_directory(directory: &Path) -> Result<(), Error> {
    fs::create_dir_all(directory).map_err(|cause| {
        let exists = cause.kind() == io::ErrorKind::AlreadyExists;
        let reason = if exists { "is not a directory".into() } else { io_reason(&cause) };
        Error::Output { file: directory.to_path_buf(), reason }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::remove_partials_of;

    // Verifies REM-IO-002.
    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.json");
        check_writable(&file).unwrap();
        assert!(!file.exists());
        write_atomically(&file, b"one").unwrap();
        write_atomically(&file, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn unwritable_paths_are_refused_beforehand() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        write_atomically(&file, b"").unwrap();
        let refused = |path: &Path| check_writable(path).unwrap_err().to_string();
        assert!(refused(dir.path()).ends_with("is a directory"));
        assert!(refused(&dir.path().join("none/a.json")).ends_with("no such file or directory"));
        assert!(refused(&file.join("a.json")).ends_with("not a directory"));
        assert!(refused(Path::new("/")).ends_with("is not a file name"));
        assert!(refused(&dir.path().join("new/")).ends_with("is not a file name"));
    }

    /// Threads stand for containers with equal process numbers: a reader sees one whole file.
    // Verifies REM-IO-002.
    #[test]
    fn writers_with_one_process_number_write_whole_files() {
        let dir = tempfile::tempdir().unwrap();
        let at = |round: usize| dir.path().join(format!("{round}.json"));
        let all = ["1".repeat(100_000), "2".repeat(200_000)];
        for round in 0..50 {
            let (file, is_first) = (at(round), round % 2 == 0);
            let written: Vec<_> = std::thread::scope(|scope| {
                let write = |text: &str| match is_first {
                    true => write_first(&file, text.as_bytes()),
                    false => write_atomically(&file, text.as_bytes()).map(|()| true),
                };
                let writers = all.each_ref().map(|text| scope.spawn(move || write(text)));
                writers.map(|writer| writer.join().unwrap().unwrap()).into()
            });
            let first = written.iter().filter(|first| **first).count();
            assert_eq!(first, if is_first { 1 } else { 2 });
            assert!(all.contains(&fs::read_to_string(&file).unwrap()), "round {round}");
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 50);
    }

    #[test]
    fn one_of_several_writes_first() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.json");
        assert_eq!(write_first(&file, b"one"), Ok(true));
        assert_eq!(write_first(&file, b"two"), Ok(false));
        assert_eq!(fs::read(&file).unwrap(), b"one");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    /// Another program sweeps once it finds the file, before its writer has tidied up.
    #[test]
    fn who_writes_first_may_be_swept_after() {
        let dir = tempfile::tempdir().unwrap();
        let at = |round: usize| dir.path().join(round.to_string());
        let rounds = 0..1000;
        rounds.clone().for_each(|round| fs::create_dir(at(round)).unwrap());
        let written: Vec<_> = std::thread::scope(|scope| {
            let writer = scope.spawn(|| {
                rounds.clone().map(|round| write_first(&at(round).join("a.json"), b"one")).collect()
            });
            for round in rounds.clone() {
                let file = at(round).join("a.json");
                while !file.exists() && !writer.is_finished() {
                    std::hint::spin_loop();
                }
                remove_partials_of(&file);
            }
            writer.join().unwrap()
        });
        assert!(written.iter().all(|first| first == &Ok(true)), "{written:?}");
        assert!(rounds.into_iter().all(|round| fs::read_dir(at(round)).unwrap().count() == 1));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_what_it_leads_to_is_written() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("far")).unwrap();
        fs::write(at("far/a.json"), b"old").unwrap();
        std::os::unix::fs::symlink("far/a.json", at("link.json")).unwrap();
        check_writable(&at("link.json")).unwrap();
        write_atomically(&at("link.json"), b"new").unwrap();
        assert!(fs::symlink_metadata(at("link.json")).unwrap().is_symlink());
        assert_eq!(fs::read(at("far/a.json")).unwrap(), b"new");
        assert_eq!(fs::read_dir(at("far")).unwrap().count(), 1);
        // One that leads nowhere is not made something else either.
        std::os::unix::fs::symlink("far/none/b.json", at("broken.json")).unwrap();
        let reason = check_writable(&at("broken.json")).unwrap_err().to_string();
        assert!(reason.ends_with("no such file or directory"), "{reason}");
    }

    /// Names of all lengths that a file system allows, in letters of one byte and of several, and in no letters.
    #[test]
    fn the_longest_names_can_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let mut names: Vec<std::ffi::OsString> =
            [200, 230, 255].map(|length| "q".repeat(length).into()).into();
        names.push("ü".repeat(127).into());
        #[cfg(target_os = "linux")]
        names.push(std::os::unix::ffi::OsStringExt::from_vec(vec![0xff; 255]));
        for name in names {
            let file = dir.path().join(name);
            check_writable(&file).unwrap();
            assert_eq!(write_first(&file, b"one"), Ok(true));
            write_atomically(&file, b"two").unwrap();
            let partial = open(&file).unwrap().0;
            assert!(partial.exists());
            remove_partials_of(&file);
            assert!(!partial.exists());
            fs::remove_file(&file).unwrap();
        }
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
