//! Errors of one line: the file and the reason.

use std::path::{Path, PathBuf};

/// A file that cannot be read or understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {reason}", file.display())]
pub struct ImageError {
    /// The file.
    pub file: PathBuf,
    /// Reason why it was refused.
    pub reason: String,
}

impl ImageError {
    /// Error of a file with its reason.
    pub(crate) fn new(file: &Path, reason: impl Into<String>) -> Self {
        Self { file: file.to_path_buf(), reason: reason.into() }
    }

    /// A file that cannot be read.
    pub(crate) fn io(file: &Path, cause: &std::io::Error) -> Self {
        let reason = match cause.kind() {
            std::io::ErrorKind::NotFound => "no such file or directory".into(),
            std::io::ErrorKind::PermissionDenied => "permission denied".into(),
            std::io::ErrorKind::IsADirectory => "is a directory".into(),
            _ => cause.to_string(),
        };
        Self::new(file, reason)
    }
}
