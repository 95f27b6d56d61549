//! `remora-train mission`

use super::device::Device;
use super::progress::Steps;
use remora_cli::cli::Output;
use remora_cli::cli::options::{ForceArgs, IntegratorArgs, JobsArgs, JsonArgs, SEED, of_all_nodes};
use remora_cli::cli::progress::{Bar, tell};
use remora_host::error::Error;
use remora_host::formats::read_mission;
use remora_host::lineage;
use remora_training::learning::{Hands, Learning, Learnt};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Learn a warm start for a mission: dataset, training, quantisation and a paired test in one.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Mission file (*.mission.toml) [default: the built-in mission]
    #[arg(value_name = "MISSION")]
    mission: Option<PathBuf>,
    /// Hours of work in all, over all interruptions
    #[arg(long, value_name = "H", value_parser = hours, allow_hyphen_values = true)]
    hours: f64,
    #[command(flatten)]
    integrator: IntegratorArgs,
    #[arg(long, value_name = "S", default_value_t = 5000, help = SEED)]
    seed: u64,
    /// Start from random numbers, not from the built-in model
    #[arg(long)]
    anew: bool,
    #[command(flatten)]
    jobs: JobsArgs,
    /// Where to compute; cuda in programs built with the feature of that name
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    device: Device,
    /// Directory of dataset, training and test [default: FILE.work]
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Model to write (*.model)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora-train mission mine.mission.toml --hours 8 --out mine.model
  remora-train mission mine.mission.toml --hours 2 --integrator euler --jobs 2 --out mine-euler.model
  remora plan --mission mine.mission.toml --model mine.model

Half of the hours go to planning scenarios, what is left of nine tenths to training (which ends early
after 100 passes), the last tenth to planning other scenarios from the heuristic and from the model.
However few the hours, 200 scenarios are planned (more where none of them would be held out), 50 steps
trained and 20 scenarios tested.

Interrupt it at any time: the same command goes on where it stopped, and the hours count on. Other
arguments or another mission are refused. The result depends on the clock.

Exit status: 0 done, also where the model is worse than the heuristic (it says so); 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let file = self.mission.as_deref();
        let mission = of_all_nodes(read_mission(file)?, file)?;
        self.device.check()?;
        let jobs = self.jobs.jobs();
        let learning = Learning {
            mission,
            hours: self.hours,
            integrator: self.integrator.integrator,
            seed: self.seed,
            anew: self.anew,
            jobs,
            work: self.work.unwrap_or_else(|| beside(&self.out)),
            out: self.out,
        };
        if !learning.is_begun()? {
            self.force.keep(&learning.out)?;
        }
        // An error means that there is a pool already, as in tests.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(jobs.get()).build_global();
        let device = self.device;
        let learnt = learning.run(&mut Hands {
            tell: &|line| tell(line),
            dataset: &mut Bar::named("dataset"),
            train: &mut |run| device.train(run, &mut Steps::default()),
            test: &mut Bar::named("test"),
        })?;
        Output::new(report(&learnt), true).or_json(self.json.json, &learnt)
    }
}

/// A positive number of hours.
fn hours(text: &str) -> Result<f64, String> {
    let hours: f64 = text.parse().map_err(|_| "expected a number of hours".to_string())?;
    match hours.is_finite() && hours > 0.0 {
        true => Ok(hours),
        false => Err("must be positive and finite".into()),
    }
}

/// The work directory of a model: `mine.model.work`.
fn beside(out: &Path) -> PathBuf {
    let mut name = OsString::from(out);
    name.push(".work");
    name.into()
}

fn report(learnt: &Learnt) -> String {
    let Learnt { model, scenarios, trajectories, steps, test, test_seed, .. } = learnt;
    format!(
        "{trajectories} of {scenarios} scenarios solved to learn from, {steps} steps of training\n\n\
         Test on {} other scenarios (seed {test_seed}), 95 % intervals in brackets:\n\n{}\n\
         written: {}\nwritten: {}\n",
        test.model.success.of,
        test.text(),
        model.display(),
        lineage::path_of(model).display(),
    )
}
