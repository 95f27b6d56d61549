//! Many flights over a few threads, resumable, the same rows whatever their number.
//!
//! ```text
//! DIR/flights.json             what is flown: all that a run depends on
//! DIR/flights.journal.jsonl    what was asked for, then a line a finished run
//! DIR/flights.parquet          a row a run, when all are there
//! DIR/flights.summary.json     statistics over the rows
//! DIR/flights.html             all of it as one page
//! DIR/history/RUN.parquet      runs that are kept, a row a second
//! DIR/pages/RUN.html           those of them that the page shows, in three dimensions
//! ```

use crate::errors_file;
use crate::history::{self, Sample};
use crate::keep::Keep;
use crate::options::Options;
use crate::pilot::{Pilot, Sortie};
use crate::report::{self, Notable};
use crate::row::{ABOUT, Drawn, FlownRow, Row};
use crate::statistics::Summary;
use crate::until::Until;
use remora_host::error::{Error, FieldError};
use remora_host::fingerprint::{self, fingerprint};
use remora_host::formats::{
    self, Limit, MAX_JOINTS, PLANNED_JOINTS, PlanFile, Verdict, check_writable, json,
    make_directory, parquet_table, read_text, write_atomically,
};
use remora_host::journal::{Heading, Journal};
use remora_host::part::Part;
use remora_host::pool;
use remora_host::progress::Progress;
use remora_truth::{Dispersion, Errors, WorldError};
use remora_web::Shown;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;
use std::path::{Component, Path, PathBuf};

/// Name of what says all that a run depends on.
pub const FLIGHTS: &str = "flights.json";
const JOURNAL: &str = "flights.journal.jsonl";
const TABLE: &str = "flights.parquet";
pub(crate) const SUMMARY: &str = "flights.summary.json";
const PAGE: &str = "flights.html";
/// Folder of the pages of single runs.
pub const PAGES: &str = "pages";
const FORMAT: &str = "remora-flights/1";

/// Most runs of each plan.
pub const MAX_RUNS: u64 = 1_000_000;

/// Most runs that the page shows over time.
const MOST_SHOWN: usize = 12;

/// What is flown: all that a run depends on. It is the file [`FLIGHTS`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asked {
    /// Format of the file.
    pub format: String,
    /// Plan files in their order, from the folder of the flights.
    pub plans: Vec<PathBuf>,
    /// Runs of each plan.
    pub runs: u64,
    /// Seed of the errors' draw.
    pub seed: u64,
    /// Joints of the arm.
    pub joints: usize,
    /// How plans are flown.
    pub options: Options,
    /// Errors of the world.
    pub errors: Errors,
}

impl Asked {
    /// What is flown, in the present form.
    pub fn new(
        plans: Vec<PathBuf>,
        (runs, seed): (u64, u64),
        joints: usize,
        options: Options,
        errors: Errors,
    ) -> Self {
        Self { format: FORMAT.into(), plans, runs, seed, joints, options, errors }
    }

    /// Reads a folder's.
    ///
    /// # Errors
    /// The file with the field that is wrong.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let file = folder.join(FLIGHTS);
        Self::parse(&read_text(&file, Limit::DOCUMENT)?).map_err(|error| error.at(&file))
    }

    /// Parses a file's text.
    ///
    /// # Errors
    /// The field that is wrong.
    pub fn parse(text: &str) -> Result<Self, FieldError> {
        let asked: Self = json::parse(text, FORMAT)?;
        asked.check().map(|()| asked)
    }

    /// Refuses what no command asks for, and would never end.
    fn check(&self) -> Result<(), FieldError> {
        if !(1..=MAX_RUNS).contains(&self.runs) {
            return Err(FieldError::new("runs", format!("must be from 1 to {MAX_RUNS}")));
        }
        if !(1..=MAX_JOINTS).contains(&self.joints) {
            return Err(FieldError::new("joints", PLANNED_JOINTS));
        }
        for (i, plan) in self.plans.iter().enumerate() {
            if !is_within(plan) {
                let reason = format!("{:?} is no file in the folder of the flights", plan);
                return Err(FieldError::new(format!("plans[{i}]"), reason));
            }
        }
        let within = |section: &'static str| {
            move |error: FieldError| {
                FieldError::new(format!("{section}.{}", error.field), error.reason)
            }
        };
        self.options.check().map_err(within("options"))?;
        errors_file::check(&self.errors, self.joints).map_err(within("errors"))
    }

    /// Draw of a run.
    pub fn dispersion(&self, run: u64) -> Dispersion {
        Dispersion { errors: self.errors.clone(), seed: self.seed, run }
    }

    pub(crate) fn count(&self) -> u64 {
        self.runs.saturating_mul(self.plans.len() as u64)
    }
}

