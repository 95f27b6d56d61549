//! Many flights over a few threads, resumable, the same rows whatever their number.
//!
//! ```text
//! DIR/flights.json             what is flown: all that a run depends on
//! DIR/flights.journal.jsonl    what was asked for, then a line a finished run
//! DIR/flights.parquet          a row a run, when all are there
//! DIR/flights.summary.json     statistics over the rows
//! DIR/flights.html             all of it as one page
//! DIR/history/RUN.jsonl        runs that are kept, a row a second
//! DIR/history/RUN.parquet      the same as a table, for other programs
//! DIR/pages/RUN.html           those of them that the page shows, in three dimensions
//! ```

use crate::flights_file::{FLIGHTS, FlightsFile, FlightsHeader};
use crate::keep::Keep;
use crate::pilot::Pilot;
use crate::report::{self, Notable};
use crate::results::Results;
use crate::row::{ABOUT, ErrorColumn, FlightRow, Row};
use crate::run::{Plan, failed, is_captured, keep_history, planned, write_page, wrong_world};
use crate::statistics::Summary;
use crate::until::Until;
use remora_host::error::Error;
use remora_host::formats::{
    self, check_writable, json, make_directory, parquet_table, write_atomically,
};
use remora_host::journal::Journal;
use remora_host::pool;
use remora_host::progress::Progress;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

const JOURNAL: &str = "flights.journal.jsonl";
const TABLE: &str = "flights.parquet";
pub(crate) const SUMMARY: &str = "flights.summary.json";
const PAGE: &str = "flights.html";

/// Most runs that the page shows over time.
const MOST_SHOWN: usize = 12;

/// Flights to be flown.
pub struct Flights {
    /// Description of the flights.
    pub asked: FlightsFile,
    /// Number of worker threads.
    pub jobs: NonZeroUsize,
    /// Choice of the runs whose histories are kept.
    pub keep: Keep,
    /// When enough has been flown.
    pub until: Option<Until>,
    /// The folder of the results.
    pub out: PathBuf,
}

/// Runs between two looks at whether enough has been flown.
const BATCH: u64 = 100;

impl Flights {
    /// Flies what is not in the journal yet, then writes table, summary and the histories that are kept.
    ///
    /// # Errors
    /// A plan that cannot be read or flown; a folder or file that cannot be written; a journal of
    /// other flights.
    pub fn fly(&self, progress: &mut dyn Progress) -> Result<Results, Error> {
        let plans = self.plans()?;
        let drawn = self.drawn(&plans)?;
        let is_new = !self.out.join(FLIGHTS).exists();
        let (mut journal, mut rows) = self.begin()?;
        progress.begin(rows.len(), rows.iter().flatten().count());
        let flown = self.fly_missing(&mut journal, &mut rows, &plans, progress);
        if matches!(flown, Err(Error::Argument { .. })) && rows.iter().all(Option::is_none) {
            self.leave(journal, is_new)?;
        }
        let flown = flown?;
        progress.end();
        let rows: Vec<Row> = rows.into_iter().take(flown).flatten().collect();
        self.end(rows, drawn, &plans)
    }

    /// Opens the journal, then says in the folder what is flown; what has been flown, by its number. Other
    /// flights' file is not written over: their journal has refused these by then.
    fn begin(&self) -> Result<(Journal<Row>, Vec<Option<Row>>), Error> {
        make_directory(&self.out)?;
        let header = FlightsHeader::new(&self.asked);
        let journal = self.out.join(JOURNAL);
        let check = |row: &Row| row.check(self.asked.count());
        Journal::look(&journal, &header, &check)?;
        let said = self.out.join(FLIGHTS);
        self.files().iter().chain([&said]).try_for_each(|file| check_writable(file))?;
        let text = json::to_text(&self.asked).map_err(|error| failed(&said, &error))?;
        let (journal, finished) = Journal::open(&journal, &header, &check)?;
        write_atomically(&said, text.as_bytes())?;
        let mut rows: Vec<Option<Row>> = (0..self.asked.count()).map(|_| None).collect();
        for row in finished {
            let index = row.run as usize;
            if let Some(place) = rows.get_mut(index) {
                *place = Some(row);
            }
        }
        Ok((journal, rows))
    }

    /// Takes back what was begun in a folder where nothing could be flown: other errors are other flights, and
    /// may be flown there.
    fn leave(&self, journal: Journal<Row>, is_new: bool) -> Result<(), Error> {
        let said = self.out.join(FLIGHTS);
        if is_new {
            std::fs::remove_file(&said).map_err(|cause| Error::output(&said, &cause))?;
        }
        journal.clear()
    }

