//! Flights in parts, for many machines: each part is flown by a program of its own, whole or not at all;
//! gathered, they are one series.
//!
//! ```text
//! DIR/flights.json                        what is flown: the same for all parts
//! DIR/part-00003-of-00010.parquet         a row a run of the part, when all are there
//! DIR/part-00003-of-00010.journal.jsonl   until then
//! DIR/flights.summary.json                statistics over all rows, by whoever gathers
//! ```

use crate::campaign::{Asked, FLIGHTS, Flights, Header, SUMMARY, failed};
use crate::pilot::Pilot;
use crate::row::{Drawn, Row};
use crate::statistics::Summary;
use remora_host::error::Error;
use remora_host::fingerprint::{Fnv, fingerprint};
use remora_host::formats::{
    Cell, Column, TableReader, TableWriter, check_writable, json, make_directory,
    remove_partials_of, write_as_it_comes, write_atomically, write_first,
};
use remora_host::journal::Journal;
use remora_host::part::{self, Part};
use remora_host::parts::{Difference, KEY, Made};
use remora_host::pool;
use remora_host::progress::Progress;
use serde::Serialize;
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// What a part keeps the checksum of its rows under.
const CHECKSUM: &str = "remora.checksum";
/// Most rows of a row group.
const GROUP: usize = 1 << 16;

/// Flies the runs of a part that are not in its journal yet, then writes its table.
///
/// # Errors
/// As [`Flights::fly`]; a folder of other flights.
pub fn fly(flights: &Flights, part: Part, progress: &mut dyn Progress) -> Result<Made, Error> {
    part.check(flights.asked.count(), "runs")?;
    let plans = flights.plans()?;
    let drawn = flights.drawn(&plans)?;
    make_directory(&flights.out)?;
    agree(flights)?;
    let range = part.range(flights.asked.count());
    let count = range.end - range.start;
    let (table, header) = (part.table(&flights.out), Header::of_part(&flights.asked, part));
    let files = vec![table.clone()];
    if table.exists() {
        let found: Header = part::said(&table, &TableReader::open(&table)?, KEY)?;
        return match found == header {
            true => Ok(Made { part, rows: count, planned: 0, files }),
            false => Err(Error::input(&table, KEY, "is of other flights; choose another --out")),
        };
    }
    check_writable(&table)?;
    let log = flights.out.join(format!("{}.journal.jsonl", part.stem()));
    let (mut journal, finished) =
        Journal::open(&log, &header, &|row: &Row| row.check(flights.asked.count()))?;
    remove_partials_of(&table);
    let at = |run: u64| run.checked_sub(range.start).and_then(|i| usize::try_from(i).ok());
    let mut rows: Vec<Option<Row>> = range.clone().map(|_| None).collect();
    for row in finished {
        if let Some(place) = at(row.run).and_then(|i| rows.get_mut(i)) {
            *place = Some(row);
        }
    }
    let pending: Vec<u64> =
        range.clone().filter(|run| at(*run).is_some_and(|i| rows[i].is_none())).collect();
    progress.begin(rows.len(), rows.len() - pending.len());
    let run = |pilot: &mut Pilot, run: u64| flights.run(pilot, &plans, run);
    let finish = |run: u64, row: Row| {
        progress.done(row.flown.is_some());
        journal.append(&row)?;
        rows[(run - range.start) as usize] = Some(row);
        Ok(())
    };
    let outcome = pool::plan_all_with(flights.jobs, &pending, |_| Pilot::default(), run, finish);
    progress.end();
    outcome?;
    let rows: Vec<Vec<Column>> = rows.iter().flatten().map(|row| row.columns(&drawn)).collect();
    write(&table, &rows, &header, flights.asked.seed)?;
    std::fs::remove_file(&log).map_err(|cause| Error::output(&log, &cause))?;
    Ok(Made { part, rows: count, planned: pending.len() as u64, files })
}

/// Says in the folder what is flown, or compares with what it says.
fn agree(flights: &Flights) -> Result<(), Error> {
    let file = flights.out.join(FLIGHTS);
    let text = json::to_text(&flights.asked).map_err(|error| failed(&file, &error))?;
    if !file.exists() {
        write_first(&file, text.as_bytes())?;
    }
    match Asked::read(&flights.out)? == flights.asked {
        true => Ok(()),
        false => {
            let reason = "these flights were begun with other plans, errors, options or runs; choose another --out";
            Err(Error::input(&file, "", reason))
        }
    }
}

fn write(file: &Path, rows: &[Vec<Column>], header: &Header, seed: u64) -> Result<(), Error> {
    let text = serde_json::to_string(header).map_err(|error| failed(file, &error))?;
    let program = remora_host::formats::Program::this();
    let entries = vec![
        ("remora.format", "remora-flights-table/1".to_string()),
        ("remora.version", program.version),
        ("remora.commit", program.commit),
        ("remora.seed", seed.to_string()),
        (KEY, text),
        (CHECKSUM, checksum(rows.iter().flatten().map(|column| &column.cell))),
    ];
    write_as_it_comes(file, |handle| {
        let like = rows.first().map(Vec::as_slice).unwrap_or_default();
        let mut writer =
            TableWriter::begin(handle, like, entries, true).map_err(io::Error::other)?;
        let mut groups = rows.chunks(GROUP);
        groups.try_for_each(|group| writer.write(group)).map_err(io::Error::other)?;
        writer.end(Vec::new()).map(drop).map_err(io::Error::other)
    })
}

fn checksum<'a>(cells: impl Iterator<Item = &'a Cell>) -> String {
    let (mut hash, mut bytes) = (Fnv::default(), Vec::new());
    for cell in cells {
        bytes.clear();
        cell.add_to(&mut bytes);
        hash.add(&bytes);
    }
    hash.to_string()
}

