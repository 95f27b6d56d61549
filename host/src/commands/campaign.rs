//! `remora campaign`

use super::Output;
use super::flying::{FlyingArgs, Ready, RunsArgs};
use super::options::{Chosen, DeadlineArgs, JobsArgs, JsonArgs, MethodArgs, MissionArgs, SetArgs};
use super::parts::{PartArgs, arguments, end_when_asked};
use super::progress::Bar;
use crate::report;
use remora_core::advanced::model::Mission;
use remora_host::campaign::{Campaign, Results, Summary};
use remora_host::error::Error;
use remora_host::formats::{Row, Verdict};
use remora_host::learned::Learned;
use remora_host::parts::{self, Difference, GatheredParts, Job, Scenarios};
use remora_host::with_joints;
use remora_truth::Errors;
use std::io::{Write, stderr};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Most plan files that a directory gets.
const MOST_PLAN_FILES: usize = 10_000;
/// Most scenarios of a campaign in one piece, which keeps all of their rows: 4 kB of memory each.
const MOST_IN_ONE_PIECE: u64 = 50_000;

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
    #[arg(long, conflicts_with = "part")]
    plans: bool,
    /// Write the table as CSV too
    #[arg(long, conflicts_with = "part")]
    csv: bool,
    /// Write DIR/report.html too, and pages of notable plans in three dimensions
    #[arg(long, conflicts_with = "part")]
    report: bool,
    #[command(flatten)]
    part: PartArgs,
    /// Write a table of trajectories too, a row a node
    #[arg(long, requires = "part")]
    nodes: bool,
    /// Fly the plans too, in a world with these errors: a file (*.errors.toml), typical or none
    #[arg(long, value_name = "ERRORS", conflicts_with = "part")]
    fly: Option<PathBuf>,
    #[command(flatten)]
    runs: RunsArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    // Kept last: its heading holds for all options below it.
    #[command(flatten)]
    flying: FlyingArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign --scenarios a.scenarios.json --out runs/a
  remora campaign --count 300 --seed 1 --integrator euler --jobs 8 --plans --csv --out runs/b
  remora campaign --count 300 --seed 7 --warm-start model --model mine.model --out runs/mine
  remora campaign --count 300 --seed 1 --deadline 0.5 --jobs 1 --out runs/c
  remora campaign --count 300 --seed 1 --report --out runs/d
  remora campaign --count 300 --seed 1 --fly mine.errors.toml --runs 4 --out runs/flown
  remora campaign --count 1000000 --seed 9 --integrator euler --part 17/1000 --out shared

DIR gets results.parquet (--csv: results.csv too), summary.json, the scenarios and, with --plans, a
plan a scenario. Interrupt it at any time: the same command goes on where it stopped. Results do not
depend on the number of threads, but for times. A campaign with --deadline is not reproducible bit
by bit: where a plan stops depends on the machine, its load and --jobs.

A scenario that no plan can end well is refused before planning: a row with status infeasible and
the constraint's name as its reason.

Scenarios that the model, or one that it descends from, has learnt from are refused.

With --report every plan is kept, and DIR/report.html links those worth a look to pages like those
of `remora view`. With --fly every plan is kept and flown --runs times, and DIR gets what `remora
fly` writes; the seed of the errors is that of the scenarios.

With --part DIR gets part-00017-of-01000.jsonl, the rows, and part-00017-of-01000.parquet, the same as
a table; whole or not at all. Programs on many machines may share it: `remora submit` prints their
jobs, `remora gather DIR` puts the parts together. Rows are kept on the disk, not in memory: more than
50,000 scenarios are planned in parts alone, be it part 1/1. SIGTERM ends a part after the plans in
hand; the same command goes on.

