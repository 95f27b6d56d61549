//! `remora dataset`

use super::Output;
use super::options::MissionArgs;
use super::progress::Bar;
use crate::report;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::learned::Learned;
use remora_host::method::Integrator;
use remora_learn::dataset::{Recipe, SHARD};
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;
use std::time::Instant;

/// Plan scenarios to train a warm start on; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenarios to try; those that are solved and verified are kept
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    /// Seed of the draw
    #[arg(long, value_name = "S")]
    seed: u64,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4
    #[arg(long, value_name = "NAME", default_value_t = Integrator::RK4)]
    integrator: Integrator,
    /// Start Stage 2 from the roll-outs of this model (*.model) [default: from the heuristic]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    #[command(flatten)]
    mission: MissionArgs,
    /// Scenarios a file
    #[arg(long, value_name = "N", default_value_t = SHARD)]
    shard: NonZeroU32,
    /// Worker threads [default: the machine's cores]
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
    /// Directory of the dataset; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

const AFTER_HELP: &str = "\
Examples:
  remora dataset --count 10000 --seed 1000 --integrator euler --out data/euler-10k
  remora dataset --count 12000 --seed 2000 --jobs 8 --out data/rk4-12k
  remora dataset --count 30000 --seed 1000 --integrator euler --model first.model --out data/own

Interrupt it at any time: the same command goes on where it stopped, after the last file of 500
scenarios (--shard). The bytes do not depend on the number of threads. Choose a seed of which nothing will be
evaluated: a model is not to be judged on scenarios it was trained on.

Exit status: 0 done, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let recipe = Recipe {
            count: self.count,
            seed: self.seed,
            integrator: self.integrator,
            model: self.model.as_deref().map(Learned::usable).transpose()?,
            mission: self.mission.mission()?,
            shard: self.shard,
            jobs: self.jobs.unwrap_or_else(cores),
            out: self.out,
        };
        let started = Instant::now();
        let made = recipe.make(&mut Bar::default())?;
        let text = report::dataset_report(&made, started.elapsed().as_secs_f64(), &recipe.out);
        Ok(Output::new(text, true))
    }
}
