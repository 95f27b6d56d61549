//! The command line of the programs of this checkout: exit status, errors in one line, progress, colours, and the
//! options that commands share.

mod colour;
pub mod options;
pub mod progress;

use clap::Parser;
use remora_host::error::Error;
use remora_host::formats::{Verdict, json};
use remora_host::notes;
use serde::Serialize;
use std::borrow::Cow;
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::Path;
#[cfg(unix)]
use std::sync::{Arc, atomic::AtomicBool};

/// How a command ended, where its inputs and outputs were sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// It ran, and all is well.
    Success,
    /// It ran, but something is not flyable or has failed.
    Failure,
    /// It ran and all can be flown, but something is not converged.
    NotConverged,
}

impl From<Verdict> for Exit {
    fn from(worst: Verdict) -> Self {
        match worst {
            Verdict::Optimal => Self::Success,
            Verdict::Verified => Self::NotConverged,
            Verdict::NotFlyable => Self::Failure,
        }
    }
}

impl Exit {
    fn status(self) -> u8 {
        match self {
            Self::Success => 0,
            Self::Failure => 1,
            Self::NotConverged => 3,
        }
    }
}

/// Output of a command, and how it ended.
pub struct Output {
    text: String,
    /// Whether the text was asked for as data, which is printed as it stands.
    is_data: bool,
    exit: Exit,
}

impl Output {
    /// A report.
    pub fn new(text: String, success: bool) -> Self {
        let exit = if success { Exit::Success } else { Exit::Failure };
        Self { text, is_data: false, exit }
    }

    /// A report of what was planned, and the worst verdict on it.
    pub fn judged(text: String, worst: Verdict) -> Self {
        Self { text, is_data: false, exit: worst.into() }
    }

    /// Data that was asked for.
    pub fn data(text: String) -> Self {
        Self::new(text, true).into_data()
    }

    /// The report, or in its place `value` as JSON where that is asked for; it ends the same way.
    ///
    /// # Errors
    /// A value that JSON has no form for.
    pub fn or_json(self, is_asked: bool, value: &impl Serialize) -> Result<Self, Error> {
        match is_asked {
            true => Ok(Self { text: to_json(value)?, ..self }.into_data()),
            false => Ok(self),
        }
    }

    /// The text, asked for as data.
    #[must_use]
    pub fn into_data(self) -> Self {
        Self { is_data: true, ..self }
    }
}

/// A value as JSON for standard output.
fn to_json(value: &impl Serialize) -> Result<String, Error> {
    let file = Path::new("standard output");
    json::to_text(value).map_err(|error| Error::output(file, &error.into()))
}

/// A program: what its arguments parse to.
pub trait Program: Parser {
    /// Whether reports and progress are left out.
    fn is_quiet(&self) -> bool;

    /// Does what was asked for.
    ///
    /// # Errors
    /// Bad input, output that cannot be written, an interruption.
    fn run(self) -> Result<Output, Error>;
}

/// Runs a program with its arguments, the first of which is its name; returns the exit status:
/// 0 done, 1 not flyable or failed, 2 bad input (one line on standard error), 3 verified but not
/// converged, 128 and a signal's number where that ended work that can go on.
pub fn run<P: Program>(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let program = match P::try_parse_from(&args) {
        Ok(program) => program,
        Err(error) if !error.use_stderr() => {
            // Help or version.
            return print(&error.to_string(), 0);
        }
        Err(error) => return refuse(&usage_line(&error)),
    };
    let is_quiet = program.is_quiet();
    if is_quiet {
        progress::silence();
    }
    notes::show_by(|note| progress::tell(&format!("note: {note}")));
    match program.run() {
        Ok(output) => {
            let status = output.exit.status();
            match output.is_data {
                true => print(&output.text, status),
                false if is_quiet => status,
                false => print(&colour::painted(output.text), status),
            }
        }
        Err(error) => {
            let status = refuse(&told(&error, &P::command(), &args));
            // Shells report a signal as 128 plus its number.
            if let Error::Interrupted { signal } = error { 128 + signal } else { status }
        }
    }
}

/// A file that outgrows what the system allows (`ulimit -f`) is an error that names it; without somebody
/// who listens to the signal, it ends the program and leaves what is half written.
pub fn outgrow_limits_as_errors() {
    #[cfg(unix)]
    let _ = {
        let nobody_asks = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, nobody_asks)
    };
}

/// Writes to standard output; returns the exit status, which is `status` where all could be written. A
/// reader that has gone away, such as `head`, is no error.
fn print(text: &str, status: u8) -> u8 {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            refuse(&Error::output(Path::new("standard output"), &cause).to_string())
        }
        _ => status,
    }
}

/// One line on standard error, whatever the message holds.
fn refuse(message: &str) -> u8 {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let _ = writeln!(std::io::stderr(), "{} {line}", colour::error_word());
    2
}

/// Message of an error. For a file of another kind it names the kind that the command or its option takes.
fn told(error: &Error, cli: &clap::Command, args: &[OsString]) -> String {
    let Error::WrongKind { file, found, expected } = error else { return error.to_string() };
    let file_name = file.to_string_lossy();
    let words = || args.iter().map(|arg| arg.to_string_lossy());
    let (name, command) = named(cli, &words().skip(1).collect::<Vec<_>>());
    let is_named = |option: &&str| {
        let with_equals = format!("--{option}={file_name}");
        let mut pairs = words().zip(words().skip(1));
        words().any(|word| word == with_equals)
            || pairs
                .any(|(flag, value)| flag.strip_prefix("--") == Some(*option) && value == file_name)
    };
    let takes_values = |arg: &&clap::Arg| arg.get_action().takes_values();
    let options = command.get_arguments().filter(takes_values);
    let option = options.filter_map(clap::Arg::get_long).find(is_named);
    let option = option.map_or(String::new(), |option| format!(" --{option}"));
    format!("{}: this is {found}; {name}{option} takes {expected}", file.display())
}

/// The command that arguments begin with, and its name after the program's.
fn named<'a>(cli: &'a clap::Command, words: &[Cow<'_, str>]) -> (String, &'a clap::Command) {
    let (mut names, mut command) = (Vec::new(), cli);
    for word in words.iter().filter(|word| !word.starts_with('-')) {
        let Some(found) = command.find_subcommand(word.as_ref()) else { break };
        command = found;
        names.push(word.as_ref());
    }
    (names.join(" "), command)
}

/// The message of a usage error in one line, with clap's suggestions and without the usage.
pub fn usage_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let is_message = |line: &&str| !line.starts_with("Usage:") && !line.starts_with("For more");
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let mut said = String::new();
    for line in lines.take_while(is_message) {
        said += if line.starts_with("tip:") { "; " } else { " " };
        said += line;
    }
    let said = said.trim_start();
    said.strip_prefix("error: ").unwrap_or(said).into()
}
