//! `remora campaign gather`

use super::options::{JobsArgs, JsonArgs};
use super::parts::{command, end_when_asked};
use super::progress::Bar;
use super::{Command, Output};
use crate::report::{self, Again};
use remora_flight::parts as flights;
use remora_host::error::Error;
use remora_host::learned::Learned;
use remora_host::part;
use remora_host::parts::{COMMAND, Difference, gather};
use remora_learn::dataset::{self, MANIFEST};
use serde::Serialize;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Put parts of a campaign, a dataset or flights together, and name those that are missing.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Directory of the parts
    #[arg(value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    directory: PathBuf,
    /// Plan N of the rows again and compare: a machine that computes wrongly is found
    #[arg(long, value_name = "N")]
    recompute: Option<u64>,
    /// Learned model (*.model) [default: the built-in one, where a dataset was made with one]
    #[arg(long, value_name = "FILE", requires = "recompute")]
    model: Option<PathBuf>,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign gather shared
  remora campaign gather shared --recompute 1000 --jobs 8
  remora campaign gather data/own --recompute 100 --model first.model
  remora campaign gather shared --json

All parts must be of one program, mission, method and set of scenarios, each with its own scenarios
and its rows and tables as they were written. Where none is missing DIR gets summary.json. The checksum that is
printed is of all columns but times: the same plans have the same, however many parts there were.

--recompute takes its sample evenly over the scenarios and compares all columns but times, the
checksum of the plan's trajectories among them. Files that the parts were made from must be where
they were. Runs of flights are flown again; of a dataset every number that was kept is compared, and
--model is the model that its plans started from.

Exit status: 0 all there and the same, 1 parts are missing or rows differ, 2 bad input.";

/// Result printed as JSON.
#[derive(Serialize)]
struct Found<'a, T: Serialize> {
    #[serde(flatten)]
    gathered: &'a T,
    #[serde(flatten)]
    again: &'a Again,
}

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        if self.directory.join(MANIFEST).is_file() {
            part::alone(&self.directory, &[MANIFEST], "a dataset")?;
            self.dataset()
        } else if flights::is_flown_in(&self.directory) {
            self.flights()
        } else {
            self.campaign()
        }
    }

    fn campaign(&self) -> Result<Output, Error> {
        let gathered = gather(&self.directory)?;
        let again =
            self.again(gathered.summary.scenarios as u64, |sample, jobs, _| {
                match command(&gathered.command, &self.directory)? {
                    Command::Campaign(args) => args.recompute(&gathered, sample, jobs),
                    _ => Err(Error::input(&self.directory, COMMAND, "is none of a campaign")),
                }
            })?;
        let text = report::gather_report(&gathered, &again);
        self.output(text, gathered.missing.is_empty(), Found { gathered: &gathered, again: &again })
    }

    fn dataset(&self) -> Result<Output, Error> {
        let gathered = dataset::gather(&self.directory)?;
        let again = self.again(gathered.tried, |sample, jobs, bar| {
            let model = self.model.as_deref().map(Learned::usable).transpose()?;
            dataset::recompute(&self.directory, model, sample, jobs, bar)
        })?;
        let text = report::gathered_dataset(&gathered, &again);
        self.output(text, gathered.missing.is_empty(), Found { gathered: &gathered, again: &again })
    }

    fn flights(&self) -> Result<Output, Error> {
        let gathered = flights::gather(&self.directory)?;
        let again = self.again(gathered.summary.runs as u64, |sample, jobs, bar| {
            flights::recompute(&self.directory, &gathered, sample, jobs, bar)
        })?;
        let text = report::gathered_flights(&gathered, &again);
        self.output(text, gathered.missing.is_empty(), Found { gathered: &gathered, again: &again })
    }

    /// Does the sample of so many rows again that is asked for.
    fn again(
        &self,
        rows: u64,
        recompute: impl FnOnce(u64, NonZeroUsize, &mut Bar) -> Result<Vec<Difference>, Error>,
    ) -> Result<Again, Error> {
        // Reading ends at once when asked to: nothing of it is kept.
        end_when_asked();
        let mut bar = Bar::named("recompute");
        let differences = match self.recompute {
            Some(sample) => recompute(sample, self.jobs.jobs(), &mut bar)?,
            None => Vec::new(),
        };
        Ok(Again { recomputed: self.recompute.map(|sample| sample.min(rows)), differences })
    }

    fn output<T: Serialize>(
        &self,
        text: String,
        is_whole: bool,
        found: Found<'_, T>,
    ) -> Result<Output, Error> {
        let is_well = is_whole && found.again.differences.is_empty();
        Output::new(text, is_well).or_json(self.json.json, &found)
    }
}