Exit status: with --part 0 written, 143 (130) ended by SIGTERM (SIGINT); without it 0 all optimal,
1 some are not flyable (with --fly: not all captured), 2 bad input, 3 all verified but some not
converged.";

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
        end_when_asked();
        if let Some(part) = self.part.part {
            let job = self.job(mission, arguments()?)?;
            let made =
                parts::make(&job, part, self.jobs.jobs(), &self.out, &mut Bar::named("part"))?;
            warn_of(job.model.as_ref());
            return Output::new(report::part_report(&made), true).or_json(self.json.json, &made);
        }
        let chosen = self.in_one_piece(&mission)?;
        let errors = self.fly.as_deref().map(|file| errors_of_flights(file, &self.method, NL));
        let errors = errors.transpose()?;
        let save_plans = self.plans || self.report || errors.is_some();
        let count = chosen.scenarios.len();
        if save_plans && count > MOST_PLAN_FILES {
            let reason = format!(
                "{count} plan files are too many for a directory: --part I/N --nodes writes all of them as tables"
            );
            return Err(Error::argument("--plans", reason));
        }
        let campaign = Campaign {
            mission,
            method: self.method.method_until(&self.deadline),
            model: self.method.model_to_judge(&chosen.scenarios)?,
            scenarios: chosen.scenarios,
            seed: chosen.seed,
            jobs: self.jobs.jobs(),
            save_plans,
            csv: self.csv,
            out: self.out.clone(),
        };
        let mut results = campaign.run(&mut Bar::named("campaign"))?;
        warn_of(campaign.model.as_ref());
        if self.report {
            results.files.push(report::write_campaign_page(&self.out, &results)?);
        }
        if let Some(errors) = errors {
            return self.flown(&campaign, &results, errors);
        }
        let worst = results.rows.iter().map(|row| row.verdict).max().unwrap_or(Verdict::Optimal);
        Output::judged(report::campaign_report(&results), worst)
            .or_json(self.json.json, &results.summary)
    }

    /// The scenarios of a campaign that keeps all of them in memory.
    fn in_one_piece<const NL: usize>(&self, mission: &Mission<NL>) -> Result<Chosen, Error> {
        let fits = |option: &'static str, count: u64| {
            let reason = format!(
                "{count} scenarios are too many in one piece: --part I/N keeps none of them in memory"
            );
            let is_fit = count <= MOST_IN_ONE_PIECE;
            is_fit.then_some(()).ok_or_else(|| Error::argument(option, reason))
        };
        // Before they are drawn.
        if let Some(count) = self.set.count() {
            fits("--count", count)?;
        }
        let chosen = self.set.chosen(mission)?;
        fits("--scenarios", chosen.scenarios.len() as u64)?;
        Ok(chosen)
    }

    /// The campaign as it is made in parts.
    fn job<const NL: usize>(
        &self,
        mission: Mission<NL>,
        command: Vec<String>,
    ) -> Result<Job<NL>, Error> {
        let scenarios = self.set.source(&mission)?;
        // Who has learnt from any of a draw has learnt from its first.
        let met = match &scenarios {
            Scenarios::Drawn { .. } => &[scenarios.get(0, &mission)?][..],
            Scenarios::Listed(all) => all,
        };
        let (method, model) =
            (self.method.method_until(&self.deadline), self.method.model_to_judge(met)?);
        Ok(Job { scenarios, mission, method, model, nodes: self.nodes, command })
    }

    /// How many scenarios it draws; none where they are of a file, which need not be here.
    pub(super) fn drawn(&self) -> Result<Option<u64>, Error> {
        self.set.drawn()
    }

    /// Plans a sample of the parts that this command made again.
    pub(super) fn recompute(
        &self,
        gathered: &GatheredParts<Summary>,
        sample: u64,
        jobs: NonZeroUsize,
    ) -> Result<Vec<Difference>, Error> {
        let mission = self.mission.any()?;
        with_joints!(mission.joints(), NL => {
            let job = self.job::<NL>(mission.of()?, Vec::new())?;
            parts::recompute(&job, gathered, sample, jobs, &mut Bar::named("recompute"))
        } else {
            Err(mission.wrong_joints())
        })
    }

    /// Flies what was planned.
    fn flown<const NL: usize>(
        &self,
        campaign: &Campaign<NL>,
        results: &Results,
        errors: Errors,
    ) -> Result<Output, Error> {
        let there = |row: &&Row| !row.is_refused();
        let plan = |row: &Row| Path::new("plans").join(format!("{}.plan.json", row.scenario));
        let ready = Ready {
            out: self.out.clone(),
            plans: results.rows.iter().filter(there).map(plan).collect(),
            joints: NL,
            integrator: campaign.method.integrator,
            runs: (self.runs.runs, campaign.seed.unwrap_or(0)),
            jobs: campaign.jobs,
        };
        let (flown, is_well) = self.flying.fly(ready, errors)?;
        let text = report::campaign_report(results) + "\n" + &report::flights_report(&flown);
        Output::new(text, is_well).or_json(self.json.json, &flown.summary)
    }
}

/// Says, quiet or not, that no plan of the campaign started from its model.
fn warn_of(model: Option<&Learned>) {
    let refused = model.and_then(|model| Some((model.record().name, model.refused()?)));
    if let Some((name, reason)) = refused {
        let _ = writeln!(stderr(), "warning: heuristic start instead of {name}: {reason}");
    }
}

/// Errors of the flights of a campaign, whose plans can be flown.
fn errors_of_flights(file: &Path, method: &MethodArgs, joints: usize) -> Result<Errors, Error> {
    if !method.method().integrator.is_flown() {
        let reason = "euler plans say nothing between their nodes; --fly takes rk4's";
        return Err(Error::argument("--integrator", reason));
    }
    FlyingArgs::errors(Some(file), joints)
}
