//! `remora inject`

use super::options::{MissionArgs, choice};
use super::progress::Bar;
use super::{Exit, Output};
use remora_audit::inject::{Injection, Injector, MAX_COUNT, Site};
use remora_audit::report;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::formats::{ScenarioSet, check_writable, json, make_directory, write_atomically};
use remora_host::method::Integrator;
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Flip bits in what the planner works on, and see what becomes of its plans.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Number of cases
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    /// Seed of the cases
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Where to flip bits; may be given several times [default: everywhere]
    #[arg(long, value_name = "SITE", value_parser = choice::<Site>())]
    site: Vec<Site>,
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    #[command(flatten)]
    mission: MissionArgs,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4; plans start from its built-in model
    #[arg(long, value_name = "NAME", default_value_t = Integrator::EULER)]
    integrator: Integrator,
    /// Worker threads [default: the machine's cores]
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
    /// Directory for inject.json; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write DIR/inject.csv too, a row a case
    #[arg(long, requires = "out")]
    csv: bool,
    /// Run this case alone
    #[arg(long, value_name = "N", conflicts_with_all = ["count", "site", "jobs", "out"])]
    #[arg(value_parser = clap::value_parser!(u64).range(0..8 * MAX_COUNT))]
    case: Option<u64>,
    /// Show the iterations of that case
    #[arg(short, long, requires = "case")]
    verbose: bool,
}

const AFTER_HELP: &str = "\
Examples:
  remora inject --out runs/faults --csv
  remora inject --count 2000 --seed 7 --site qp_data --site qp_solution
  remora inject --integrator rk4 --scenarios drawn.scenarios.json
  remora inject --seed 1 --case 4711 -v

A case is one flipped bit in the plan of one scenario, drawn from seed and number alone: results
do not depend on the number of threads, and any case can be run again.

Exit status: 0 no case was wrong, hung or panicked, 1 some were, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let set = match &self.scenarios {
            Some(file) => ScenarioSet::read(file)?,
            None => ScenarioSet::built_in()?,
        };
        let injector = Injector {
            seed: self.seed,
            sites: if self.site.is_empty() { Site::ALL.to_vec() } else { self.site.clone() },
            scenarios: set.scenarios,
            mission: self.mission.mission()?,
            integrator: self.integrator,
        };
        if let Some(case) = self.case {
            let replay = injector.replay(case)?;
            let text = report::replay_report(&replay, self.verbose);
            return Ok(Output::new(text, !replay.record.class.is_forbidden()));
        }
        let files = self.files()?;
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let jobs = self.jobs.unwrap_or_else(cores);
        let alarm = |case: u64| hung(self.seed, self.integrator, case);
        let injection = injector.run(self.count, jobs, &mut Bar::default(), &alarm)?;
        write(&files, &injection)?;
        let text = report::injection_report(&injection, &files);
        let exit = if injection.is_sound() { Exit::Success } else { Exit::Unsolved };
        Ok(Output { text, exit })
    }

    /// The files to be written, which can be.
    fn files(&self) -> Result<Vec<PathBuf>, Error> {
        let Some(out) = &self.out else { return Ok(Vec::new()) };
        make_directory(out)?;
        let names = ["inject.json"].into_iter().chain(self.csv.then_some("inject.csv"));
        let files: Vec<PathBuf> = names.map(|name| out.join(name)).collect();
        files.iter().try_for_each(|file| check_writable(file))?;
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
        "error: case {case} hangs; again: remora inject --seed {seed} --integrator {integrator} \
         --case {case} -v",
    );
    std::process::exit(1);
}
