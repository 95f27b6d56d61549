//! `remora rerun`

use super::Output;
use super::options::JsonArgs;
use crate::report;
use remora_flight::run::rerun;
use remora_host::error::Error;
use std::path::PathBuf;

/// Fly one run of a folder's flights again, with its history: the same bits.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Directory that `remora fly` or `remora campaign --fly` wrote
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of the run, as in its row
    #[arg(long, value_name = "N")]
    run: u64,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora rerun runs/mine --run 417
  remora rerun runs/mine --run 417 --json

DIR/history/RUN.jsonl and RUN.parquet get a row a second, or a row a step where the flights were flown with --history.

Exit status: 0 flown again, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let (row, history) = rerun(&self.folder, self.run)?;
        Output::new(report::rerun_report(&row, &history), true).or_json(self.json.json, &row)
    }
}
