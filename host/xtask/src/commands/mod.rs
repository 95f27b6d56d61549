//! The command line: parses, calls the modules, prints. One file a command.

mod audit;
mod firmware;
mod inject;
mod options;
mod profile;
mod replay;
mod reproduce;

use clap::{CommandFactory, Parser, Subcommand};
use remora_cli::cli::options::QuietArgs;
use remora_cli::cli::{self, Output, Program};
use remora_host::error::Error;
use remora_host::formats::VERSION;
use std::ffi::OsString;

/// Tools of the checkout: measures, proves and compares what the planner is said to do.
#[derive(Debug, Parser)]
#[command(name = "xtask", bin_name = "cargo xtask", version = VERSION, after_help = AFTER_HELP)]
// A missing command is an error in one line, as any other.
#[command(arg_required_else_help = false)]
struct Cli {
    #[command(flatten)]
    quiet: QuietArgs,
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  cargo xtask firmware                              does it plan on four processors?
  cargo xtask audit --check                         are budgets kept and pages of today?
  cargo xtask replay runs/pub-000.plan.json         make a plan again, bit for bit
  cargo xtask profile --quick --out runs/profile    how long do plans take here?

Two tools are scripts: ci/peers.py compares the QP solver with others', ci/fuzz.sh fuzzes what is read.

Commands end with 0 where all is well, with 1 where something is not, with 2 on bad input. Colours follow
the terminal; NO_COLOR=1 turns them off.";

#[derive(Debug, Subcommand)]
enum Command {
    Audit(audit::Args),
    Profile(profile::Args),
    Inject(inject::Args),
    Firmware(firmware::Args),
    Replay(replay::Args),
    Reproduce(reproduce::Args),
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
        match self.command {
            Command::Audit(args) => args.run(),
            Command::Profile(args) => args.run(),
            Command::Inject(args) => args.run(),
            Command::Firmware(args) => args.run(),
            Command::Replay(args) => args.run(),
            Command::Reproduce(args) => args.run(),
        }
    }
}
