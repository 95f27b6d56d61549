//! `remora campaign`

use super::Output;
use super::options::{DeadlineArgs, JobsArgs, JsonArgs, MethodArgs, MissionArgs, SetArgs};
use super::progress::Bar;
use crate::report;
use remora_core::advanced::model::Mission;
use remora_host::campaign::Campaign;
use remora_host::error::Error;
use remora_host::formats::Verdict;
use remora_host::with_joints;
use std::path::PathBuf;

/// Plan many scenarios over several threads; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[command(flatten)]
    set: SetArgs,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    /// Write DIR/plans/ID.plan.json too
    #[arg(long)]
    plans: bool,
    /// Write the table as CSV too
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign --scenarios a.scenarios.json --out runs/a
  remora campaign --count 300 --seed 1 --integrator euler --jobs 8 --plans --csv --out runs/b
  remora campaign --count 300 --seed 7 --warm-start model --model mine.model --out runs/mine
  remora campaign --count 300 --seed 1 --deadline 0.5 --jobs 1 --out runs/c

DIR gets results.parquet (--csv: results.csv too), summary.json, the scenarios and, with --plans, a
plan a scenario. Interrupt it at any time: the same command goes on where it stopped. Results do not depend on the
number of threads, but for times. A campaign with --deadline is not reproducible bit by bit: where
a plan stops depends on the machine, its load and --jobs.

A scenario that no plan can end well is refused before planning: a row with status infeasible and
the constraint's name as its reason.

Scenarios that the model, or one that it descends from, has learnt from are refused.

Exit status: 0 all optimal, 1 some are not flyable, 2 bad input, 3 all verified but some not converged.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = self.mission.any()?;
        with_joints!(mission.joints(), NL => {
            self.run_for::<NL>(mission.of()?)
        } else {
            Err(mission.wrong_joints())
        })
    }

    fn run_for<const NL: usize>(self, mission: Mission<NL>) -> Result<Output, Error> {
        let chosen = self.set.chosen(&mission)?;
        let campaign = Campaign {
            mission,
            method: self.method.method_until(&self.deadline),
            model: self.method.model_to_judge(&chosen.scenarios)?,
            scenarios: chosen.scenarios,
            seed: chosen.seed,
            jobs: self.jobs.jobs(),
            save_plans: self.plans,
            csv: self.csv,
            out: self.out,
        };
        let results = campaign.run(&mut Bar::named("campaign"))?;
        let worst = results.rows.iter().map(|row| row.verdict).max().unwrap_or(Verdict::Optimal);
        Output::judged(report::campaign_report(&results), worst)
            .or_json(self.json.json, &results.summary)
    }
}
