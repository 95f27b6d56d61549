//! Campaigns: many scenarios over a few threads, resumable, the same rows whatever their number.
//!
//! Finished rows go to an append-only journal in the campaign's directory. A campaign that was
//! killed picks up there; one that is complete computes nothing and only writes its tables again.
//!
//! ```text
//! DIR/campaign.scenarios.json   the scenarios, read or drawn
//! DIR/journal.jsonl     what was asked for, then a line a finished row
//! DIR/results.parquet   the rows in the order of the scenarios, when all are there
//! DIR/results.csv       the same
//! DIR/plans/ID.plan.json
//! DIR/summary.json      statistics over the rows
//! ```

mod journal;
mod plans;
mod summary;
mod tally;

pub use journal::{CampaignHeader, JOURNAL};
pub use plans::plans_of;
pub use summary::{NearestOf, Run, StageSummary, Statistics, Summary};
pub use tally::Tally;

use crate::error::{Error, FieldError};
use crate::formats::{
    self, NamedScenario, Program, Row, ScenarioSet, Status, TableOrigin, check_writable, json,
    make_directory, write_atomically,
};
use crate::planning::Planner;
use crate::pool;
use crate::progress::Progress;
use crate::request::PlanRequest;
use journal::Journal;
use std::collections::{HashMap, HashSet};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

/// Name of the file that describes the CSV table, beside it.
const CSV_METADATA: &str = "results.csv-metadata.json";
/// Name of a scenario's plan.
fn plan_name(id: &str) -> String {
    format!("{id}.plan.json")
}

/// Name of the scenario set in the campaign's directory.
pub const SCENARIOS: &str = "campaign.scenarios.json";

/// A campaign to be run: the input of `remora campaign`.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// The scenarios; ids are unique.
    pub scenarios: Vec<NamedScenario>,
    /// Seed of their draw, where they were drawn.
    pub seed: Option<u64>,
    /// How to plan.
    pub request: PlanRequest,
    /// Number of worker threads.
    pub jobs: NonZeroUsize,
    /// Whether to write a plan file a scenario.
    pub save_plans: bool,
    /// Whether to write the table as CSV too.
    pub csv: bool,
    /// The directory of the results.
    pub out: PathBuf,
}

/// Results of a campaign that ran through.
#[derive(Clone, Debug)]
pub struct Results {
    /// One row a scenario, in their order.
    pub rows: Vec<Row>,
    /// Statistics over them.
    pub summary: Summary,
    /// The files written at the end.
    pub files: Vec<PathBuf>,
}

/// Runs campaigns together: each scenario for all of them, then the next. Their times are then
/// measured under one load. Directories must differ.
///
/// # Errors
/// The errors of [`Campaign::run`].
pub fn run_together(
    campaigns: &[Campaign],
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Results>, Error> {
    let started = Instant::now();
    campaigns.iter().try_for_each(Campaign::prepare)?;
    let mut begun = campaigns.iter().map(Begun::new).collect::<Result<Vec<_>, _>>()?;

    let mut pending: Vec<(usize, usize)> = Vec::new();
    for (which, campaign) in begun.iter().enumerate() {
        let missing = (0..campaign.rows.len()).filter(|i| campaign.rows[*i].is_none());
        pending.extend(missing.map(|i| (which, i)));
    }
    pending.sort_by_key(|(which, scenario)| (*scenario, *which));
    let total = begun.iter().map(|campaign| campaign.rows.len()).sum();
    progress.begin(total, total - pending.len());
    let plan = |planner: &mut Planner, (which, scenario): (usize, usize)| {
        campaigns[which].plan(planner, scenario)
    };
    let finish = |(which, scenario): (usize, usize), row: Row| {
        progress.done(row.status == Status::Solved);
        begun[which].finish(scenario, row)
    };
    let outcome = pool::plan_all(jobs, &pending, plan, finish);
    progress.end();
    outcome?;
    begun.into_iter().map(|campaign| campaign.end(started)).collect()
}

/// A campaign that is running.
struct Begun<'a> {
    campaign: &'a Campaign,
    journal: Journal,
    rows: Vec<Option<Row>>,
    resumed: usize,
}

impl<'a> Begun<'a> {
    fn new(campaign: &'a Campaign) -> Result<Self, Error> {
        let (journal, finished) =
            Journal::open(&campaign.journal(), &CampaignHeader::new(campaign), &campaign.check())?;
        campaign.clean();
        // Another campaign's scenarios are not written over: its journal has refused this one by now.
        ScenarioSet::new(campaign.scenarios.clone()).write(&campaign.out.join(SCENARIOS))?;
        let rows = campaign.matched(finished);
        let resumed = rows.iter().flatten().count();
        Ok(Self { campaign, journal, rows, resumed })
    }

    fn finish(&mut self, scenario: usize, row: Row) -> Result<(), Error> {
        self.journal.append(&row)?;
        self.rows[scenario] = Some(row);
        Ok(())
    }

    /// Writes tables and summary.
    fn end(self, started: Instant) -> Result<Results, Error> {
        let rows: Vec<Row> = self.rows.into_iter().flatten().collect();
        let wall_s = started.elapsed().as_secs_f64();
        let run = Run { planned: rows.len() - self.resumed, resumed: self.resumed, wall_s };
        let summary = Summary::of(&rows, &self.campaign.request.method, run);
        let files = self.campaign.write(&rows, &summary)?;
        Ok(Results { rows, summary, files })
    }
}

