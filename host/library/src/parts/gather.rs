//! Gathering of parts: it checks that all are there and of one kind, and sums them up.

use super::work::Kept;
use super::write::Checksum;
use super::{COMMAND, PartHeader, TOLERANCES};
use crate::campaign::{JOURNAL, Run, Summary, Tally};
use crate::error::{Error, FieldError};
use crate::formats::{Residuals, Row, TIMES, columns, json, write_atomically};
use crate::method::Method;
use crate::part::{self, Part};
use crate::rows_file::RowsFile;
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
    /// Parts that are missing.
    pub missing: Vec<Part>,
    /// Checksum of all rows in their order, but for times of the machine: that of the same work, however it
    /// was shared out.
    pub checksum: String,
    /// Statistics over the rows that are there.
    pub summary: S,
    /// Arguments by which the parts were made, where they say so.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
    /// Their files of rows, in order.
    #[serde(skip)]
    pub files: Vec<(Part, PathBuf)>,
}

impl<S: Serialize> GatheredParts<S> {
    /// Puts together what the parts of a directory came to; where none is missing, the summary goes to `file`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn new(
        files: Vec<(Part, PathBuf)>,
        checksum: &Checksum,
        summary: S,
        command: Vec<String>,
        file: &Path,
    ) -> Result<Self, Error> {
        let parts = files.first().map_or(0, |(part, _)| part.of());
        let missing = part::missing(&files, parts);
        if missing.is_empty() {
            let text = json::to_text(&summary);
            let text = text.map_err(|error| Error::output(file, &error.into()))?;
            write_atomically(file, text.as_bytes())?;
        }
        Ok(Self { parts, missing, checksum: checksum.to_string(), summary, command, files })
    }
}

/// Reads all parts of a directory; where none is missing, their summary goes to `summary.json`.
///
/// # Errors
/// A directory without parts, or with a campaign in one piece; a part that is damaged, has not its own scenarios, or is
/// of another kind than the first.
pub fn gather(directory: &Path) -> Result<GatheredParts<Summary>, Error> {
    let files = part::files(directory)?;
    part::alone(directory, &OF_ONE_PIECE, "a campaign in one piece")?;
    let mut found: Option<(PartHeader, Vec<String>)> = None;
    let mut same = Checksum::default();
    let mut tally = Tally::default();
    let mut method = Method::default();
    let mut ids = HashSet::new();
    for (part, file) in &files {
        let rows = RowsFile::<PartHeader>::open(file)?;
        let header = rows.header.clone();
        if header.part != *part {
            return Err(Error::input(file, "part", format!("is {}", header.part)));
        }
        match &found {
            None => {
                method = method_of(&header);
                found = Some((header.clone(), rows.said(COMMAND)?));
            }
            Some((first, _)) => {
                if let Some((field, reason)) = header.differs_from(first) {
                    let reason = format!("is of another kind than the first part: {reason}");
                    return Err(Error::input(file, field, reason));
                }
            }
        }
        read_part(file, rows, |row| {
            // Drawn scenarios are known by their number.
            if header.seed.is_none() {
                first_of(&mut ids, row)?;
            }
            tally.add(row);
            same.add_some(&columns(row, &method), |name| !TIMES.contains(&name));
            Ok(())
        })?;
    }
    let command = found.map(|(_, command)| command).unwrap_or_default();
    let run = Run { planned: 0, resumed: tally.rows(), wall_s: 0.0 };
    let summary = tally.summary(&method, run);
    GatheredParts::new(files, &same, summary, command, &directory.join("summary.json"))
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

/// Hands the rows of a part on, once they are those of its scenarios; then the file must be as it was written.
pub(super) fn read_part(
    file: &Path,
    part: RowsFile<PartHeader>,
    mut each: impl FnMut(&Row) -> Result<(), FieldError>,
) -> Result<(), Error> {
    let PartHeader { part: which, count, seed, .. } = part.header;
    let limits: [f64; Residuals::COUNT] = part.said(TOLERANCES)?;
    let mut indices = which.range(count);
    let expected = indices.end - indices.start;
    let found = part.each(|Kept { index, row, .. }| {
        let id = seed.map(|seed| crate::draw::id(seed, index));
        if indices.next() != Some(index) || id.is_some_and(|id| id != row.scenario) {
            let reason = format!("{:?} is not the part's next", row.scenario);
            return Err(FieldError::new("scenario", reason));
        }
        row.check_within(&limits).map_err(|error| {
            FieldError::new(error.field, format!("{}, of {}", error.reason, row.scenario))
        })?;
        each(&row)
    })?;
    match found == expected {
        true => Ok(()),
        false => {
            let reason = format!("has {found} rows instead of {expected}");
            Err(Error::input(file, "", reason))
        }
    }
}
