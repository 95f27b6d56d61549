//! `remora mission errors`

use super::Output;
use super::options::choice;
use remora_flight::errors_file;
use remora_host::choice::choices;
use remora_host::error::Error;
use remora_truth::Errors;

/// Print errors of the world as a file to change: one standard deviation of each.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Which errors
    #[arg(value_name = "WHICH", value_parser = choice::<ErrorsName>(), default_value = "typical")]
    which: ErrorsName,
}

choices! {
    /// Errors that have a name, by which `--errors` takes them too.
    enum ErrorsName {
        /// Typical errors, all of them assumed.
        Typical = "typical",
        /// No errors at all: a file to switch single ones on.
        None = "none",
    }
}

const AFTER_HELP: &str = "\
Examples:
  remora mission errors typical > mine.errors.toml
  remora mission errors none > one.errors.toml

Every key must be in a file, and no other; docs/guides/simulate.md tells what each section does.

Exit status: 0.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let errors = match self.which {
            ErrorsName::Typical => Errors::typical(),
            ErrorsName::None => Errors::none(),
        };
        errors_file::text(&errors).map(Output::data)
    }
}
