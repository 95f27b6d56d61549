//! Errors of the operator's tools: each is one line that names the file, the field and the
//! reason.

use std::path::{Path, PathBuf};

/// An input, an output or an argument that cannot be used.
///
/// Displayed as `FILE: FIELD: REASON`, without the field where the whole file is meant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be read or understood, or that contradicts another.
    #[error("{}: {}{reason}", file.display(), prefix(field))]
    Input {
        /// The file.
        file: PathBuf,
        /// Path of the field inside it, such as `scenarios[3].target.attitude`; may be empty.
        field: String,
        /// Reason why it is refused.
        reason: String,
    },
    /// The file is of another kind than the reader takes.
    #[error("{}: this is {found}; {expected} is expected", file.display())]
    WrongKind {
        /// The file.
        file: PathBuf,
        /// Kind of the file, with an article.
        found: &'static str,
        /// Kind that the reader takes, with an article.
        expected: &'static str,
    },
    /// A file that cannot be written.
    #[error("{}: {reason}", file.display())]
    Output {
        /// The file.
        file: PathBuf,
        /// Reason why it cannot be written.
        reason: String,
    },
    /// A command line argument, or a combination of them.
    #[error("{argument}: {reason}")]
    Argument {
        /// The argument, such as `--id`.
        argument: &'static str,
        /// Reason why it is refused.
        reason: String,
    },
    /// A scenario that is no input to plan from.
    #[error("scenario {id}: {reason}")]
    Scenario {
        /// Its id.
        id: String,
        /// Reason why it is refused.
        reason: String,
    },
    /// A plot that cannot be drawn.
    #[error("plot: {reason}")]
    Plot {
        /// Reason why it cannot be drawn.
        reason: String,
    },
    /// A thread that could not be started or did not end well.
    #[error("worker thread: {reason}")]
    Thread {
        /// Event that ended the thread, or kept it from starting.
        reason: String,
    },
    /// The program was asked to end before the work was done.
    #[error("interrupted by signal {signal}: what is finished is kept, the same command goes on")]
    Interrupted {
        /// Number of the signal.
        signal: u8,
    },
}

fn prefix(field: &str) -> String {
    if field.is_empty() { String::new() } else { format!("{field}: ") }
}

impl Error {
    /// A field of an input file that cannot be used.
    pub fn input(file: &Path, field: impl Into<String>, reason: impl Into<String>) -> Self {
        FieldError::new(field, reason).at(file)
    }

    /// A file that cannot be written.
    pub fn output(file: &Path, cause: &std::io::Error) -> Self {
        Self::Output { file: file.to_path_buf(), reason: io_reason(cause) }
    }

    /// An argument that cannot be used.
    pub fn argument(argument: &'static str, reason: impl Into<String>) -> Self {
        Self::Argument { argument, reason: reason.into() }
    }
}

/// The reason of an I/O error without the operating system's error number.
pub fn io_reason(cause: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match cause.kind() {
        ErrorKind::NotFound => "no such file or directory".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::IsADirectory => "is a directory".into(),
        ErrorKind::NotADirectory => "a part of the path is not a directory".into(),
        ErrorKind::InvalidData => "is not valid UTF-8".into(),
        _ => cause.to_string(),
    }
}

/// A text without what moves the cursor of a terminal: names out of a file may hold anything.
pub fn in_one_line(text: String) -> String {
    if !text.contains(char::is_control) {
        return text;
    }
    let shown = |c: char| match c.is_control() {
        true => c.escape_default().to_string(),
        false => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Most that an error's field and reason have [bytes]: what they quote from a file may be as long as the file.
const LONGEST: usize = 1000;

/// A text whose middle is left out where it is long.
fn of_bearable_length(text: String) -> String {
    if text.len() <= LONGEST {
        return text;
    }
    let is_end = |at: &usize| text.is_char_boundary(*at);
    let head = (0..=LONGEST / 2).rev().find(is_end).unwrap_or(0);
    let tail = (text.len() - LONGEST / 2..=text.len()).find(is_end).unwrap_or(text.len());
    format!("{} … {}", &text[..head], &text[tail..])
}

/// An error of the contents of a file that has not been given its name yet: field and reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldError {
    /// Path of the field; may be empty.
    pub field: String,
    /// Reason why it is refused.
    pub reason: String,
}

impl FieldError {
    /// An error of one field.
    pub fn new(field: impl Into<String>, reason: impl Into<String>) -> Self {
        let shown = |text: String| of_bearable_length(in_one_line(text));
        Self { field: shown(field.into()), reason: shown(reason.into()) }
    }

    /// Names the `file` of the error.
    pub fn at(self, file: &Path) -> Error {
        Error::Input { file: file.to_path_buf(), field: self.field, reason: self.reason }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_file_field_reason() {
        let error = Error::input(Path::new("a.json"), "scenarios[3].id", "used twice");
        assert_eq!(error.to_string(), "a.json: scenarios[3].id: used twice");
        let error = Error::input(Path::new("a.json"), "", "no such file or directory");
        assert_eq!(error.to_string(), "a.json: no such file or directory");
        let error = Error::input(Path::new("a.json"), "b\nc", "unknown field `\u{1b}[2J\r`");
        assert_eq!(error.to_string(), "a.json: b\\nc: unknown field `\\u{1b}[2J\\r`");
        // The middle of what is long is left out, between two letters.
        let reason = format!("unknown format \"a{}\"", "ü\n".repeat(500_000));
        let error = Error::input(Path::new("a.json"), "b".repeat(1_000_000), reason).to_string();
        assert!(error.len() < 2100 && error.starts_with("a.json: bbb"), "{error}");
        assert!(error.contains("bbb … bbb") && error.ends_with("ü\\nü\\n\""), "{error}");
        assert!(error.contains(": unknown format \"aü\\nü\\n"), "{error}");
        let whole = "x".repeat(1000);
        assert!(Error::input(Path::new("a"), "", whole.clone()).to_string().ends_with(&whole));
        let error = Error::argument("--id", "needs --scenarios FILE");
        assert_eq!(error.to_string(), "--id: needs --scenarios FILE");
    }
}
