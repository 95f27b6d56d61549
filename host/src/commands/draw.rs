//! `remora draw`

use super::Output;
use super::options::{MissionArgs, drawn};
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use std::path::PathBuf;

/// Draw scenarios at random, the same for a seed everywhere.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Number of scenarios
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    /// Seed
    #[arg(long, value_name = "S")]
    seed: u64,
    #[command(flatten)]
    mission: MissionArgs,
    /// Scenario set (*.scenarios.json) to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

const AFTER_HELP: &str = "\
Examples:
  remora draw --count 300 --seed 1 --out drawn.scenarios.json

A smaller count of the same seed is the beginning of a larger one. The mission's geometry decides
which starts violate keep-out or pointing and are drawn again.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let set = drawn(self.count, self.seed, &self.mission.mission()?)?;
        set.write(&self.out)?;
        let text = format!("{} scenarios\nwritten: {}\n", self.count, self.out.display());
        Ok(Output::new(text, true))
    }
}
