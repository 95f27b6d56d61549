//! Writing files whole or not at all.

use crate::error::{Error, io_reason};
use std::collections::HashSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const PARTIAL: &str = ".partial";

/// Most of a file's name that its partial one bears [bytes].
const LONGEST_NAME: usize = 200;

/// Name of the hidden file beside the file of a `name` that becomes it. A random number keeps apart who writes the
/// same file at once; process numbers would not, of which every container has a first one.
fn partial(name: &str) -> String {
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
fn resolved(file: &Path) -> io::Result<PathBuf> {
    match fs::symlink_metadata(file) {
        Ok(found) if found.is_symlink() => fs::canonicalize(file),
        _ => Ok(file.to_path_buf()),
    }
}

/// Opens what becomes `file`, which is no link. It is locked until it is closed, so that who tidies up leaves it.
fn open(file: &Path) -> io::Result<(PathBuf, File)> {
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
        // Who tidies up may have come between the two, and then has removed it.
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

/// As [`write_atomically`], with what `fill` writes piece by piece.
///
/// # Errors
/// As there.
pub fn write_as_it_comes(
    file: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<()>,
) -> Result<(), Error> {
    write(file, fill, |_, partial, file| fs::rename(partial, file))
}

/// As [`write_atomically`], where there is no such file yet: of several programs that write it at once
/// one does.
///
/// # Errors
/// As there; none where another was first: then `false`.
pub fn write_first(file: &Path, bytes: &[u8]) -> Result<bool, Error> {
    let mut is_first = true;
    write(
        file,
        |handle| handle.write_all(bytes),
        |handle, partial, file| {
            // Who finds the file may lock it at once.
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

/// Writes several files that belong together. All are written beside their places before the first is renamed.
/// If one cannot be renamed, those before it are undone. So the old files are left, or none.
///
/// # Errors
/// The file that cannot be written with the reason.
pub fn write_together(files: &[(&Path, Vec<u8>)]) -> Result<(), Error> {
    write_together_by(files, |partial, place| fs::rename(partial, place))
}

/// A file written beside its place.
struct Staged<'a> {
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
    let mut staged: Vec<Staged<'_>> = Vec::new();
    let written = files.iter().try_for_each(|(file, bytes)| {
        let mut stage = || {
            let place = resolved(file)?;
            let (partial, mut handle) = open(&place)?;
            let written = handle.write_all(bytes).and_then(|()| handle.sync_all());
            staged.push(Staged { partial, _handle: handle, place, file, old: None });
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
    for (i, Staged { partial, place, old, .. }) in staged.iter().enumerate() {
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

/// Removes a file. One that is gone another program has removed, or swept away.
///
/// # Errors
/// Why it stays.
pub fn remove_file(file: &Path) -> io::Result<()> {
    match fs::remove_file(file) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(cause),
        _ => Ok(()),
    }
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

/// Removes what a killed program left half-written in `directory`. What another program is writing stays.
pub fn remove_partials(directory: &Path) {
    remove_hidden(directory, |_| true);
}

/// The same of one file, where other programs may write other files beside it.
pub fn remove_partials_of(file: &Path) {
    if let (Some(directory), Some(name)) = (file.parent(), file.file_name()) {
        remove_partials_among(directory, [name.to_string_lossy()]);
    }
}

/// The same of the files with these names in a directory.
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

/// Removes a partial file that nobody holds. It is locked meanwhile, so that who has just begun it sees that it goes.
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

    /// Two threads as two containers are, whose process numbers are equal: a reader sees what one of them wrote.
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

    /// Another program sweeps as soon as it finds the file, before who wrote it has tidied up.
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
        // What another has removed meanwhile need not be removed; what cannot be is told.
        assert!(remove_file(&partial).is_ok());
        assert!(remove_file(dir.path()).is_err());
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
