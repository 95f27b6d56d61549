//! `cargo xtask profile`

use crate::audit::profile::{Configuration, Profiler, Rounds, profile_report};
use remora_cli::cli::Output;
use remora_cli::cli::options::{ForceArgs, JsonArgs, MissionArgs, SetArgs};
use remora_cli::cli::progress::Bar;
use remora_host::error::Error;
use remora_host::formats::{check_writable, json, make_directory, write_atomically};
use std::fs;
use std::num::NonZeroU16;
use std::path::PathBuf;

/// Measure how long plans take, phase by phase, on one core and on two.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[command(flatten)]
    set: SetArgs,
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
    configurations: Option<String>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist [default: none is written]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Name of the journal in the directory of the results.
const JOURNAL: &str = "profile.journal.jsonl";

const AFTER_HELP: &str = "\
Examples:
  cargo xtask profile
  cargo xtask profile --quick --configurations euler --out runs/profile
  cargo xtask profile --cores 2,3 --rounds 50
  cargo xtask profile --count 300 --seed 1 --configurations rk4-optimal

DIR gets profile.json. Interrupt it at any time: the same command goes on where it stopped. Plans on two
pinned cores: nothing else should run there meanwhile. The report tells how busy the machine was. Every
configuration takes its turn scenario by scenario. What the bars of the report ask for depends on the
machine: a missed bar is no failure of the command.

Exit status: 0 done, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.of_default_arm()?;
        let chosen = self.set.chosen(&mission)?;
        let profiler = Profiler {
            scenarios: chosen.scenarios,
            mission,
            configurations: self.configurations()?,
            rounds: self.rounds(),
            cores: self.cores()?,
        };
        let file = self.out.as_ref().map(|directory| directory.join("profile.json"));
        if let (Some(directory), Some(file)) = (&self.out, &file) {
            make_directory(directory)?;
            check_writable(file)?;
            self.force.keep(file)?;
        }
        let journal = self.out.as_ref().map(|directory| directory.join(JOURNAL));
        let profile = profiler.run(journal.as_deref(), &mut Bar::named("profile"))?;
        let mut text = profile_report(&profile);
        if let Some(file) = &file {
            let json = json::to_text(&profile)
                .map_err(|error| Error::Output { file: file.clone(), reason: error.to_string() })?;
            write_atomically(file, json.as_bytes())?;
            text.push_str(&format!("written: {}\n", file.display()));
        }
        // Resumed work is complete: its journal can go.
        if let Some(journal) = journal {
            fs::remove_file(&journal).map_err(|cause| Error::output(&journal, &cause))?;
        }
        Output::new(text, true).or_json(self.json.json, &profile)
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
        if let Some(text) = &self.configurations {
            chosen.retain(|configuration| configuration.name().contains(text));
            if chosen.is_empty() {
                let names: Vec<String> =
                    Configuration::all().iter().map(Configuration::name).collect();
                let reason = format!("none of {} holds {text:?}", names.join(", "));
                return Err(Error::argument("--configurations", reason));
            }
        }
        Ok(chosen)
    }
}
