//! Making a part: doing what is not in its journal yet, then writing its table.

use super::KEY;
use super::work::Work;
use super::write::write_rows;
use crate::error::Error;
use crate::formats::{TableReader, check_writable, make_directory, remove_partials_of};
use crate::journal::{Heading, Journal};
use crate::part::{self, Part};
use crate::pool;
use crate::progress::Progress;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// A part that is complete.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Made {
    /// Which it is.
    pub part: Part,
    /// Its rows.
    pub rows: u64,
    /// Those that this run came to.
    pub planned: u64,
    /// Files of it.
    pub files: Vec<PathBuf>,
}

/// Makes a part of the work in a directory that other programs may share; what an earlier run came to is
/// taken from it. Memory holds a place of eight bytes a row, and a few thousand rows.
///
/// # Errors
/// A directory or file that cannot be written; a part or journal of other work; another program that makes the
/// same part; [`Error::Interrupted`], which leaves a journal to go on with.
pub fn make<W: Work>(
    work: &W,
    part: Part,
    jobs: NonZeroUsize,
    out: &Path,
    progress: &mut dyn Progress,
) -> Result<Made, Error> {
    part.check(work.count(), W::COUNTED)?;
    let header = work.header(part);
    let table = part.table(out);
    let range = part.range(work.count());
    let rows = range.end - range.start;
    let files: Vec<PathBuf> = [table.clone()].into_iter().chain(work.beside(&table)).collect();
    if table.exists() {
        is_the_same(&table, &header)?;
        if let Some(gone) = files.iter().find(|file| !file.exists()) {
            let name = table.file_name().unwrap_or_default().to_string_lossy();
            let reason = format!("no such file: remove {name} to make both again");
            return Err(Error::input(gone, "", reason));
        }
        return Ok(Made { part, rows, planned: 0, files });
    }
    make_directory(out)?;
    files.iter().try_for_each(|file| check_writable(file))?;
    let log = out.join(format!("{}.journal.jsonl", part.stem()));
    let mut places: Vec<Option<u64>> = vec![None; usize::try_from(rows).unwrap_or(usize::MAX)];
    let at = |number: u64| usize::try_from(number - range.start).unwrap_or(usize::MAX);
    let mut journal = Journal::open_each(&log, &header, &mut |place, kept: W::Kept| {
        work.check(part, &kept)?;
        places[at(W::number(&kept))] = Some(place);
        Ok(())
    })?;
    files.iter().for_each(|file| remove_partials_of(file));

    let pending: Vec<u64> = range.clone().filter(|number| places[at(*number)].is_none()).collect();
    progress.begin(places.len(), places.len() - pending.len());
    let run = |worker: &mut W::Worker, number: u64| work.run(worker, number);
    let finish = |number: u64, kept: W::Kept| {
        progress.done(W::is_well(&kept));
        places[at(number)] = Some(journal.append_at(&kept)?);
        Ok(())
    };
    let outcome = pool::plan_all_with(jobs, &pending, |_| W::Worker::default(), run, finish);
    progress.end();
    if outcome.is_err() {
        journal.sync()?;
    }
    outcome?;

    let places: Vec<u64> = places.into_iter().flatten().collect();
    let mut entries = work.entries();
    let said = serde_json::to_string(&header);
    entries.push((KEY, said.map_err(|error| Error::output(&table, &error.into()))?));
    work.write_beside(&table, &entries, &journal, &places)?;
    write_rows(work, &table, entries, &journal, &places)?;
    // The table says it all from now on.
    std::fs::remove_file(&log).map_err(|cause| Error::output(&log, &cause))?;
    Ok(Made { part, rows, planned: pending.len() as u64, files })
}

/// Refuses a part that is there and is another's.
fn is_the_same<H: Heading>(table: &Path, header: &H) -> Result<(), Error> {
    let found: H = part::said(table, &TableReader::open(table)?, KEY)?;
    match header.difference(&found) {
        Some((field, reason)) => Err(Error::input(table, field, reason)),
        None => Ok(()),
    }
}
