//! `remora campaign`

use super::Output;
use super::options::{MethodArgs, MissionArgs, read_or_drawn};
use super::progress::Bar;
use crate::report;
use remora_host::campaign::Campaign;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::formats::PlanVerdict;
use remora_host::method::Deadline;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Plan many scenarios over several threads; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenario set (*.scenarios.json)
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
    #[command(flatten)]
    method: MethodArgs,
    /// Time for each plan, a positive number; with it the results depend on the machine and its
    /// load, and no second run need give the same bits [default: none]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    deadline: Option<Deadline>,
    /// Worker threads [default: the machine's cores]
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
    /// Write DIR/plans/ID.plan.json too
    #[arg(long)]
    plans: bool,
    /// Write DIR/results.csv beside DIR/results.parquet
    #[arg(long)]
    csv: bool,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign --scenarios a.scenarios.json --out runs/a
  remora campaign --draw 300 --seed 1 --integrator euler --jobs 8 --plans --csv --out runs/b
  remora campaign --draw 300 --seed 7 --warm-start model --model mine.model --out runs/mine
  remora campaign --draw 300 --seed 1 --deadline 0.5 --jobs 1 --out runs/c

Interrupt it at any time: the same command goes on where it stopped. Results do not depend on the
number of threads, but for times. A campaign with --deadline is not reproducible bit by bit: where
a plan stops depends on the machine, its load and --jobs.

A scenario that no plan can end well is refused before planning: a row with status infeasible and
the constraint's name as its reason.

Scenarios that the model, or one that it descends from, has learnt from are refused.

Exit status: 0 all optimal, 1 some are not flyable, 2 bad input, 3 all verified but some not converged.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.mission()?;
        let chosen = read_or_drawn(self.scenarios.as_deref(), self.draw, self.seed, &mission)?;
        let scenarios = chosen.ok_or_else(|| {
            let reason = "one of --scenarios FILE and --draw N --seed S is needed";
            Error::argument("campaign", reason)
        })?;
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let scenarios = scenarios.scenarios;
        let campaign = Campaign {
            mission,
            method: self.method.method_until(self.deadline),
            model: self.method.model_to_judge(&scenarios)?,
            scenarios,
            jobs: self.jobs.unwrap_or_else(cores),
            save_plans: self.plans,
            csv: self.csv,
            out: self.out,
        };
        let results = campaign.run(&mut Bar::default())?;
        let worst = results.rows.iter().map(|row| row.verdict).max();
        let worst = worst.unwrap_or(PlanVerdict::Optimal);
        Ok(Output::judged(report::campaign_report(&results), worst))
    }
}
