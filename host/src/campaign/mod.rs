//! Campaigns: many scenarios over a few threads, resumable, the same rows whatever their number.
//!
//! Finished rows go to an append-only journal in the campaign's directory. A campaign that was
//! killed picks up there; one that is complete computes nothing and only writes its tables again.
//!
//! ```text
//! DIR/journal.jsonl     what was asked for, then a line a finished row
//! DIR/results.parquet   the rows in the order of the scenarios, when all are there
//! DIR/results.csv       the same
//! DIR/plans/ID.plan.json
//! DIR/summary.json      statistics over the rows
//! ```

mod journal;
mod summary;

pub use journal::{Header, JOURNAL};
pub use summary::{Run, StageSummary, Statistics, Summary};

use crate::error::{Error, io_reason};
use crate::formats::{
    self, NamedScenario, PlanStatus, Row, check_writable, json, write_atomically,
};
use crate::learned::Learned;
use crate::method::Method;
use crate::planning::Planner;
use crate::pool;
use crate::progress::Progress;
use journal::Journal;
use remora_core::model::Mission;
use remora_core::stages::LINKS;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A campaign to be run: the input of `remora campaign`.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// The scenarios; ids are unique.
    pub scenarios: Vec<NamedScenario>,
    /// The mission; valid.
    pub mission: Mission<LINKS>,
    /// How to plan.
    pub method: Method,
    /// Model of a learned start; none is the heuristic.
    pub model: Option<Learned>,
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

impl Campaign {
    /// Plans what is not in the journal yet, then writes tables and summary.
    ///
    /// # Errors
    /// A directory or file that cannot be written (found out before planning); a journal of other
    /// options, mission or scenarios; a campaign that runs in the same directory already.
    pub fn run(&self, progress: &mut dyn Progress) -> Result<Results, Error> {
        let started = Instant::now();
        let (path, header) = (self.out.join(JOURNAL), Header::new(self));
        Journal::look(&path, &header)?;
        self.prepare()?;
        let (mut journal, finished) = Journal::open(&path, &header)?;
        self.clean();

        let mut rows = self.matched(finished);
        let resumed = rows.iter().flatten().count();
        let pending: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].is_none()).collect();
        progress.begin(rows.len(), resumed);
        let finish = |index: usize, row: Row| {
            journal.append(&row)?;
            progress.done(row.status == PlanStatus::Solved);
            rows[index] = Some(row);
            Ok(())
        };
        let plan = |planner: &mut Planner, index| self.plan(planner, index);
        let outcome = pool::plan_all(self.jobs, &pending, plan, finish);
        progress.end();
        outcome?;

        let rows: Vec<Row> = rows.into_iter().flatten().collect();
        let wall_s = started.elapsed().as_secs_f64();
        let run = Run { planned: rows.len() - resumed, resumed, wall_s };
        let summary = Summary::of(&rows, &self.method, run);
        let files = self.write(&rows, &summary)?;
        Ok(Results { rows, summary, files })
    }

    /// Plans one scenario, and writes its plan file where one is wanted.
    fn plan(&self, planner: &mut Planner, index: usize) -> Result<Row, Error> {
        let scenario = &self.scenarios[index];
        let planned = planner.plan(&self.mission, scenario, &self.method, self.model.as_ref());
        if self.save_plans {
            planned.file.write(&self.plan_path(&scenario.id))?;
        }
        Ok(planned.row())
    }

    /// Where the plan of a scenario goes.
    pub fn plan_path(&self, id: &str) -> PathBuf {
        self.plans_directory().join(format!("{id}.plan.json"))
    }

    fn plans_directory(&self) -> PathBuf {
        self.out.join("plans")
    }

    /// Makes the directories and makes sure that the results can be written.
    fn prepare(&self) -> Result<(), Error> {
        let make = |directory: &Path| {
            fs::create_dir_all(directory).map_err(|cause| {
                let exists = cause.kind() == std::io::ErrorKind::AlreadyExists;
                let reason = if exists { "is not a directory".into() } else { io_reason(&cause) };
                Error::Output { file: directory.to_path_buf(), reason }
            })
        };
        make(&self.out)?;
        if self.save_plans {
            make(&self.plans_directory())?;
            check_writable(&self.plan_path("a"))?;
        }
        self.result_files().iter().try_for_each(|file| check_writable(file))
    }

    fn result_files(&self) -> Vec<PathBuf> {
        let csv = self.csv.then_some("results.csv");
        ["results.parquet", "summary.json"]
            .into_iter()
            .chain(csv)
            .map(|name| self.out.join(name))
            .collect()
    }

    /// Removes half-written files of a run that was killed.
    fn clean(&self) {
        formats::remove_partials(&self.out);
        if self.save_plans {
            formats::remove_partials(&self.plans_directory());
        }
    }

    /// The journal's rows by scenario; a row whose plan file is missing does not count.
    fn matched(&self, mut finished: Vec<Row>) -> Vec<Option<Row>> {
        let mut by_id: std::collections::HashMap<String, Row> =
            finished.drain(..).map(|row| (row.scenario.clone(), row)).collect();
        let there = |id: &str| !self.save_plans || self.plan_path(id).is_file();
        self.scenarios
            .iter()
            .map(|scenario| by_id.remove(&scenario.id).filter(|row| there(&row.scenario)))
            .collect()
    }

    fn write(&self, rows: &[Row], summary: &Summary) -> Result<Vec<PathBuf>, Error> {
        let files = self.result_files();
        let failed = |file: &Path, reason: String| Error::Output { file: file.into(), reason };
        for file in &files {
            let bytes = match file.extension().and_then(|extension| extension.to_str()) {
                Some("parquet") => formats::parquet_bytes(rows, &self.method)
                    .map_err(|error| failed(file, error.to_string()))?,
                Some("csv") => formats::csv(rows, &self.method).into_bytes(),
                _ => json::to_text(summary)
                    .map_err(|error| failed(file, error.to_string()))?
                    .into_bytes(),
            };
            write_atomically(file, &bytes)?;
        }
        Ok(files)
    }
}
