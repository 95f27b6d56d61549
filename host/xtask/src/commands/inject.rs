//! `cargo xtask inject`

use crate::inject::{Injection, Injector, MAX_COUNT, Site};
use remora_cli::cli::Output;
use remora_cli::cli::options::{
    ForceArgs, IntegratorArgs, JobsArgs, JsonArgs, MissionArgs, SEED, choice, of_all_nodes,
    set_or_built_in,
};
use remora_cli::cli::progress::Bar;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::formats::{check_writable, json, make_directory, write_atomically};
use remora_host::method::Integrator;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Flip bits in what the planner works on, and see what becomes of its plans; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Number of cases
    #[arg(long, value_name = "CASES", default_value_t = 10_000)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    cases: u64,
    #[arg(long, value_name = "S", default_value_t = 1, help = SEED)]
    seed: u64,
    /// Where to flip bits; may be given several times [default: everywhere]
    #[arg(long, value_name = "SITE", value_delimiter = ',')]
    #[arg(value_parser = choice::<Site>())]
    site: Vec<Site>,
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    integrator: IntegratorArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist [default: none is written]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the table as CSV too
    #[arg(long, requires = "out")]
    csv: bool,
    /// Run this case alone
    #[arg(long, value_name = "N", conflicts_with_all = ["cases", "site", "jobs", "out"])]
    #[arg(value_parser = clap::value_parser!(u64).range(0..Site::COUNT * MAX_COUNT))]
    case: Option<u64>,
    /// Show the iterations of both stages
    #[arg(short, long, requires = "case")]
    verbose: bool,
}

/// Name of the file of finished cases, which goes when all are.
const JOURNAL: &str = "inject.journal.jsonl";

const AFTER_HELP: &str = "\
Examples:
  cargo xtask inject --out runs/faults --csv
  cargo xtask inject --cases 2000 --seed 7 --site qp_data --site qp_solution
  cargo xtask inject --cases 500 --site guidance,path
  cargo xtask inject --integrator rk4 --scenarios drawn.scenarios.json
  cargo xtask inject --integrator euler --seed 1 --case 4711 -v

DIR gets inject.json and, with --csv, inject.csv, a row a case. Plans start from the integrator's
built-in model. A case is one flipped bit in the plan of one scenario, or in the flight of one, drawn
from seed and number alone: results do not depend on the number of threads, and any case can be run
again. Interrupt it at any time: the same command goes on where it stopped.

Exit status: 0 no case was wrong, hung or panicked, 1 some were, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let set = set_or_built_in(self.scenarios.as_deref())?;
        let integrator = self.integrator.integrator;
        let injector = Injector {
            seed: self.seed,
            sites: if self.site.is_empty() { Site::ALL.to_vec() } else { self.site.clone() },
            scenarios: set.scenarios,
            mission: of_all_nodes(self.mission.of_default_arm()?, self.mission.file())?,
            integrator,
        };
        if let Some(case) = self.case {
            let replay = injector.replay(case)?;
            let text = crate::inject::replay_report(&replay, self.verbose);
            return Ok(Output::new(text, !replay.record.class.is_forbidden()));
        }
        let files = self.files()?;
        let alarm = |case: u64| hung(self.seed, integrator, case);
        let bar = &mut Bar::named("inject");
        let journal = self.out.as_ref().map(|out| out.join(JOURNAL));
        let injection =
            injector.run(self.cases, self.jobs.jobs(), journal.as_deref(), bar, &alarm)?;
        write(&files, &injection)?;
        // Resumed work is complete: its journal can go.
        if let Some(journal) = journal {
            fs::remove_file(&journal).map_err(|cause| Error::output(&journal, &cause))?;
        }
        let is_sound = injection.is_sound();
        Output::new(crate::inject::injection_report(&injection, &files), is_sound)
            .or_json(self.json.json, &injection)
    }

    /// The files to be written, which can be.
    fn files(&self) -> Result<Vec<PathBuf>, Error> {
        let Some(out) = &self.out else { return Ok(Vec::new()) };
        make_directory(out)?;
        let names = ["inject.json"].into_iter().chain(self.csv.then_some("inject.csv"));
        let files: Vec<PathBuf> = names.map(|name| out.join(name)).collect();
        files.iter().try_for_each(|file| check_writable(file))?;
        files.iter().try_for_each(|file| self.force.keep(file))?;
        Ok(files)
    }
}

fn write(files: &[PathBuf], injection: &Injection) -> Result<(), Error> {
    let failed = |file: &Path, reason: String| Error::Output { file: file.into(), reason };
    for file in files {
        let text = match file.extension().is_some_and(|extension| extension == "csv") {
            true => injection.csv(),
            false => json::to_text(injection).map_err(|error| failed(file, error.to_string()))?,
        };
        write_atomically(file, text.as_bytes())?;
    }
    Ok(())
}

/// A case that does not end holds its thread for ever: the program ends instead.
pub(super) fn hung(seed: u64, integrator: Integrator, case: u64) {
    let _ = writeln!(
        std::io::stderr(),
        "error: case {case} hangs; again: cargo xtask inject --seed {seed} --integrator {integrator} \
         --case {case} -v",
    );
    std::process::exit(1);
}
