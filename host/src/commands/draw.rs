//! `remora draw`

use super::Output;
use super::options::{COUNT, ForceArgs, JsonArgs, MissionArgs, SEED, drawn, is_stdout};
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::formats::{ScenarioSet, check_writable};
use remora_host::parts::Scenarios;
use std::path::{Path, PathBuf};

/// Draw scenarios at random, the same for a seed everywhere.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[arg(long, value_name = "N", help = COUNT)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    #[arg(long, value_name = "S", help = SEED)]
    seed: u64,
    /// Those of these indices alone, with commas
    #[arg(long, value_name = "INDICES", value_delimiter = ',')]
    indices: Vec<u64>,
    #[command(flatten)]
    mission: MissionArgs,
    /// Scenario set (*.scenarios.json) to write, - for standard output
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora draw --count 300 --seed 1 --out drawn.scenarios.json
  remora draw --count 3 --seed 1 --out -
  remora draw --count 1000000 --seed 9 --indices 17,411730 --out two.scenarios.json

A smaller count of the same seed is the beginning of a larger one. The mission's geometry decides
which starts violate keep-out or pointing and are drawn again. A file that is there is replaced only
where it was drawn too, or with --force.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let set = self.set()?;
        if !is_stdout(&self.out) {
            check_writable(&self.out)?;
            if !was_drawn(&self.out) {
                self.force.keep(&self.out)?;
            }
            set.write(&self.out)?;
        }
        let count = set.scenarios.len();
        let text = format!("{count} scenarios\nwritten: {}\n", self.out.display());
        Output::new(text, true).or_json(self.json.json || is_stdout(&self.out), &set)
    }

    /// The whole draw, or some of it.
    fn set(&self) -> Result<ScenarioSet, Error> {
        let mission = &self.mission.mission()?;
        let first =
            drawn(if self.indices.is_empty() { self.count } else { 1 }, self.seed, mission)?;
        if self.indices.is_empty() {
            return Ok(first);
        }
        let mut indices = self.indices.clone();
        indices.sort_unstable();
        indices.dedup();
        if let Some(index) = indices.last().filter(|index| **index >= self.count) {
            let reason = format!("{index} is none of {} scenarios", self.count);
            return Err(Error::argument("--indices", reason));
        }
        let source = Scenarios::Drawn { seed: self.seed, count: self.count };
        let scenarios = indices.into_iter().map(|index| source.get(index, mission));
        scenarios.collect::<Result<_, _>>().map(ScenarioSet::new)
    }
}

/// Whether a file is a set that was drawn, which another draw may replace.
fn was_drawn(file: &Path) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    let is_drawn = |id: &str| {
        let numbers = id.strip_prefix('s').and_then(|rest| rest.split_once('-'));
        numbers.is_some_and(|(seed, index)| is_number(seed) && is_number(index))
    };
    ScenarioSet::read(file).is_ok_and(|set| set.scenarios.iter().all(|s| is_drawn(&s.id)))
}
