//! `remora campaign`

use super::options::{
    Chosen, DeadlineArgs, JobsArgs, JsonArgs, MethodArgs, MissionArgs, SetArgs, WRITE, choice,
};
use super::parts::{PartArgs, arguments, end_when_asked};
use super::progress::Bar;
use super::{Output, envelope, gather};
use crate::report;
use clap::Subcommand;
use remora_host::campaign::{Campaign, Summary};
use remora_host::choice::choices;
use remora_host::error::Error;
use remora_host::formats::{Mission, NamedScenario, Verdict};
use remora_host::learned::Learned;
use remora_host::parts::{self, Difference, GatheredParts, Job, Scenarios};
use remora_host::request::PlanRequest;
use std::io::{Write, stderr};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Most plan files that a directory gets.
const MOST_PLAN_FILES: usize = 10_000;
/// Most scenarios of a campaign in one piece, which keeps all of their rows: 4 kB of memory each.
const MOST_IN_ONE_PIECE: u64 = 50_000;

/// Plan many scenarios over several threads; resumes what was interrupted.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Args {
    #[command(subcommand)]
    command: Option<After>,
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
    #[command(flatten)]
    part: PartArgs,
    #[arg(long, value_name = "WHAT", value_delimiter = ',', help = WRITE)]
    #[arg(value_parser = choice::<CampaignFile>())]
    write: Vec<CampaignFile>,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath, required = true)]
    out: Option<PathBuf>,
}

/// Commands beside a campaign, of many plans too.
#[derive(Debug, Subcommand)]
enum After {
    Gather(gather::Args),
    Envelope(envelope::Args),
}

