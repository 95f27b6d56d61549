//! Commands that this build leaves out.

use super::Output;
use remora_host::error::Error;
use std::ffi::OsString;

/// Train a network for the learned warm start (left out of this build).
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Train {
    #[command(flatten)]
    _arguments: Arguments,
}

/// Learn a warm start for a mission: dataset, training and test in one (left out of this build).
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Learn {
    #[command(flatten)]
    _arguments: Arguments,
}

#[derive(Debug, clap::Args)]
struct Arguments {
    /// What the command takes where it is built in
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    _arguments: Vec<OsString>,
}

const AFTER_HELP: &str = "\
This build leaves the command out: it needs many crates and is slow to build. To get it, in a checkout:
  cargo build --release --features training -p remora
or, for an NVIDIA GPU, with --features cuda. Then target/release/remora has it, with its help.";

impl Train {
    pub(super) fn run(self) -> Result<Output, Error> {
        let reason = "is left out of this build; `remora train --help` says how to get it";
        Err(Error::argument("train", reason))
    }
}

impl Learn {
    pub(super) fn run(self) -> Result<Output, Error> {
        let reason = "is left out of this build; `remora learn --help` says how to get it";
        Err(Error::argument("learn", reason))
    }
}
