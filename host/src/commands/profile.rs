//! `remora profile`

use super::Output;
use super::options::{MissionArgs, read_or_drawn};
use super::progress::Bar;
use remora_audit::profile::{Configuration, Profiler, Rounds};
use remora_audit::report;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::formats::{ScenarioSet, check_writable, json, make_directory, write_atomically};
use std::num::NonZeroU16;
use std::path::PathBuf;

/// Measure how long plans take, phase by phase, on one core and on two.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["draw", "seed"])]
    scenarios: Option<PathBuf>,
    /// Draw so many scenarios instead; needs --seed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    draw: Option<u64>,
    /// Seed of the draw
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    #[command(flatten)]
    mission: MissionArgs,
    /// Rounds over the scenarios with Euler on one core; on two it gets a quarter, RK4 a ninth
    /// [default: 17]
    #[arg(long, value_name = "R")]
    rounds: Option<NonZeroU16>,
    /// One round
    #[arg(long, conflicts_with = "rounds")]
    quick: bool,
    /// The two cores to plan on [default: the first two this program may use]
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    cores: Option<Vec<usize>>,
    /// Only configurations whose name, such as rk4-optimal-model, holds this
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Directory to write profile.json to; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

const AFTER_HELP: &str = "\
Examples:
  remora profile
  remora profile --quick --only euler --out runs/profile
  remora profile --cores 2,3 --rounds 50
  remora profile --draw 300 --seed 1 --only rk4-optimal

Plans on two pinned cores: nothing else should run there meanwhile. The report tells how busy the
machine was. Every configuration takes its turn scenario by scenario. What the bars of the report
ask for depends on the machine: a missed bar is no failure of the command.

Exit status: 0 done, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.mission()?;
        let chosen = read_or_drawn(self.scenarios.as_deref(), self.draw, self.seed, &mission)?;
        let scenarios = match chosen {
            Some(set) => set,
            None => ScenarioSet::built_in()?,
        };
        let profiler = Profiler {
            scenarios: scenarios.scenarios,
            mission,
            configurations: self.configurations()?,
            rounds: self.rounds(),
            cores: self.cores()?,
        };
        let file = self.out.as_ref().map(|directory| directory.join("profile.json"));
        if let (Some(directory), Some(file)) = (&self.out, &file) {
            make_directory(directory)?;
            check_writable(file)?;
        }
        let profile = profiler.run(&mut Bar::default())?;
        let mut text = report::profile_report(&profile);
        if let Some(file) = &file {
            let json = json::to_text(&profile)
                .map_err(|error| Error::Output { file: file.clone(), reason: error.to_string() })?;
            write_atomically(file, json.as_bytes())?;
            text.push_str(&format!("written: {}\n", file.display()));
        }
        Ok(Output::new(text, true))
    }

    fn rounds(&self) -> Rounds {
        match (self.quick, self.rounds) {
            (true, _) => Rounds::of(1),
            (false, Some(rounds)) => Rounds::of(rounds.get().into()),
            (false, None) => Rounds::DEFAULT,
        }
    }

    fn cores(&self) -> Result<Option<[usize; 2]>, Error> {
        let wrong = |_| Error::argument("--cores", "needs two cores, A,B");
        self.cores.clone().map(|cores| <[usize; 2]>::try_from(cores).map_err(wrong)).transpose()
    }

    fn configurations(&self) -> Result<Vec<Configuration>, Error> {
        let mut chosen = Configuration::all();
        if let Some(text) = &self.only {
            chosen.retain(|configuration| configuration.name().contains(text));
            if chosen.is_empty() {
                let names: Vec<String> =
                    Configuration::all().iter().map(Configuration::name).collect();
                let reason = format!("none of {} holds {text:?}", names.join(", "));
                return Err(Error::argument("--only", reason));
            }
        }
        Ok(chosen)
    }
}