choices! {
    /// Files beside the results.
    enum CampaignFile {
        /// DIR/plans/ID.plan.json.
        Plans = "plans",
        /// The table as CSV.
        Csv = "csv",
        /// DIR/report.html, and pages of notable plans in three dimensions.
        Report = "report",
        /// A table of trajectories, a row a node; with --part.
        Nodes = "nodes",
    }
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign --scenarios a.scenarios.json --out runs/a
  remora campaign --count 300 --seed 1 --integrator euler --jobs 8 --write plans,csv --out runs/b
  remora campaign --count 300 --seed 7 --warm-start model --model mine.model --out runs/mine
  remora campaign --count 300 --seed 1 --deadline 0.5 --jobs 1 --out runs/c
  remora campaign --count 300 --seed 1 --write report --out runs/d
  remora campaign --count 1000000 --seed 9 --integrator euler --part 17/1000 --out shared
  remora campaign gather shared
  remora campaign envelope --coarse

DIR gets results.parquet (--write csv: results.csv too), summary.json, the scenarios and, with --write plans,
a plan a scenario. Interrupt it at any time: the same command goes on where it stopped. Results do not
depend on the number of threads, but for times. A campaign with --deadline is not reproducible bit
by bit: where a plan stops depends on the machine, its load and --jobs.

A scenario that no plan can end well is refused before planning: a row with status infeasible and
the constraint's name as its reason.

Scenarios that the model, or one that it descends from, has learnt from are refused.

With --write report every plan is kept, and DIR/report.html links those worth a look to pages like those
of `remora view`. With --write plans `remora fly DIR --errors FILE --out DIR` flies them all.

With --part DIR gets part-00017-of-01000.jsonl, the rows, and part-00017-of-01000.parquet, the same as
a table; whole or not at all. Programs on many machines may share it: docs/guides/campaigns.md has their job,
`remora campaign gather DIR` puts the parts together. Rows are kept on the disk, not in memory: more than
50,000 scenarios are planned in parts alone, be it part 1/1. SIGTERM ends a part after the plans in
hand; the same command goes on.

Exit status: with --part 0 written, 143 (130) ended by SIGTERM (SIGINT); without it 0 all optimal,
1 some are not flyable, 2 bad input, 3 all verified but some not converged.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        match self.command {
            Some(After::Gather(args)) => return args.run(),
            Some(After::Envelope(args)) => return args.run(),
            None => self.check_files()?,
        }
        self.make()
    }

    /// Whether such files are to be written.
    fn writes(&self, file: CampaignFile) -> bool {
        self.write.contains(&file)
    }

    /// Refuses files that a campaign in parts, or in one piece, has not.
    fn check_files(&self) -> Result<(), Error> {
        let other =
            |file: &&CampaignFile| (**file == CampaignFile::Nodes) != self.part.part.is_some();
        let Some(file) = self.write.iter().find(other) else { return Ok(()) };
        let reason = match file {
            CampaignFile::Nodes => "nodes needs --part I/N".into(),
            file => format!("{} cannot be used with --part", file.name()),
        };
        Err(Error::argument("--write", reason))
    }

    fn make(self) -> Result<Output, Error> {
        let mission = self.mission.mission()?;
        end_when_asked();
        let out = self.out.clone().unwrap_or_default();
        if let Some(part) = self.part.part {
            let job = self.job(mission, arguments()?)?;
            let made = parts::make(&job, part, self.jobs.jobs(), &out, &mut Bar::named("part"))?;
            warn_of(job.request.guess.model());
            return Output::new(report::part_report(&made), true).or_json(self.json.json, &made);
        }
        let chosen = self.in_one_piece(&mission)?;
        let save_plans = self.writes(CampaignFile::Plans) || self.writes(CampaignFile::Report);
        let count = chosen.scenarios.len();
        if save_plans && count > MOST_PLAN_FILES {
            let reason = format!(
                "{count} plan files are too many for a directory: --part I/N --write nodes writes all of them as tables"
            );
            return Err(Error::argument("--write", reason));
        }
        let campaign = Campaign {
            request: self.request(mission, &chosen.scenarios)?,
            scenarios: chosen.scenarios,
            seed: chosen.seed,
            jobs: self.jobs.jobs(),
            save_plans,
            csv: self.writes(CampaignFile::Csv),
            out,
        };
        let mut results = campaign.run(&mut Bar::named("campaign"))?;
        warn_of(campaign.request.guess.model());
        if self.writes(CampaignFile::Report) {
            results.files.push(report::write_campaign_page(&campaign.out, &results)?);
        }
        let worst = results.rows.iter().map(|row| row.verdict).max().unwrap_or(Verdict::Optimal);
        Output::judged(report::campaign_report(&results), worst)
            .or_json(self.json.json, &results.summary)
    }

    /// The scenarios of a campaign that keeps all of them in memory.
    fn in_one_piece(&self, mission: &Mission) -> Result<Chosen, Error> {
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
    fn job(&self, mission: Mission, command: Vec<String>) -> Result<Job, Error> {
        let scenarios = self.set.source(&mission)?;
        // Models that have learnt from any scenario of a draw have learnt from its first.
        let met = match &scenarios {
            Scenarios::Drawn { .. } => &[scenarios.get(0, &mission)?][..],
            Scenarios::Listed(all) => all,
        };
        let request = self.request(mission, met)?;
        Ok(Job { scenarios, request, nodes: self.writes(CampaignFile::Nodes), command })
    }

    fn request(&self, mission: Mission, met: &[NamedScenario]) -> Result<PlanRequest, Error> {
        self.method.request_to_judge(mission, self.deadline.deadline, met)
    }

    /// Plans a sample of the parts that this command made again.
    pub(super) fn recompute(
        &self,
        gathered: &GatheredParts<Summary>,
        sample: u64,
        jobs: NonZeroUsize,
    ) -> Result<Vec<Difference>, Error> {
        let job = self.job(self.mission.mission()?, Vec::new())?;
        parts::recompute(&job, gathered, sample, jobs, &mut Bar::named("recompute"))
    }
}

/// Says, quiet or not, that no plan of the campaign started from its model.
fn warn_of(model: Option<&Learned>) {
    let refused = model.and_then(|model| Some((model.record().name, model.refused()?)));
    if let Some((name, reason)) = refused {
        let _ = writeln!(stderr(), "warning: heuristic start instead of {name}: {reason}");
    }
}
