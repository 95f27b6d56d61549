//! Flights in parts, for many machines: each part is flown by a program of its own, whole or not at all;
//! gathered, they are one series.
//!
//! ```text
//! DIR/flights.json                        what is flown: the same for all parts
//! DIR/part-00003-of-00010.journal.jsonl   a row a run of the part, until all are there
//! DIR/part-00003-of-00010.jsonl           from then on, with checksums
//! DIR/part-00003-of-00010.parquet         the same as a table, for other programs
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
use remora_host::formats::{Column, json, make_directory, write_first};
use remora_host::part::{self, Part};
use remora_host::parts::{
    Checksum, Difference, GatheredParts, PartSummary, Sample, Then, Work, again, differing, make,
};
use remora_host::progress::Progress;
use remora_host::rows_file::RowsFile;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Metadata key of the drawn quantities' names, a JSON array, in a part's table.
const DRAWN: &str = "remora.drawn";

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
        let names: Vec<&str> = self.drawn.iter().map(|drawn| drawn.name.as_str()).collect();
        let mut entries = self.flights.table_entries();
        entries.push((DRAWN, serde_json::json!(names).to_string()));
        entries
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
/// Errors of [`Flights::fly`]; a folder of other flights.
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
    let files = part::files(folder)?;
    let (mut rows, mut drawn, mut program) = (Vec::new(), Vec::new(), None);
    let mut checksum = Checksum::default();
    for (part, file) in &files {
        let own = RowsFile::<FlightsHeader>::open(file)?;
        let first = program.get_or_insert_with(|| own.header.clone());
        if let Some(reason) = own.header.mismatch(first, *part, &fingerprint(&asked)) {
            return Err(Error::input(file, "part", reason));
        }
        drawn = names(&own)?;
        read(file, own, *part, &asked, |row| {
            checksum.add(&row.columns(&drawn));
            rows.push(row);
        })?;
    }
    let summary = Summary::of(&rows, &drawn);
    GatheredParts::new(files, &checksum, summary, Vec::new(), &folder.join(SUMMARY))
}

/// Hands on the rows of a part, once they are its runs; then the file must be as it was written.
fn read(
    file: &Path,
    rows: RowsFile<FlightsHeader>,
    part: Part,
    asked: &FlightsFile,
    mut each: impl FnMut(Row),
) -> Result<(), Error> {
    let mut runs = part.range(asked.count());
    let names = names(&rows)?.len();
    rows.each(|row: Row| {
        row.check(asked.count())?;
        if runs.next() != Some(row.run) {
            return Err(FieldError::new("run", format!("{} is not the part's next", row.run)));
        }
        let drawn = row.flown.as_ref().map_or(names, |flown| flown.drawn.len());
        if drawn != names {
            return Err(FieldError::new("flown.drawn", format!("has {drawn} numbers of {names}")));
        }
        each(row);
        Ok(())
    })?;
    match runs.next() {
        None => Ok(()),
        Some(run) => Err(Error::input(file, "run", format!("{run} is missing"))),
    }
}

/// Names of what was drawn.
fn names(rows: &RowsFile<FlightsHeader>) -> Result<Vec<ErrorColumn>, Error> {
    let names: Vec<String> = rows.said(DRAWN)?;
    Ok(names.into_iter().map(|name| ErrorColumn { name, unit: "" }).collect())
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
    for (part, file) in &gathered.files {
        let here = picked.within(&part.range(shared.count()));
        if here.is_empty() {
            continue;
        }
        read(file, RowsFile::open(file)?, *part, &flights.asked, |row| {
            if here.binary_search(&row.run).is_ok() {
                let scenario = format!("{}, run {}", row.scenario, row.run);
                let value = shared.columns(&row);
                rows.insert(row.run, Then { part: *part, scenario, value });
            }
        })?;
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
