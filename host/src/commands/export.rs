//! `remora export`

use super::Output;
use super::options::{ForceArgs, JsonArgs, choice};
use crate::report;
use remora_export::epoch::Epoch;
use remora_export::job::{Export, Format};
use remora_host::error::Error;
use std::path::PathBuf;

/// Write a plan as files of other tools: CCSDS ephemerides, recordings for viewers.
///
/// A plan is in axes that turn with the target's orbit, from time zero on. Ephemerides are in inertial
/// axes and have dates: they need the epoch of the first node, and the target's orbit at that time.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json)
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Kind of file
    #[arg(long, value_name = "FORMAT", value_parser = choice::<Format>(), required = true)]
    format: Vec<Format>,
    /// When the plan begins, UTC; oem and aem need it [default: 1970-01-01T00:00:00]
    #[arg(long, value_name = "TIME")]
    epoch: Option<Epoch>,
    /// The target's orbit at that time (*.chief.toml); oem and aem need it [default: none]
    #[arg(long, value_name = "FILE")]
    chief: Option<PathBuf>,
    /// From row to row between the nodes, which have rows too [default: 1; Euler's plans: nodes alone]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    step: Option<f64>,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora export runs/pub-000.plan.json --format mcap --out runs/shown
  remora export a.plan.json --format oem --epoch 2026-11-23T00:00:00 --chief b.chief.toml --out c

--format may be repeated. Writes DIR/ID.mcap, and DIR/ID.servicer.oem, DIR/ID.target.oem, DIR/ID.servicer.aem, DIR/ID.target.aem.
What stands in them, and in the chief's file, is told in docs/export.md.

Exit status: 0 written, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mut formats = Vec::new();
        for format in self.format {
            if !formats.contains(&format) {
                formats.push(format);
            }
        }
        if self.chief.is_some() && !formats.iter().any(|format| format.is_inertial()) {
            return Err(Error::argument("--chief", "has no use without oem or aem"));
        }
        let export = Export {
            plan: self.plan,
            formats,
            epoch: self.epoch,
            chief: self.chief,
            step: self.step,
            out: self.out,
        };
        let exported = export.run(|file| self.force.keep(file))?;
        Output::new(report::exported_report(&exported), true).or_json(self.json.json, &exported)
    }
}
