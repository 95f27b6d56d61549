//! Gathering parts: whether all are there and of one kind, and what they come to together.

use super::write::{Checksum, nodes_file};
use super::{CHECKSUM, COMMAND, FORMAT, Header, KEY, NODES_FORMAT};
use crate::campaign::{Run, Summary, Tally};
use crate::error::Error;
use crate::formats::{
    MOST_ROWS, Row, TIMES, TableReader, columns, json, read_rows, write_atomically,
};
use crate::method::Method;
use crate::part::{self, Part};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Parts that were gathered; `S` is what their rows come to together.
#[derive(Clone, Debug, Serialize)]
pub struct Gathered<S> {
    /// How many there should be.
    pub parts: u64,
    /// Those that are missing.
    pub missing: Vec<Part>,
    /// Checksum of all rows in their order, but for times of the machine: that of the same work, however it
    /// was shared out.
    pub checksum: String,
    /// Statistics over the rows that are there.
    pub summary: S,
    /// Arguments by which the parts were made, where they say so.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
    /// The tables, in order.
    #[serde(skip)]
    pub tables: Vec<(Part, PathBuf)>,
}

impl<S: Serialize> Gathered<S> {
    /// Puts together what the tables of a directory came to; where none is missing, the summary goes to `file`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn new(
        tables: Vec<(Part, PathBuf)>,
        checksum: &Checksum,
        summary: S,
        command: Vec<String>,
        file: &Path,
    ) -> Result<Self, Error> {
        let parts = tables.first().map_or(0, |(part, _)| part.of());
        let missing = part::missing(&tables, parts);
        if missing.is_empty() {
            let text = json::to_text(&summary);
            let text = text.map_err(|error| Error::output(file, &error.into()))?;
            write_atomically(file, text.as_bytes())?;
        }
        Ok(Self { parts, missing, checksum: checksum.to_string(), summary, command, tables })
    }
}

/// Reads all parts of a directory; where none is missing, their summary goes to `summary.json`.
///
/// # Errors
/// A directory without parts; one that is damaged, has not its own scenarios, or is of another kind than the
/// first.
pub fn gather(directory: &Path) -> Result<Gathered<Summary>, Error> {
    let tables = part::tables(directory)?;
    let mut found: Option<(Header, Vec<String>)> = None;
    let mut same = Checksum::default();
    let mut tally = Tally::default();
    let mut method = Method::default();
    for (part, file) in &tables {
        let table = TableReader::open(file)?;
        let header: Header = part::said(file, &table, KEY)?;
        if header.part != *part {
            return Err(Error::input(file, "part", format!("is {}", header.part)));
        }
        match &found {
            None => {
                method = method_of(&header);
                found = Some((header.clone(), part::said(file, &table, COMMAND)?));
            }
            Some((first, _)) => {
                if let Some((field, reason)) = header.differs_from(first) {
                    let reason = format!("is of another kind than the first part: {reason}");
                    return Err(Error::input(file, field, reason));
                }
            }
        }
        read_part(file, &table, &header, |row| {
            tally.add(row);
            same.add_some(&columns(row, &method), |name| !TIMES.contains(&name));
        })?;
        if header.nodes {
            check_nodes(&nodes_file(file), &header)?;
        }
    }
    let command = found.map(|(_, command)| command).unwrap_or_default();
    let run = Run { planned: 0, resumed: tally.rows(), wall_s: 0.0 };
    let summary = tally.summary(&method, run);
    Gathered::new(tables, &same, summary, command, &directory.join("summary.json"))
}

/// How the plans of a part were made, as far as its rows say.
fn method_of(header: &Header) -> Method {
    let of = &header.campaign;
    let (mode, warm_start, qp, integrator) = (of.mode, of.warm_start, of.qp, of.integrator);
    Method { mode, warm_start, qp, integrator, ..Method::default() }
}

/// Hands the rows of a part on, once each of its scenarios has one and they have the part's checksum.
pub(super) fn read_part(
    file: &Path,
    table: &TableReader,
    header: &Header,
    mut each: impl FnMut(&Row),
) -> Result<(), Error> {
    let range = header.part.range(header.count);
    let expected = range.end - range.start;
    if table.rows() != expected {
        let reason = format!("has {} rows instead of {expected}", table.rows());
        return Err(Error::input(file, "", reason));
    }
    let method = method_of(header);
    let mut checksum = Checksum::default();
    let mut indices = range;
    read_rows(file, table, &method, |row| {
        let index = indices.next();
        let drawn = header.seed.zip(index).map(|(seed, index)| crate::draw::id(seed, index));
        if drawn.is_some_and(|id| id != row.scenario) {
            let reason = format!("{:?} is not the part's next", row.scenario);
            return Err(Error::input(file, "scenario", reason));
        }
        checksum.add(&columns(&row, &method));
        each(&row);
        Ok(())
    })?;
    checksum.check(file, table)
}

/// Refuses a table of nodes that is not the part's own, or is damaged. Memory: a row group.
fn check_nodes(file: &Path, header: &Header) -> Result<(), Error> {
    let table = TableReader::open(file)?;
    if table.entries.get(FORMAT).is_none_or(|format| format != NODES_FORMAT) {
        return Err(Error::input(file, FORMAT, format!("is not {NODES_FORMAT}")));
    }
    let said: Header = part::said(file, &table, KEY)?;
    if said != *header {
        let reason = match said.part == header.part {
            true => "is of another kind than the part".into(),
            false => format!("is {}", said.part),
        };
        return Err(Error::input(file, "part", reason));
    }
    let mut checksum = Checksum::default();
    for group in 0..table.groups() {
        let damaged = |error| Error::input(file, "", format!("is damaged: {error}"));
        let rows = table.group(group, MOST_ROWS).map_err(damaged)?;
        rows.iter().for_each(|cells| checksum.add_cells(cells));
    }
    // Tables of nodes had none at first.
    match table.entries.contains_key(CHECKSUM) {
        true => checksum.check(file, &table),
        false => Ok(()),
    }
}
