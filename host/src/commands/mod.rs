//! The command line: parses, calls the library, prints. One file a command.

mod audit;
mod campaign;
mod check;
mod dataset;
#[cfg(test)]
mod documented;
mod draw;
mod envelope;
mod inject;
mod mission;
mod options;
mod plan;
mod profile;
mod progress;
mod qp_export;
mod quantise;
mod reproduce;
#[cfg(feature = "training")]
mod train;

use clap::{ArgMatches, Args, FromArgMatches, Parser, Subcommand};
use remora_host::error::Error;
use remora_host::formats::PlanVerdict;
use std::ffi::OsString;
use std::io::Write;

/// Plans how a free-flying servicer with a robot arm catches a tumbling object.
///
/// Without a command: plans the first of the built-in scenarios, as `remora plan` does.
#[derive(Debug, Parser)]
#[command(name = "remora", version, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

const AFTER_HELP: &str = "\
Examples:
  remora                                            plan a built-in scenario
  remora campaign --draw 300 --seed 1 --out runs/a  plan 300 drawn scenarios
  remora check --scenarios a.scenarios.json a.plan.json

Exit status: 0 done and all optimal, 1 something is not flyable or not feasible, 2 bad input, 3 all is
verified but something is not converged.";

#[derive(Debug, Subcommand)]
enum Command {
    Audit(audit::Args),
    Plan(plan::Args),
    Profile(profile::Args),
    Campaign(campaign::Args),
    Check(check::Args),
    Draw(draw::Args),
    Mission(mission::Args),
    Envelope(envelope::Args),
    QpExport(qp_export::Args),
    Quantise(quantise::Args),
    Dataset(dataset::Args),
    Reproduce(reproduce::Args),
    Inject(inject::Args),
    #[cfg(feature = "training")]
    Train(train::Args),
}

/// How a command ended, where its inputs and outputs were sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
    Success,
    /// It ran, but something is not flyable or not feasible.
    Unsolved,
    /// It ran and all can be flown, but something is not converged.
    NotConverged,
}

/// What a command prints, and how it ended.
struct Output {
    text: String,
    exit: Exit,
}

impl Output {
    /// What was planned, and the worst verdict on it.
    fn judged(text: String, worst: PlanVerdict) -> Self {
        let exit = match worst {
            PlanVerdict::Optimal => Exit::Success,
            PlanVerdict::VerifiedNotConverged => Exit::NotConverged,
            PlanVerdict::NotFlyable => Exit::Unsolved,
        };
        Self { text, exit }
    }

    fn new(text: String, success: bool) -> Self {
        Self { text, exit: if success { Exit::Success } else { Exit::Unsolved } }
    }
}

/// Runs the program with its arguments, the first of which is its name; returns the exit status:
/// 0 done, 1 not flyable or not feasible, 2 bad input (one line on standard error), 3 verified but
/// not converged.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let parsed = Cli::try_parse_from(args).and_then(|cli| match cli.command {
        Some(command) => Ok(command),
        None => Ok(Command::Plan(plan::Args::from_arg_matches(&no_arguments()?)?)),
    });
    let command = match parsed {
        Ok(command) => command,
        Err(error) if !error.use_stderr() => {
            // Help or version.
            print(&error.to_string());
            return 0;
        }
        Err(error) => return refuse(&usage_line(&error)),
    };
    match command.run() {
        Ok(output) => {
            print(&output.text);
            match output.exit {
                Exit::Success => 0,
                Exit::Unsolved => 1,
                Exit::NotConverged => 3,
            }
        }
        Err(error) => refuse(&error.to_string()),
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
            Self::Check(args) => args.run(),
            Self::Draw(args) => args.run(),
            Self::Mission(args) => args.run(),
            Self::Envelope(args) => args.run(),
            Self::QpExport(args) => args.run(),
            Self::Quantise(args) => args.run(),
            Self::Dataset(args) => args.run(),
            Self::Reproduce(args) => args.run(),
            Self::Inject(args) => args.run(),
            #[cfg(feature = "training")]
            Self::Train(args) => args.run(),
        }
    }
}

/// Writes to standard output. A reader that has gone away, such as `head`, is no error.
fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// One line on standard error, whatever the message holds.
fn refuse(message: &str) -> u8 {
    let line: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let _ = writeln!(std::io::stderr(), "error: {line}");
    2
}

/// The message of a usage error in one line, without the usage that follows it.
fn usage_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let message = text.lines().take_while(|line| !line.trim().is_empty());
    let words: Vec<&str> = message.map(str::trim).collect();
    let line = words.join(" ");
    line.strip_prefix("error: ").map(String::from).unwrap_or(line)
}