/// Whether a path leads to what is below the folder that it starts from.
fn is_within(path: &Path) -> bool {
    let mut parts = path.components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Flights to be flown.
pub struct Flights {
    /// What is flown.
    pub asked: Asked,
    /// Number of worker threads.
    pub jobs: NonZeroUsize,
    /// Which runs' histories are kept.
    pub keep: Keep,
    /// When enough has been flown.
    pub until: Option<Until>,
    /// The folder of the results.
    pub out: PathBuf,
}

/// Flights that were flown.
pub struct Results {
    /// A row a run, in their order.
    pub rows: Vec<Row>,
    /// What was drawn, in the order of the rows' numbers.
    pub drawn: Vec<Drawn>,
    /// Statistics over them.
    pub summary: Summary,
    /// The files written at the end.
    pub files: Vec<PathBuf>,
}

/// A plan of the flights: its file, its scenario's id, and what can be flown of it.
pub(crate) struct Planned {
    file: PathBuf,
    id: String,
    sortie: Option<Sortie>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Header {
    format: String,
    version: String,
    program: String,
    flights: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part: Option<Part>,
}

impl Header {
    /// That of what is flown, whole.
    fn new(asked: &Asked) -> Self {
        Self {
            format: Self::FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: fingerprint::program(),
            flights: fingerprint(asked),
            part: None,
        }
    }

    /// That of a part of it.
    pub(crate) fn of_part(asked: &Asked, part: Part) -> Self {
        Self { part: Some(part), ..Self::new(asked) }
    }

    /// Why it is not that of `part` of these flights, by the program of the `first`; none where it is.
    pub(crate) fn is_other(&self, first: &Self, part: Part, flights: &str) -> Option<&'static str> {
        match () {
            () if self.part != Some(part) => Some("says that it is another part"),
            () if self.flights != flights => Some("is of other flights than flights.json"),
            () if (&self.version, &self.program) != (&first.version, &first.program) => {
                Some("was flown by another build of the program than the first part")
            }
            () => None,
        }
    }
}

impl Heading for Header {
    const FORMAT: &'static str = "remora-flights-journal/1";
    const WORK: &'static str = "series of flights";

    fn format(&self) -> &str {
        &self.format
    }

    fn difference(&self, begun: &Self) -> Option<(&'static str, String)> {
        let checks = [
            ("version", self.version != begun.version, "another version of this program"),
            ("program", self.program != begun.program, "another build of this program"),
            ("flights", self.flights != begun.flights, "other plans, errors, options or runs"),
            ("part", self.part != begun.part, "another part"),
        ];
        checks.into_iter().find(|(_, differs, _)| *differs).map(|(field, _, what)| {
            (field, format!("these flights were begun with {what}; choose another --out"))
        })
    }
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
        let header = Header::new(&self.asked);
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
        plans: &[Planned],
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
        let asked = Asked::read(folder)?;
        Ok(Self { asked, jobs, keep: Keep::default(), until: None, out: folder.to_path_buf() })
    }

    pub(crate) fn plans(&self) -> Result<Vec<Planned>, Error> {
        let Asked { plans, joints, options, .. } = &self.asked;
        let planned = |file: &PathBuf| {
            let plan = planned(&self.out, file, *joints)?;
            let fits = plan.sortie.as_ref().map_or(Ok(()), |sortie| sortie.check(options));
            fits.map_err(|error| Error::argument("--j2", error.reason)).map(|()| plan)
        };
        plans.iter().map(planned).collect()
    }

    /// What is drawn, by the first plan that can be flown.
    pub(crate) fn drawn(&self, plans: &[Planned]) -> Result<Vec<Drawn>, Error> {
        let Some(sortie) = plans.iter().find_map(|plan| plan.sortie.as_ref()) else {
            return Ok(Vec::new());
        };
        let quantities = sortie.drawn(&self.asked.options.settings(), &self.asked.dispersion(0));
        let named = |quantities: Vec<remora_truth::Quantity>| {
            quantities.into_iter().map(|q| Drawn { name: q.name, unit: q.unit }).collect()
        };
        quantities.map(named).map_err(|error| wrong_world(0, &error))
    }

    pub(crate) fn run(&self, pilot: &mut Pilot, plans: &[Planned], run: u64) -> Result<Row, Error> {
        let plan = &plans[(run / self.asked.runs) as usize];
        let settings = self.asked.options.settings();
        let flown = match &plan.sortie {
            None => None,
            Some(sortie) => {
                let flown = pilot.fly(sortie, &settings, &self.asked.dispersion(run), None);
                Some(FlownRow::from(&flown.map_err(|error| wrong_world(run, &error))?))
            }
        };
        Ok(Row { run, scenario: plan.id.clone(), flown })
    }

    /// What tables of the runs say of themselves.
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

    fn end(&self, rows: Vec<Row>, drawn: Vec<Drawn>, plans: &[Planned]) -> Result<Results, Error> {
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
            let (file, samples) = keep_history(&self.out, &self.asked, plan, &mut pilot, run)?;
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

/// Flies one run of a folder's flights again; its history goes to `history/RUN.parquet`.
///
/// # Errors
/// A folder without flights; a run that it does not have; a plan that is gone or cannot be flown.
pub fn rerun(folder: &Path, run: u64) -> Result<(Row, PathBuf), Error> {
    let asked = Asked::read(folder)?;
    let Some(file) = asked.plans.get((run / asked.runs.max(1)) as usize) else {
        let reason =
            format!("there is no run {run}: runs are 0 to {}", asked.count().saturating_sub(1));
        return Err(Error::input(&folder.join(FLIGHTS), "runs", reason));
    };
    let plan = planned(folder, file, asked.joints)?;
    let mut pilot = Pilot::default();
    let Some(sortie) = &plan.sortie else {
        return Err(Error::input(file, "verdict", "is not flyable: there was nothing to fly"));
    };
    make_directory(folder)?;
    let (history, _) = keep_history(folder, &asked, &plan, &mut pilot, run)
        .map_err(|error| of_folder(folder, error))?;
    let flown = pilot.fly(sortie, &asked.options.settings(), &asked.dispersion(run), None);
    let flown = flown.map_err(|error| of_folder(folder, wrong_world(run, &error)))?;
    let row = Row { run, scenario: plan.id, flown: Some(FlownRow::from(&flown)) };
    Ok((row, history))
}

/// Flies a run with its history, which goes to a file.
fn keep_history(
    folder: &Path,
    asked: &Asked,
    plan: &Planned,
    pilot: &mut Pilot,
    run: u64,
) -> Result<(PathBuf, Vec<Sample>), Error> {
    let mut samples = Vec::new();
    if let Some(sortie) = &plan.sortie {
        pilot
            .fly(sortie, &asked.options.settings(), &asked.dispersion(run), Some(&mut samples))
            .map_err(|error| wrong_world(run, &error))?;
    }
    let folder = folder.join("history");
    make_directory(&folder)?;
    let file = folder.join(format!("{run}.parquet"));
    history::write(&file, &samples, (run, &plan.id))?;
    Ok((file, samples))
}

/// Writes the page of one run beside its plan.
fn write_page(folder: &Path, plan: &Planned, run: u64, samples: &[Sample]) -> Result<(), Error> {
    let file = PlanFile::read(&plan.file)?;
    let flights = vec![history::shown(run, samples)];
    let shown = Shown { plan: &file, flights };
    let text = remora_web::page(&[shown]).map_err(|failure| failure.error.at(&plan.file))?;
    let folder = folder.join(PAGES);
    make_directory(&folder)?;
    write_atomically(&folder.join(format!("{run}.html")), text.as_bytes())
}

/// A plan file of flights in `folder`; one that is not flyable has nothing to fly.
fn planned(folder: &Path, file: &Path, joints: usize) -> Result<Planned, Error> {
    let file = folder.join(file);
    let plan = PlanFile::read(&file)?;
    let id = plan.scenario.clone();
    if plan.verdict == Some(Verdict::NotFlyable) {
        return Ok(Planned { file, id, sortie: None });
    }
    let sortie = remora_host::with_joints!(joints, NL => {
        Sortie::of::<NL>(&file, &plan)?
    } else {
        return Err(Error::input(&file, "inputs.mission.servicer", "has no arm of 1 to 7 joints"));
    });
    Ok(Planned { file, id, sortie: Some(sortie) })
}

pub(crate) fn is_captured(row: &Row) -> bool {
    row.flown.as_ref().is_some_and(|flown| flown.ending == crate::flight::Ending::Captured)
}

pub(crate) fn failed(file: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::Output { file: file.into(), reason: error.to_string() }
}

/// A world that cannot be flown in is one of errors that nobody could mean.
fn wrong_world(run: u64, error: &WorldError) -> Error {
    let reason = format!("run {run}: the world cannot be flown in: {error}");
    Error::argument("--errors (campaign: --fly)", reason)
}

/// The same where a folder says what the errors are, and no argument does.
pub(crate) fn of_folder(folder: &Path, error: Error) -> Error {
    match error {
        Error::Argument { reason, .. } => Error::input(&folder.join(FLIGHTS), "errors", reason),
        other => other,
    }
}
