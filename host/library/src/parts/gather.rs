//! Gathering parts: whether all are there and of one kind, and what they come to together.

use super::nodes::{Nodes, Numbers};
use super::write::Checksum;
use super::{COMMAND, KEY, PartHeader, TOLERANCES};
use crate::campaign::{JOURNAL, Run, Summary, Tally};
use crate::error::{Error, FieldError};
use crate::formats::{
    Residuals, Row, TIMES, TableReader, columns, json, read_rows, write_atomically,
};
use crate::method::Method;
use crate::part::{self, Part};
use serde::Serialize;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Files of a campaign in one piece, which writes `summary.json` too.
const OF_ONE_PIECE: [&str; 2] = [JOURNAL, "results.parquet"];

/// Parts that were gathered; `S` is what their rows come to together.
#[derive(Clone, Debug, Serialize)]
pub struct GatheredParts<S> {
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

impl<S: Serialize> GatheredParts<S> {
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
/// A directory without parts, or with a campaign in one piece; a part that is damaged, has not its own scenarios, or is
/// of another kind than the first.
pub fn gather(directory: &Path) -> Result<GatheredParts<Summary>, Error> {
    let tables = part::tables(directory)?;
    part::alone(directory, &OF_ONE_PIECE, "a campaign in one piece")?;
    let mut found: Option<(PartHeader, Vec<String>)> = None;
    let mut same = Checksum::default();
    let mut tally = Tally::default();
    let mut method = Method::default();
    let mut ids = HashSet::new();
    for (part, file) in &tables {
        let table = TableReader::open(file)?;
        let header: PartHeader = part::said(file, &table, KEY)?;
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
        read_part(file, &table, &header, |row, _| {
            // Those that are drawn are known by their number.
            if header.seed.is_none() {
                first_of(&mut ids, row).map_err(|error| error.at(file))?;
            }
            tally.add(row);
            same.add_some(&columns(row, &method), |name| !TIMES.contains(&name));
            Ok(())
        })?;
    }
    let command = found.map(|(_, command)| command).unwrap_or_default();
    let run = Run { planned: 0, resumed: tally.rows(), wall_s: 0.0 };
    let summary = tally.summary(&method, run);
    GatheredParts::new(tables, &same, summary, command, &directory.join("summary.json"))
}

/// Refuses a scenario's second row.
fn first_of(ids: &mut HashSet<String>, row: &Row) -> Result<(), FieldError> {
    match ids.insert(row.scenario.clone()) {
        true => Ok(()),
        false => Err(FieldError::new("scenario", format!("{:?} has a row already", row.scenario))),
    }
}

/// How the plans of a part were made, as far as its rows say.
fn method_of(header: &PartHeader) -> Method {
    let of = &header.campaign;
    let (mode, warm_start, qp, integrator) = (of.mode, of.warm_start, of.qp, of.integrator);
    Method { mode, warm_start, qp, integrator, ..Method::default() }
}

/// Hands the rows of a part on with what stands at their nodes, once each of its scenarios has one. Then they must
/// have the part's checksum.
pub(super) fn read_part(
    file: &Path,
    table: &TableReader,
    header: &PartHeader,
    mut each: impl FnMut(&Row, Numbers) -> Result<(), Error>,
) -> Result<(), Error> {
    let range = header.part.range(header.count);
    let expected = range.end - range.start;
    if table.rows() != expected {
        let reason = format!("has {} rows instead of {expected}", table.rows());
        return Err(Error::input(file, "", reason));
    }
    let (method, limits) = (method_of(header), limits(file, table)?);
    let mut nodes = header.nodes.then(|| Nodes::open(file, header)).transpose()?;
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
        let named = |error: FieldError| {
            let reason = format!("{}, of {}", error.reason, row.scenario);
            Error::input(file, error.field, reason)
        };
        row.check_within(&limits).map_err(named)?;
        let at_nodes = nodes.as_mut().map(|nodes| nodes.of(&row)).transpose()?;
        each(&row, at_nodes.unwrap_or_default())
    })?;
    nodes.map_or(Ok(()), Nodes::end)?;
    checksum.check(file, table)
}

/// How large residuals of the part's plans may be, as far as it says so.
fn limits(file: &Path, table: &TableReader) -> Result<[f64; Residuals::COUNT], Error> {
    match table.entries.get(TOLERANCES) {
        Some(text) => json::parse_value(text.as_bytes())
            .map_err(|error| Error::input(file, TOLERANCES, error.reason)),
        None => Ok([f64::MAX; Residuals::COUNT]),
    }
}
