//! The command line: parses, calls the library, prints. One file a command.

mod audit;
mod campaign;
mod check;
mod colour;
#[cfg(test)]
mod conventions;
mod dataset;
#[cfg(test)]
mod documented;
mod draw;
mod envelope;
mod errors;
mod export;
mod firmware;
mod fly;
mod flying;
mod gather;
mod import;
mod inject;
#[cfg(feature = "training")]
mod learn;
#[cfg(not(feature = "training"))]
mod left_out;
mod mission;
mod options;
mod parts;
mod plan;
mod profile;
mod progress;
mod qp_export;
mod quantise;
mod replay;
mod reproduce;
mod rerun;
mod safety;
mod submit;
#[cfg(feature = "training")]
mod train;
mod view;

use clap::{ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use remora_host::error::Error;
use remora_host::formats::{VERSION, Verdict, json};
use remora_host::notes;
use serde::Serialize;
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Plans how a free-flying servicer with a robot arm catches a tumbling object.
///
/// Without a command: plans the first of the built-in scenarios, as `remora plan` does.
#[derive(Debug, Parser)]
#[command(name = "remora", version = VERSION, after_help = AFTER_HELP)]
struct Cli {
    /// Print no report and no progress, only errors and what was asked for as data
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

const AFTER_HELP: &str = "\
Examples:
  remora                                             plan a built-in scenario
  remora campaign --count 300 --seed 1 --out runs/a  plan 300 drawn scenarios
  remora check runs/pub-000.plan.json                verify a plan, whoever wrote it
  remora view runs/pub-000.plan.json                 look at it, and plan on, in a browser
  remora fly runs/pub-000.plan.json --out runs/a     fly it in a world that it does not know

A plan is one of three:
  optimal                     verified, and what was asked for was reached            exit status 0
  verified but not converged  verified: it can be flown, but may cost more            exit status 3
  not flyable                 a constraint is violated, or it was refused beforehand  exit status 1

Other commands end with 0 where all is well and with 1 where something is not. Bad input is 2 with every
command. Colours follow the terminal; NO_COLOR=1 turns them off.";

#[derive(Debug, Subcommand)]
enum Command {
    Audit(audit::Args),
    Plan(plan::Args),
    Profile(profile::Args),
    Campaign(campaign::Args),
    Gather(gather::Args),
    Submit(submit::Args),
    Check(check::Args),
    View(view::Args),
    Replay(replay::Args),
    Fly(fly::Args),
    Rerun(rerun::Args),
    Safety(safety::Args),
    Errors(errors::Args),
    Draw(draw::Args),
    Mission(mission::Args),
    Import(import::Args),
    Envelope(envelope::Args),
    Export(export::Args),
    QpExport(qp_export::Args),
    Quantise(quantise::Args),
    Dataset(dataset::Args),
    Reproduce(reproduce::Args),
    Inject(inject::Args),
    Firmware(firmware::Args),
    #[cfg(feature = "training")]
    Train(train::Args),
    #[cfg(not(feature = "training"))]
    #[command(hide = true)]
    Train(left_out::Train),
    #[cfg(feature = "training")]
    Learn(learn::Args),
    #[cfg(not(feature = "training"))]
    #[command(hide = true)]
    Learn(left_out::Learn),
}

/// How a command ended, where its inputs and outputs were sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
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

/// What a command prints, and how it ended.
struct Output {
    text: String,
    /// Whether the text was asked for as data, which is printed as it stands.
    is_data: bool,
    exit: Exit,
}

impl Output {
    /// A report.
    fn new(text: String, success: bool) -> Self {
        let exit = if success { Exit::Success } else { Exit::Failure };
        Self { text, is_data: false, exit }
    }

    /// A report of what was planned, and the worst verdict on it.
    fn judged(text: String, worst: Verdict) -> Self {
        Self { text, is_data: false, exit: worst.into() }
    }

    /// Data that was asked for.
    fn data(text: String) -> Self {
        Self::new(text, true).into_data()
    }

    /// The report, or in its place `value` as JSON where that is asked for; it ends the same way.
    fn or_json(self, is_asked: bool, value: &impl Serialize) -> Result<Self, Error> {
        match is_asked {
            true => Ok(Self { text: to_json(value)?, ..self }.into_data()),
            false => Ok(self),
        }
    }

    fn into_data(self) -> Self {
        Self { is_data: true, ..self }
    }
}

/// A value as JSON for standard output.
fn to_json(value: &impl Serialize) -> Result<String, Error> {
    let file = Path::new("standard output");
    json::to_text(value).map_err(|error| Error::output(file, &error.into()))
}

/// Runs the program with its arguments, the first of which is its name; returns the exit status:
/// 0 done, 1 not flyable or failed, 2 bad input (one line on standard error), 3 verified but not
/// converged, 128 and a signal's number where that ended work that can go on.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let parsed = Cli::try_parse_from(&args).and_then(|cli| match cli.command {
        Some(command) => Ok((command, cli.quiet)),
        None => Ok((Command::Plan(plan::Args::from_arg_matches(&no_arguments()?)?), cli.quiet)),
    });
    let (command, is_quiet) = match parsed {
        Ok(parsed) => parsed,
        Err(error) if !error.use_stderr() => {
            // Help or version.
            return print(&error.to_string(), 0);
        }
        Err(error) => return refuse(&usage_line(&error)),
    };
    if is_quiet {
        progress::silence();
    }
    notes::show_by(|note| progress::tell(&format!("note: {note}")));
    match command.run() {
        Ok(output) => {
            let status = output.exit.status();
            match output.is_data {
                true => print(&output.text, status),
                false if is_quiet => status,
                false => print(&colour::painted(output.text), status),
            }
        }
        Err(error) => {
            let status = refuse(&told(&error, &args));
            // As a shell tells of a program that a signal ended.
            if let Error::Interrupted { signal } = error { 128 + signal } else { status }
        }
    }
}

