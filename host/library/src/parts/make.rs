//! Making a part: planning what is not in its journal yet, then writing its table.

use super::job::{Job, Kept};
use super::write::{nodes_file, write_nodes, write_rows};
use super::{Header, KEY};
use crate::error::Error;
use crate::formats::{Status, TableReader, check_writable, make_directory, remove_partials_of};
use crate::journal::{self, Heading};
use crate::part::{self, Part};
use crate::planning::Planner;
use crate::pool;
use crate::progress::Progress;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

pub(super) type Journal = journal::Journal<Kept>;

/// A part that is complete.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Made {
    /// Which it is.
    pub part: Part,
    /// Its scenarios.
    pub rows: u64,
    /// Those that this run planned.
    pub planned: u64,
    /// Files of it.
    pub files: Vec<PathBuf>,
}

/// Makes a part of a job in a directory that other programs may share; what an earlier run came to is
/// taken from it.
///
/// # Errors
/// A directory or file that cannot be written; a part or journal of another campaign; another program that
/// makes the same part; [`Error::Interrupted`], which leaves a journal to go on with.
pub fn make<const NL: usize>(
    job: &Job<NL>,
    part: Part,
    jobs: NonZeroUsize,
    out: &Path,
    progress: &mut dyn Progress,
) -> Result<Made, Error> {
    part.check(job.scenarios.count(), "scenarios")?;
    let header = job.header(part);
    let table = part.table(out);
    let range = part.range(job.scenarios.count());
    let rows = range.end - range.start;
    let nodes = job.nodes.then(|| nodes_file(&table));
    let files: Vec<PathBuf> = [table.clone()].into_iter().chain(nodes.clone()).collect();
    if table.exists() {
        is_the_same(&table, &header)?;
        return Ok(Made { part, rows, planned: 0, files });
    }
    make_directory(out)?;
    files.iter().try_for_each(|file| check_writable(file))?;
    let log = out.join(format!("{}.journal.jsonl", part.stem()));
    let mut places: Vec<Option<u64>> = vec![None; usize::try_from(rows).unwrap_or(usize::MAX)];
    let at = |index: u64| usize::try_from(index - range.start).unwrap_or(usize::MAX);
    let mut journal = Journal::open_each(&log, &header, &mut |place, kept: Kept| {
        job.check(part, &kept)?;
        places[at(kept.index)] = Some(place);
        Ok(())
    })?;
    files.iter().for_each(|file| remove_partials_of(file));

    let pending: Vec<u64> = range.clone().filter(|index| places[at(*index)].is_none()).collect();
    progress.begin(places.len(), places.len() - pending.len());
    let plan = |planner: &mut Planner, index: u64| job.plan(planner, index);
    let finish = |index: u64, kept: Kept| {
        progress.done(kept.row.status == Status::Solved);
        places[at(index)] = Some(journal.append_at(&kept)?);
        Ok(())
    };
    let outcome = pool::plan_all(jobs, &pending, plan, finish);
    progress.end();
    if outcome.is_err() {
        journal.sync()?;
    }
    outcome?;

    let places: Vec<u64> = places.into_iter().flatten().collect();
    if let Some(file) = nodes {
        write_nodes::<NL>(job, &file, &header, &journal, &places)?;
    }
    write_rows(job, &table, &header, &journal, &places)?;
    // The table says it all from now on.
    std::fs::remove_file(&log).map_err(|cause| Error::output(&log, &cause))?;
    Ok(Made { part, rows, planned: pending.len() as u64, files })
}

/// Refuses a part that is there and is another's.
fn is_the_same(table: &Path, header: &Header) -> Result<(), Error> {
    let found: Header = part::said(table, &TableReader::open(table)?, KEY)?;
    match header.difference(&found) {
        Some((field, reason)) => Err(Error::input(table, field, reason)),
        None => Ok(()),
    }
}
