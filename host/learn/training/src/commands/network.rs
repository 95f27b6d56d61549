//! `remora-train network`

use super::device::Device;
use super::progress::Steps;
use remora_cli::cli::Output;
use remora_cli::cli::options::{JsonArgs, MissionArgs, jobs};
use remora_core::advanced::stages::NODES;
use remora_host::error::Error;
use remora_host::formats::Mission;
use remora_training::model::Origin;
use remora_training::output::Summary;
use remora_training::recorded::Recorded;
use remora_training::rollout::RolloutError;
use remora_training::shape::Shape;
use remora_training::source::{ExampleSource, Synthetic};
use remora_training::{Config, Run};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Train a network for the learned warm start.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Configuration (*.toml)
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    #[command(flatten)]
    mission: MissionArgs,
    /// Directory of the results; made where it does not exist [default: runs/NAME of the
    /// configuration]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on where the checkpoint in DIR stopped, if there is one
    #[arg(long)]
    resume: bool,
    /// Worker threads
    #[arg(long, value_name = "J", value_parser = jobs(), default_value = "1")]
    jobs: NonZeroUsize,
    /// Where to compute; cuda in programs built with the feature of that name
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    device: Device,
    /// Stop after so many steps, with a checkpoint
    #[arg(long, value_name = "STEPS")]
    stop_after: Option<u64>,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora-train network --config fixtures/models/small.toml --out runs/small
  remora-train network --config fixtures/models/small.toml --out runs/small --resume

DIR gets config.toml, loss.csv, loss.svg, checkpoint.bin, model.f32.model and summary.json. The same
configuration makes the same bits on the same machine, interrupted or not, unless it sets
training.minutes. Two trainings with a job each use two cores better than one with two.

Exit status: 0 done, 1 stopped before the end of the schedule, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.of_all_nodes()?;
        let config = Config::read(&self.config)?;
        self.device.check()?;
        // An error means that there is a pool already, as in tests.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(self.jobs.get()).build_global();
        let name = self.config.file_stem().unwrap_or_default();
        let out = self.out.unwrap_or_else(|| PathBuf::from("runs").join(name));
        let data = Data::read(&config, &mission)?;
        let count = config.training.rollout_count.unwrap_or(ROLLOUT_COUNT);
        let run = Run {
            config,
            source: data.source(),
            origin: data.origin(),
            out,
            resume: self.resume,
            stop_after: self.stop_after,
            rollout: &|model| data.rollout(model, count),
        };
        let outcome = self.device.train(&run, &mut Steps::default())?;
        let summary = Summary::of(&run.config, &outcome);
        summary.write(&run.out)?;
        let last = outcome.checkpoint.rows.last().cloned().unwrap_or_default();
        let text = format!(
            "{} steps, {:.0} s, validation loss {:.5}\nwritten: {}\n",
            outcome.checkpoint.optimiser.step,
            outcome.checkpoint.elapsed_s,
            last.validation,
            run.out.display(),
        );
        Output::new(text, outcome.complete).or_json(self.json.json, &summary)
    }
}

/// Scenarios of a rollout, unless the configuration says how many.
const ROLLOUT_COUNT: usize = 64;

/// Datasets, or random trajectories to measure speed with.
enum Data {
    Recorded(Box<Recorded>),
    Synthetic(Synthetic),
}

impl Data {
    fn read(config: &Config, mission: &Mission) -> Result<Self, Error> {
        if config.data.path.as_os_str() != "synthetic" {
            return Recorded::read(config, mission)
                .map(|recorded| Self::Recorded(Box::new(recorded)));
        }
        let shape = Shape::of(&config.model, NODES, mission.joints());
        Ok(Self::Synthetic(Synthetic::new(shape, config.data.count.unwrap_or(5000) as usize)))
    }

    fn source(&self) -> &dyn ExampleSource {
        match self {
            Self::Recorded(recorded) => &**recorded,
            Self::Synthetic(synthetic) => synthetic,
        }
    }

    fn origin(&self) -> Origin {
        match self {
            Self::Recorded(recorded) => recorded.origin(),
            Self::Synthetic(_) => Origin {
                integrator: "none".into(),
                dataset: "synthetic".into(),
                ..Origin::default()
            },
        }
    }

    fn rollout(&self, model: &[u8], count: usize) -> Option<RolloutError> {
        match self {
            Self::Recorded(recorded) => recorded.rollout(model, count),
            Self::Synthetic(_) => None,
        }
    }
}