    /// Flies what is missing until it is enough; how many runs from the first on are then there.
    fn fly_missing(
        &self,
        journal: &mut Journal<Row>,
        rows: &mut [Option<Row>],
        plans: &[Plan],
        progress: &mut dyn Progress,
    ) -> Result<usize, Error> {
        let count = self.asked.count();
        let mut flown_until = 0;
        while flown_until < count {
            let end = match self.until {
                Some(_) => (flown_until + BATCH).min(count),
                None => count,
            };
            let pending: Vec<u64> =
                (flown_until..end).filter(|run| rows[*run as usize].is_none()).collect();
            let fly = |pilot: &mut Pilot, run: u64| self.run(pilot, plans, run);
            let finish = |run: u64, row: Row| {
                progress.done(is_captured(&row));
                journal.append(&row)?;
                rows[run as usize] = Some(row);
                Ok(())
            };
            pool::plan_all_with(self.jobs, &pending, |_| Pilot::default(), fly, finish)?;
            flown_until = end;
            let so_far: Vec<Row> = rows[..end as usize].iter().flatten().cloned().collect();
            if self.until.as_ref().is_some_and(|until| until.is_decided(&so_far, count)) {
                break;
            }
        }
        Ok(flown_until as usize)
    }

    fn files(&self) -> [PathBuf; 2] {
        [TABLE, SUMMARY].map(|name| self.out.join(name))
    }

    /// The flights of a folder, to be flown again.
    pub(crate) fn again(folder: &Path, jobs: NonZeroUsize) -> Result<Self, Error> {
        let asked = FlightsFile::read(folder)?;
        Ok(Self { asked, jobs, keep: Keep::default(), until: None, out: folder.to_path_buf() })
    }

    pub(crate) fn plans(&self) -> Result<Vec<Plan>, Error> {
        let FlightsFile { plans, joints, options, .. } = &self.asked;
        let planned = |file: &PathBuf| {
            let plan = planned(&self.out, file, *joints)?;
            let fits = plan.sortie.as_ref().map_or(Ok(()), |sortie| sortie.check(options));
            fits.map_err(|error| Error::argument("--gravity", error.reason)).map(|()| plan)
        };
        plans.iter().map(planned).collect()
    }

    /// Names the quantities that are drawn, by the first plan that can be flown.
    pub(crate) fn drawn(&self, plans: &[Plan]) -> Result<Vec<ErrorColumn>, Error> {
        let Some(sortie) = plans.iter().find_map(|plan| plan.sortie.as_ref()) else {
            return Ok(Vec::new());
        };
        let quantities = sortie.drawn(&self.asked.options.settings(), &self.asked.dispersion(0));
        let named = |quantities: Vec<remora_truth::Quantity>| {
            quantities.into_iter().map(|q| ErrorColumn { name: q.name, unit: q.unit }).collect()
        };
        quantities.map(named).map_err(|error| wrong_world(0, &error))
    }

    pub(crate) fn run(&self, pilot: &mut Pilot, plans: &[Plan], run: u64) -> Result<Row, Error> {
        let plan = &plans[(run / self.asked.runs) as usize];
        let settings = self.asked.options.settings();
        let flown = match &plan.sortie {
            None => None,
            Some(sortie) => {
                let flown = pilot.fly(sortie, &settings, &self.asked.dispersion(run), None);
                Some(FlightRow::from(&flown.map_err(|error| wrong_world(run, &error))?))
            }
        };
        Ok(Row { run, scenario: plan.id.clone(), flown })
    }

    /// Metadata of the runs' tables.
    pub(crate) fn table_entries(&self) -> Vec<(&'static str, String)> {
        let program = formats::Program::this();
        vec![
            ("remora.format", "remora-flights-table/1".to_string()),
            ("remora.version", program.version),
            ("remora.commit", program.commit),
            ("remora.seed", self.asked.seed.to_string()),
            formats::about(&ABOUT),
        ]
    }

    fn end(
        &self,
        rows: Vec<Row>,
        drawn: Vec<ErrorColumn>,
        plans: &[Plan],
    ) -> Result<Results, Error> {
        let summary = Summary::of(&rows, &drawn);
        let [table, summary_file] = self.files();
        let columns: Vec<_> = rows.iter().map(|row| row.columns(&drawn)).collect();
        let bytes = parquet_table(&columns, self.table_entries());
        let bytes = bytes.map_err(|error| failed(&table, &error))?;
        write_atomically(&table, &bytes)?;
        let text = json::to_text(&summary).map_err(|error| failed(&summary_file, &error))?;
        write_atomically(&summary_file, text.as_bytes())?;
        let mut files = vec![table, summary_file];
        let mut pilot = Pilot::default();
        let mut histories = Vec::new();
        for run in self.keep.chosen(&rows) {
            let plan = &plans[(run / self.asked.runs) as usize];
            let Some(sortie) = &plan.sortie else { continue };
            let of = (plan.id.as_str(), sortie);
            let (file, samples, _) = keep_history(&self.out, &self.asked, of, &mut pilot, run)?;
            files.push(file);
            if histories.len() < MOST_SHOWN {
                write_page(&self.out, plan, run, &samples)?;
                histories.push(Notable { run, samples, bounds: sortie.bounds() });
            }
        }
        let mut results = Results { rows, drawn, summary, files };
        let page = self.out.join(PAGE);
        let text = report::page(&self.asked, &results, &histories)?;
        write_atomically(&page, text.as_bytes())?;
        results.files.push(page);
        Ok(results)
    }
}
