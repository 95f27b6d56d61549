//! Locks that keep two programs from the same work.

use crate::error::Error;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;

/// Takes a file, or a directory, for one program alone. It is free again when `handle` is closed, however the
/// program ends.
///
/// # Errors
/// Reason why it cannot be locked; `busy` where another program holds it.
pub fn lock(file: &Path, handle: &File, busy: &str) -> Result<(), Error> {
    taken(file, handle.try_lock(), busy)
}

/// Takes a file, or a directory, for several programs that may hold it together.
///
/// # Errors
/// Reason why it cannot be locked; `busy` where another program holds it alone.
pub fn lock_shared(file: &Path, handle: &File, busy: &str) -> Result<(), Error> {
    taken(file, handle.try_lock_shared(), busy)
}

fn taken(file: &Path, tried: Result<(), TryLockError>, busy: &str) -> Result<(), Error> {
    tried.map_err(|error| match error {
        TryLockError::WouldBlock => Error::input(file, "", busy),
        TryLockError::Error(cause) if has_no_locks(&cause) => {
            let reason = "cannot be locked, since its file system has no locks: choose a directory on another";
            Error::input(file, "", reason)
        }
        TryLockError::Error(cause) => Error::output(file, &cause),
    })
}

/// Errors of Linux for a file system without locks, beside those that Rust maps to unsupported: ENOLCK, of a
/// network file system whose lock daemon is gone, and ENOTSUPP.
const NO_LOCKS: [i32; 2] = [37, 524];

fn has_no_locks(cause: &io::Error) -> bool {
    let is_told = |number| cfg!(target_os = "linux") && NO_LOCKS.contains(&number);
    cause.kind() == ErrorKind::Unsupported || cause.raw_os_error().is_some_and(is_told)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_another_holds_and_what_cannot_be_locked_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        let open = || File::options().write(true).create(true).truncate(false).open(&path).unwrap();
        let (one, two) = (open(), open());
        lock_shared(&path, &one, "busy").unwrap();
        lock_shared(&path, &two, "busy").unwrap();
        let reason = lock(&path, &one, "busy").unwrap_err().to_string();
        assert!(reason.ends_with("a: busy"), "{reason}");
        drop(two);
        lock(&path, &one, "busy").unwrap();
        assert!(lock_shared(&path, &open(), "busy").is_err());

        #[cfg(target_os = "linux")]
        for number in [37, 38, 95, 524] {
            let cause = io::Error::from_raw_os_error(number);
            let reason = taken(&path, Err(TryLockError::Error(cause)), "busy").unwrap_err();
            let reason = reason.to_string();
            assert!(reason.ends_with("has no locks: choose a directory on another"), "{reason}");
        }
        let without = |kind: ErrorKind| taken(&path, Err(TryLockError::Error(kind.into())), "busy");
        let reason = without(ErrorKind::Unsupported).unwrap_err().to_string();
        assert!(reason.contains("a: cannot be locked, since its file system"), "{reason}");
        let reason = without(ErrorKind::PermissionDenied).unwrap_err().to_string();
        assert!(reason.ends_with("a: permission denied"), "{reason}");
    }
}
