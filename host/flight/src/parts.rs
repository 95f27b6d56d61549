//! Flights in parts, for many machines: each part is flown by a program of its own, whole or not at all;
//! gathered, they are one series.
//!
//! ```text
//! DIR/flights.json                        what is flown: the same for all parts
//! DIR/part-00003-of-00010.parquet         a row a run of the part, when all are there
//! DIR/part-00003-of-00010.journal.jsonl   until then
//! DIR/flights.summary.json                statistics over all rows, by whoever gathers
//! ```

use crate::campaign::{Flights, SUMMARY};
use crate::flights_file::{FLIGHTS, FlightsFile, FlightsHeader};
use crate::pilot::Pilot;
use crate::row::{ErrorColumn, Row};
use crate::run::{Plan, failed, is_captured, of_folder};
use crate::statistics::Summary;
use remora_host::error::{Error, FieldError};
use remora_host::fingerprint::fingerprint;
use remora_host::formats::{Column, TableReader, json, make_directory, write_first};
use remora_host::part::{self, Part};
use remora_host::parts::{
    Checksum, Difference, GatheredParts, KEY, PartSummary, Sample, Then, Work, again, differing,
    make,
};
use remora_host::progress::Progress;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Most rows that are read at once.
const GROUP: usize = 1 << 16;

/// Flights as work that is shared out.
struct FlightsWork<'a> {
    flights: &'a Flights,
    plans: Vec<Plan>,
    drawn: Vec<ErrorColumn>,
}

impl<'a> FlightsWork<'a> {
    /// Reads the plans.
    fn new(flights: &'a Flights) -> Result<Self, Error> {
        let plans = flights.plans()?;
        let drawn = flights.drawn(&plans)?;
        Ok(Self { flights, plans, drawn })
    }
}

impl Work for FlightsWork<'_> {
    type Worker = Pilot;
    type Header = FlightsHeader;
    type Kept = Row;
    const COUNTED: &'static str = "runs";

    fn count(&self) -> u64 {
        self.flights.asked.count()
    }

    fn header(&self, part: Part) -> FlightsHeader {
        FlightsHeader::of_part(&self.flights.asked, part)
    }

    fn entries(&self) -> Vec<(&'static str, String)> {
        self.flights.table_entries()
    }

    fn run(&self, pilot: &mut Pilot, run: u64) -> Result<Row, Error> {
        self.flights.run(pilot, &self.plans, run)
    }

    fn number(row: &Row) -> u64 {
        row.run
    }

    fn is_well(row: &Row) -> bool {
        is_captured(row)
    }

    fn check(&self, part: Part, row: &Row) -> Result<(), FieldError> {
        match part.range(self.count()).contains(&row.run) {
            true => row.check(self.count()),
            false => Err(FieldError::new("run", format!("{} is none of this part", row.run))),
        }
    }

    fn columns(&self, row: &Row) -> Vec<Column> {
        row.columns(&self.drawn)
    }
}

/// Flies the runs of a part that are not in its journal yet, then writes its table.
///
/// # Errors
/// As [`Flights::fly`]; a folder of other flights.
pub fn fly(
    flights: &Flights,
    part: Part,
    progress: &mut dyn Progress,
) -> Result<PartSummary, Error> {
    part.check(flights.asked.count(), FlightsWork::COUNTED)?;
    let shared = FlightsWork::new(flights)?;
    make_directory(&flights.out)?;
    agree(flights)?;
    make(&shared, part, flights.jobs, &flights.out, progress)
}

/// Says in the folder what is flown, or compares with what it says.
fn agree(flights: &Flights) -> Result<(), Error> {
    let file = flights.out.join(FLIGHTS);
    let text = json::to_text(&flights.asked).map_err(|error| failed(&file, &error))?;
    if !file.exists() {
        write_first(&file, text.as_bytes())?;
    }
    match FlightsFile::read(&flights.out)? == flights.asked {
        true => Ok(()),
        false => {
            let reason = "these flights were begun with other plans, errors, options or runs; choose another --out";
            Err(Error::input(&file, "", reason))
        }
    }
}