/// Parts of flights that were gathered.
#[derive(Clone, Debug, Serialize)]
pub struct Gathered {
    /// How many there should be.
    pub parts: u64,
    /// Those that are missing.
    pub missing: Vec<Part>,
    /// Checksum of all rows, in the order of the runs: that of the same flights, however shared out.
    pub checksum: String,
    /// Statistics over the rows that are there.
    pub summary: Summary,
    /// The rows.
    #[serde(skip)]
    pub rows: Vec<(Part, Row)>,
}

/// Reads all parts of a folder; where none is missing, their summary goes to its file.
///
/// # Errors
/// A folder without parts; one that is damaged or of other flights than the folder's.
pub fn gather(folder: &Path) -> Result<Gathered, Error> {
    let asked = Asked::read(folder)?;
    let tables = part::tables(folder)?;
    let (mut rows, mut names, mut program) = (Vec::new(), Vec::new(), None);
    let mut cells = Vec::new();
    for (part, file) in &tables {
        let table = TableReader::open(file)?;
        let header: Header = part::said(file, &table, KEY)?;
        let first = program.get_or_insert_with(|| header.clone());
        if let Some(reason) = header.is_other(first, *part, &fingerprint(&asked)) {
            return Err(Error::input(file, KEY, reason));
        }
        let read = read(file, &table, *part, &asked)?;
        names.clone_from(&table.names);
        rows.extend(read.iter().map(|(_, row)| (*part, row.clone())));
        cells.extend(read.into_iter().flat_map(|(cells, _)| cells));
    }
    let missing = part::missing(&tables, tables.first().map_or(0, |(part, _)| part.of()));
    let plain: Vec<Row> = rows.iter().map(|(_, row)| row.clone()).collect();
    let summary = Summary::of(&plain, &drawn(&names));
    if missing.is_empty() {
        let file = folder.join(SUMMARY);
        let text = json::to_text(&summary).map_err(|error| failed(&file, &error))?;
        write_atomically(&file, text.as_bytes())?;
    }
    let parts = tables.first().map_or(0, |(part, _)| part.of());
    Ok(Gathered { parts, missing, checksum: checksum(cells.iter()), summary, rows })
}

/// Names of what was drawn, by those of columns.
fn drawn(names: &[String]) -> Vec<Drawn> {
    let drawn = names.iter().filter_map(|name| name.strip_prefix("drawn."));
    drawn.map(|name| Drawn { name: name.into(), unit: "" }).collect()
}

type Read = Vec<(Vec<Cell>, Row)>;

/// The rows of a part, once they are its runs and have its checksum.
fn read(file: &Path, table: &TableReader, part: Part, asked: &Asked) -> Result<Read, Error> {
    let damaged = |reason: String| Error::input(file, "", format!("is damaged: {reason}"));
    let mut read = Vec::new();
    for group in 0..table.groups() {
        for cells in table.group(group, GROUP).map_err(|error| damaged(error.to_string()))? {
            let row = Row::of_cells(&cells).ok_or_else(|| damaged("holds no flights".into()))?;
            row.check(asked.count()).map_err(|error| error.at(file))?;
            read.push((cells, row));
        }
    }
    if !read.iter().map(|(_, row)| row.run).eq(part.range(asked.count())) {
        return Err(damaged("has not the runs of this part".into()));
    }
    let sum = checksum(read.iter().flat_map(|(cells, _)| cells));
    match table.entries.get(CHECKSUM) == Some(&sum) {
        true => Ok(read),
        false => Err(Error::input(file, CHECKSUM, "does not match the rows: the part is damaged")),
    }
}

/// Flies every n-th run again, so that there are some `sample` of them; the rows that differ.
///
/// # Errors
/// A plan that is gone; a world that cannot be flown in.
pub fn recompute(
    folder: &Path,
    gathered: &Gathered,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let flights = Flights::again(folder, jobs)?;
    let plans = flights.plans()?;
    let step = (gathered.rows.len() as u64).div_ceil(sample.max(1)).max(1);
    let rows: Vec<&(Part, Row)> = gathered.rows.iter().step_by(step as usize).collect();
    let pending: Vec<usize> = (0..rows.len()).collect();
    progress.begin(pending.len(), 0);
    let mut found = Vec::new();
    let run = |pilot: &mut Pilot, i: usize| flights.run(pilot, &plans, rows[i].1.run);
    let finish = |i: usize, again: Row| {
        let (part, row) = rows[i];
        let column = differs(row, &again);
        progress.done(column.is_none());
        let scenario = format!("{}, run {}", row.scenario, row.run);
        found.extend(column.map(|column| Difference { part: *part, scenario, column }));
        Ok(())
    };
    let outcome = pool::plan_all_with(jobs, &pending, |_| Pilot::default(), run, finish);
    progress.end();
    outcome.map(|()| found)
}

/// The first column in which rows differ.
fn differs(row: &Row, again: &Row) -> Option<String> {
    let bytes = |cell: &Cell| {
        let mut bytes = Vec::new();
        cell.add_to(&mut bytes);
        bytes
    };
    let drawn = row.flown.as_ref().map_or(0, |flown| flown.drawn.len());
    let named = |i: usize| Drawn { name: i.to_string(), unit: "" };
    let drawn: Vec<Drawn> = (0..drawn).map(named).collect();
    let mut pairs = row.columns(&drawn).into_iter().zip(again.columns(&drawn));
    let found = pairs.find(|(one, other)| bytes(&one.cell) != bytes(&other.cell));
    found.map(|(column, _)| column.name)
}

/// Whether a folder holds parts of flights.
pub fn is_flown_in(folder: &Path) -> bool {
    let file: PathBuf = folder.join(FLIGHTS);
    file.is_file()
}