impl Campaign {
    /// Plans what is not in the journal yet, then writes tables and summary.
    ///
    /// # Errors
    /// A directory or file that cannot be written (found out before planning); a journal of other
    /// options, mission or scenarios; a campaign that runs in the same directory already.
    pub fn run(&self, progress: &mut dyn Progress) -> Result<Results, Error> {
        let mut results = run_together(std::slice::from_ref(self), self.jobs, progress)?;
        results.pop().ok_or_else(|| Error::Thread { reason: "a campaign came to nothing".into() })
    }

    /// Plans one scenario, and writes its plan file where one is wanted. One that is refused has
    /// a row and no plan.
    fn plan(&self, planner: &mut Planner, index: usize) -> Result<Row, Error> {
        let scenario = &self.scenarios[index];
        if let Some(refusal) = self.request.refusal(scenario)? {
            return Ok(Row::refused(scenario, &refusal));
        }
        let planned = planner.plan(&self.request, scenario);
        if self.save_plans {
            planned.file.write(&self.plan_path(&scenario.id))?;
        }
        Ok(planned.row())
    }

    /// Origin of the rows, for the tables' metadata.
    fn origin(&self) -> TableOrigin {
        TableOrigin {
            method: self.request.method,
            seed: self.seed,
            mission_checksum: formats::checksum_of_mission(&self.request.mission),
            program: Program::this(),
        }
    }

    /// Where the plan of a scenario goes.
    pub fn plan_path(&self, id: &str) -> PathBuf {
        self.plans_directory().join(plan_name(id))
    }

    fn plans_directory(&self) -> PathBuf {
        self.out.join("plans")
    }

    fn journal(&self) -> PathBuf {
        self.out.join(JOURNAL)
    }

    /// Refuses a journal of another campaign; makes the directories and makes sure that the
    /// results can be written.
    fn prepare(&self) -> Result<(), Error> {
        Journal::look(&self.journal(), &CampaignHeader::new(self), &self.check())?;
        make_directory(&self.out)?;
        if self.save_plans {
            make_directory(&self.plans_directory())?;
            check_writable(&self.plan_path("a"))?;
        }
        self.result_files().iter().try_for_each(|file| check_writable(file))?;
        check_writable(&self.out.join(SCENARIOS))
    }

    fn result_files(&self) -> Vec<PathBuf> {
        let csv = if self.csv { &["results.csv", CSV_METADATA][..] } else { &[] };
        ["results.parquet", "summary.json"]
            .iter()
            .chain(csv)
            .map(|name| self.out.join(name))
            .collect()
    }

    /// A check that refuses rows of other campaigns.
    fn check(&self) -> impl Fn(&Row) -> Result<(), FieldError> {
        let ids: HashSet<&str> =
            self.scenarios.iter().map(|scenario| scenario.id.as_str()).collect();
        move |row| {
            if !ids.contains(row.scenario.as_str()) {
                let reason = format!("{:?} is no scenario of this campaign", row.scenario);
                return Err(FieldError::new("scenario", reason));
            }
            row.check(&self.request.mission.tolerances)
        }
    }

    /// Removes half-written files of a run that was killed: of those that a campaign writes, since a part of
    /// another may be writing beside it.
    fn clean(&self) {
        let tables = ["results.parquet", "summary.json", "results.csv", CSV_METADATA, SCENARIOS];
        formats::remove_partials_among(&self.out, tables);
        if self.save_plans {
            let plans = self.scenarios.iter().map(|scenario| plan_name(&scenario.id));
            formats::remove_partials_among(&self.plans_directory(), plans);
        }
    }

    /// The journal's rows by scenario; a row whose plan file is missing does not count, where there
    /// was a plan.
    fn matched(&self, mut finished: Vec<Row>) -> Vec<Option<Row>> {
        let mut by_id: HashMap<String, Row> =
            finished.drain(..).map(|row| (row.scenario.clone(), row)).collect();
        let there = |id: &str| !self.save_plans || self.plan_path(id).is_file();
        self.scenarios
            .iter()
            .map(|scenario| {
                by_id.remove(&scenario.id).filter(|row| row.is_refused() || there(&row.scenario))
            })
            .collect()
    }

    fn write(&self, rows: &[Row], summary: &Summary) -> Result<Vec<PathBuf>, Error> {
        let files = self.result_files();
        let origin = self.origin();
        let text = |json: serde_json::Result<String>| {
            json.map(String::into_bytes).map_err(|error| error.to_string())
        };
        for file in &files {
            let failed = |reason: String| Error::Output { file: file.clone(), reason };
            let bytes = match file.file_name().and_then(|name| name.to_str()) {
                Some("results.parquet") => {
                    formats::parquet_bytes(rows, &origin).map_err(|error| error.to_string())
                }
                Some("results.csv") => Ok(formats::csv(rows, &self.request.method).into_bytes()),
                Some(CSV_METADATA) => {
                    let metadata = formats::csv_metadata(rows, &origin, "results.csv");
                    text(json::to_text(&metadata.unwrap_or_default()))
                }
                _ => text(json::to_text(summary)),
            };
            write_atomically(file, &bytes.map_err(failed)?)?;
        }
        Ok(files)
    }
}
