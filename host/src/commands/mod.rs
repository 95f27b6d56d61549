//! The command line: parses, calls the library, prints. One file a command.

mod campaign;
mod check;
mod dataset;
mod draw;
mod envelope;
mod errors;
mod export;
mod fly;
mod flying;
mod gather;
mod generate;
mod groups;
mod import;
mod parts;
mod plan;
mod programs;
mod quantise;
#[cfg(test)]
mod refusals;
mod rerun;
mod safety;
mod show;
mod view;

use crate::cli::options::QuietArgs;
use crate::cli::{self, Output, Program, options, progress};
use clap::{ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use remora_host::error::Error;
use remora_host::formats::VERSION;
use std::ffi::OsString;

/// Plans how a free-flying servicer with a robot arm catches a tumbling object.
///
/// Without a command: plans the first of the built-in scenarios, as `remora plan` does.
#[derive(Debug, Parser)]
#[command(name = "remora", version = VERSION, after_help = AFTER_HELP)]
struct Cli {
    #[command(flatten)]
    quiet: QuietArgs,
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
  remora mission show                                what follows from a mission's numbers
  remora generate man > remora.1                     the manual; bash, zsh and fish: completions

A plan is one of three:
  optimal                     verified, and what was asked for was reached            exit status 0
  verified but not converged  verified: it can be flown, but may cost more            exit status 3
  not flyable                 a constraint is violated, or it was refused beforehand  exit status 1

Other commands end with 0 where all is well and with 1 where something is not. Bad input is 2 with every
command. Colours follow the terminal; NO_COLOR=1 turns them off.";

#[derive(Debug, Subcommand)]
enum Command {
    Plan(plan::Args),
    Campaign(campaign::Args),
    Check(check::Args),
    View(view::Args),
    Fly(fly::Args),
    Draw(draw::Args),
    Mission(groups::MissionArgs),
    Export(export::Args),
    Learn(groups::LearnArgs),
    Generate(generate::Args),
}

/// Runs the program with its arguments, the first of which is its name; returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    cli::run::<Cli>(args)
}

/// The command line, for whoever looks through it.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

impl Program for Cli {
    fn is_quiet(&self) -> bool {
        self.quiet.quiet
    }

    fn run(self) -> Result<Output, Error> {
        let Some(command) = self.command else {
            let plan = no_arguments().and_then(|matches| plan::Args::from_arg_matches(&matches));
            let wrong = |error: clap::Error| Error::argument("plan", error.to_string());
            return plan.map_err(wrong)?.run();
        };
        command.run()
    }
}

/// Parses `remora plan` without arguments.
fn no_arguments() -> Result<ArgMatches, clap::Error> {
    plan::Args::augment_args(clap::Command::new("plan")).try_get_matches_from(["plan"])
}

impl Command {
    fn run(self) -> Result<Output, Error> {
        match self {
            Self::Plan(args) => args.run(),
            Self::Campaign(args) => args.run(),
            Self::Check(args) => args.run(),
            Self::View(args) => args.run(),
            Self::Fly(args) => args.run(),
            Self::Draw(args) => args.run(),
            Self::Mission(args) => args.run(),
            Self::Export(args) => args.run(),
            Self::Learn(args) => args.run(),
            Self::Generate(args) => args.run(),
        }
    }
}
