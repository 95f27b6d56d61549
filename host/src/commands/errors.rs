//! `remora errors`

use super::Output;
use remora_flight::errors_file;
use remora_host::error::Error;
use remora_truth::Errors;

/// Print errors of the world as a file to change: one standard deviation of each.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Typical errors, all of them assumed; this is what it prints unless told otherwise
    #[arg(long, conflicts_with = "none")]
    default: bool,
    /// No errors at all: a file to switch single ones on
    #[arg(long)]
    none: bool,
}

const AFTER_HELP: &str = "\
Examples:
  remora errors --default > mine.errors.toml
  remora errors --none > one.errors.toml

Every key must be in a file, and no other; docs/flights.md tells what each of them does.

Exit status: 0.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let errors = if self.none { Errors::none() } else { Errors::typical() };
        errors_file::text(&errors).map(Output::data)
    }
}