/// What `remora plan` without arguments parses to.
fn no_arguments() -> Result<ArgMatches, clap::Error> {
    plan::Args::augment_args(clap::Command::new("plan")).try_get_matches_from(["plan"])
}

impl Command {
    fn run(self) -> Result<Output, Error> {
        match self {
            Self::Audit(args) => args.run(),
            Self::Plan(args) => args.run(),
            Self::Profile(args) => args.run(),
            Self::Campaign(args) => args.run(),
            Self::Gather(args) => args.run(),
            Self::Submit(args) => args.run(),
            Self::Check(args) => args.run(),
            Self::View(args) => args.run(),
            Self::Replay(args) => args.run(),
            Self::Fly(args) => args.run(),
            Self::Rerun(args) => args.run(),
            Self::Safety(args) => args.run(),
            Self::Errors(args) => args.run(),
            Self::Draw(args) => args.run(),
            Self::Mission(args) => args.run(),
            Self::Import(args) => args.run(),
            Self::Envelope(args) => args.run(),
            Self::Export(args) => args.run(),
            Self::QpExport(args) => args.run(),
            Self::Quantise(args) => args.run(),
            Self::Dataset(args) => args.run(),
            Self::Reproduce(args) => args.run(),
            Self::Inject(args) => args.run(),
            Self::Firmware(args) => args.run(),
            Self::Train(args) => args.run(),
            Self::Learn(args) => args.run(),
        }
    }
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
fn told(error: &Error, args: &[OsString]) -> String {
    let Error::WrongKind { file, found, expected } = error else { return error.to_string() };
    let cli = Cli::command();
    let words = || args.iter().map(|arg| arg.to_string_lossy());
    let name = words().skip(1).find(|word| !word.starts_with('-')).unwrap_or("plan".into());
    let command = cli.find_subcommand(&*name);
    let file_name = file.to_string_lossy();
    let is_named = |option: &&str| {
        let with_equals = format!("--{option}={file_name}");
        let mut pairs = words().zip(words().skip(1));
        words().any(|word| word == with_equals)
            || pairs
                .any(|(flag, value)| flag.strip_prefix("--") == Some(*option) && value == file_name)
    };
    let takes_values = |arg: &&clap::Arg| arg.get_action().takes_values();
    let options = command.iter().flat_map(|command| command.get_arguments()).filter(takes_values);
    let option = options.filter_map(clap::Arg::get_long).find(is_named);
    let option = option.map_or(String::new(), |option| format!(" --{option}"));
    format!("{}: this is {found}; {name}{option} takes {expected}", file.display())
}

/// The message of a usage error in one line, with clap's suggestions and without the usage.
fn usage_line(error: &clap::Error) -> String {
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