/// Reads all parts of a folder; where none is missing, their summary goes to its file.
///
/// # Errors
/// A folder without parts; one that is damaged or of other flights than the folder's.
pub fn gather(folder: &Path) -> Result<GatheredParts<Summary>, Error> {
    let asked = FlightsFile::read(folder)?;
    let tables = part::tables(folder)?;
    let (mut rows, mut names, mut program) = (Vec::new(), Vec::new(), None);
    let mut checksum = Checksum::default();
    for (part, file) in &tables {
        let table = TableReader::open(file)?;
        let header: FlightsHeader = part::said(file, &table, KEY)?;
        let first = program.get_or_insert_with(|| header.clone());
        if let Some(reason) = header.mismatch(first, *part, &fingerprint(&asked)) {
            return Err(Error::input(file, KEY, reason));
        }
        rows.extend(read(file, &table, *part, &asked, &mut checksum)?);
        names = table.names;
    }
    let summary = Summary::of(&rows, &drawn(&names));
    GatheredParts::new(tables, &checksum, summary, Vec::new(), &folder.join(SUMMARY))
}

/// Names of what was drawn, by those of columns.
fn drawn(names: &[String]) -> Vec<ErrorColumn> {
    let drawn = names.iter().filter_map(|name| name.strip_prefix("drawn."));
    drawn.map(|name| ErrorColumn { name: name.into(), unit: "" }).collect()
}

/// The rows of a part, once they are its runs and have its checksum; `all` is that of what is read.
fn read(
    file: &Path,
    table: &TableReader,
    part: Part,
    asked: &FlightsFile,
    all: &mut Checksum,
) -> Result<Vec<Row>, Error> {
    let damaged = |reason: String| Error::input(file, "", format!("is damaged: {reason}"));
    let (mut rows, mut checksum) = (Vec::new(), Checksum::default());
    for group in 0..table.groups() {
        for cells in table.group(group, GROUP).map_err(|error| damaged(error.to_string()))? {
            let row = Row::of_cells(&cells).ok_or_else(|| damaged("holds no flights".into()))?;
            row.check(asked.count()).map_err(|error| error.at(file))?;
            checksum.add_cells(&cells);
            all.add_cells(&cells);
            rows.push(row);
        }
    }
    if !rows.iter().map(|row| row.run).eq(part.range(asked.count())) {
        return Err(damaged("has not the runs of this part".into()));
    }
    checksum.check(file, table).map(|()| rows)
}

/// Flies `sample` of the runs again, spread evenly; those that come to something else.
///
/// # Errors
/// A plan that is gone; a world that cannot be flown in; a part that has changed since.
pub fn recompute(
    folder: &Path,
    gathered: &GatheredParts<Summary>,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let flights = Flights::again(folder, jobs)?;
    let shared = FlightsWork::new(&flights).map_err(|error| of_folder(folder, error))?;
    let mut rows = BTreeMap::new();
    let mut picked = Sample::of(sample, shared.count());
    for (part, file) in &gathered.tables {
        let here = picked.within(&part.range(shared.count()));
        if here.is_empty() {
            continue;
        }
        let table = TableReader::open(file)?;
        let all = read(file, &table, *part, &flights.asked, &mut Checksum::default())?;
        let sampled = all.into_iter().filter(|row| here.binary_search(&row.run).is_ok());
        rows.extend(sampled.map(|row| {
            let scenario = format!("{}, run {}", row.scenario, row.run);
            (row.run, Then { part: *part, scenario, value: shared.columns(&row) })
        }));
    }
    let run = |pilot: &mut Pilot, run: u64| {
        shared.run(pilot, run).map_err(|error| of_folder(folder, error))
    };
    let differs = |then: &Vec<Column>, row: &Row| differing(then, &shared.columns(row), |_| true);
    again(&rows, jobs, run, differs, progress)
}

/// Whether a folder holds parts of flights.
pub fn is_flown_in(folder: &Path) -> bool {
    let file: PathBuf = folder.join(FLIGHTS);
    file.is_file()
}
