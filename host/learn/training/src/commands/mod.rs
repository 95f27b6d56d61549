//! The command line: one file a command.

#[cfg(test)]
mod conventions;
mod device;
mod mission;
mod network;
mod progress;

use clap::{Parser, Subcommand};
use remora_cli::cli::options::QuietArgs;
use remora_cli::cli::{self, Output, Program};
use remora_host::error::Error;
use remora_host::formats::VERSION;
use std::ffi::OsString;

/// Trains networks for the learned starts of `remora`.
#[derive(Debug, Parser)]
#[command(name = "remora-train", version = VERSION, after_help = AFTER_HELP)]
#[command(arg_required_else_help = false)]
struct Cli {
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  remora-train mission mine.mission.toml --hours 8 --out mine.model  all that a mission's model takes
  remora-train network --config fixtures/models/small.toml           a network by a configuration

Commands end with 0 where all is done, with 1 where it is not, and with 2 at bad input.";

#[derive(Debug, Subcommand)]
enum Command {
    Mission(mission::Args),
    Network(network::Args),
}

impl Command {
    fn run(self) -> Result<Output, Error> {
        match self {
            Self::Mission(args) => args.run(),
            Self::Network(args) => args.run(),
        }
    }
}

impl Program for Cli {
    fn is_quiet(&self) -> bool {
        self.quiet.quiet
    }

    fn run(self) -> Result<Output, Error> {
        self.command.run()
    }
}

/// Runs the program with its arguments, the first of which is its name; returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    cli::run::<Cli>(args)
}
