//! `remora learn dataset`

use super::Output;
use super::options::{COUNT, IntegratorArgs, JobsArgs, JsonArgs, MissionArgs, SEED};
use super::parts::{PartArgs, end_when_asked};
use super::progress::Bar;
use crate::report;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::learned::Learned;
use remora_host::method::Method;
use remora_host::request::PlanRequest;
use remora_learn::dataset::{Recipe, SHARD};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Plan scenarios to train a warm start on; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[arg(long, value_name = "N", help = COUNT)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: u64,
    #[arg(long, value_name = "S", help = SEED)]
    seed: u64,
    #[command(flatten)]
    integrator: IntegratorArgs,
    /// Learned model (*.model) [default: none, Stage 2 starts from the heuristic]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Go on in Stage 2 until the cost has settled to 1e-5 instead of 1e-3
    #[arg(long)]
    sharp: bool,
    #[command(flatten)]
    mission: MissionArgs,
    /// Scenarios a file
    #[arg(long, value_name = "N", default_value_t = SHARD)]
    shard: NonZeroU32,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    out: PathBuf,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora learn dataset --count 1000 --seed 1000 --integrator euler --out data/euler-1k
  remora learn dataset --count 1200 --seed 2000 --jobs 8 --out data/rk4-1k
  remora learn dataset --count 3000 --seed 1000 --integrator euler --model first.model --sharp --out data/own
  remora learn dataset --count 30000 --seed 1000 --integrator euler --part 3/200 --out data/shared

Scenarios whose plans are solved and verified are kept. Interrupt it at any time: the same command goes on where it stopped, after the last file of 500
scenarios (--shard). The bytes do not depend on the number of threads. Choose a seed of which nothing will be
evaluated: a model is not to be judged on scenarios it was trained on. --part makes a share of the files, into a
directory that programs on many machines may share; `remora campaign gather DIR` names what is missing.

Exit status: 0 done, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.of_all_nodes()?;
        let joints = mission.joints();
        let (integrator, sharp) = (self.integrator.integrator, self.sharp);
        let method = Method { integrator, sharp, ..Method::default() };
        let guess = self.model.as_deref().map(Learned::usable).transpose()?.into();
        let recipe = Recipe {
            count: self.count,
            seed: self.seed,
            request: PlanRequest { mission, method, guess, ..PlanRequest::default() },
            mission_file: self.mission.file().map(Path::to_path_buf),
            shard: self.shard,
            jobs: self.jobs.jobs(),
            part: self.part.part,
            out: self.out,
        };
        end_when_asked();
        let started = Instant::now();
        let made = recipe.make(&mut Bar::named("dataset"))?;
        let wall_s = started.elapsed().as_secs_f64();
        let text = report::dataset_report(&made, joints, wall_s, &recipe.out);
        Output::new(text, true).or_json(self.json.json, &made)
    }
}
