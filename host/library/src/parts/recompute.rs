//! Planning a sample of gathered parts again: a machine that computes wrongly is found by the checksums of
//! its plans.

use super::gather::{Gathered, method_of, read_part};
use super::job::{Job, Kept};
use super::{Header, KEY};
use crate::error::Error;
use crate::formats::{Cell, Row, TIMES, TableReader, columns};
use crate::part::{self, Part, picked};
use crate::planning::Planner;
use crate::pool;
use crate::progress::Progress;
use serde::Serialize;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;

/// A row that is not what the same plan comes to here.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The part.
    pub part: Part,
    /// Id of the scenario.
    pub scenario: String,
    /// The first column that differs.
    pub column: String,
}

/// Plans `sample` of the rows again, spread evenly over the scenarios, and compares all columns but times.
/// Another build of the program may do it; mission, settings and scenarios must be the parts' own.
///
/// # Errors
/// A job that is not the parts'; a part that has changed since; a thread that cannot be started.
pub fn recompute<const NL: usize>(
    job: &Job<NL>,
    gathered: &Gathered,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let mut rows = BTreeMap::new();
    let mut picked = picked(sample, job.scenarios.count()).into_iter().peekable();
    for (part, file) in &gathered.tables {
        let range = part.range(job.scenarios.count());
        while picked.next_if(|index| *index < range.start).is_some() {}
        if picked.peek().is_none_or(|index| *index >= range.end) {
            continue;
        }
        let table = TableReader::open(file)?;
        let header: Header = part::said(file, &table, KEY)?;
        if let Some((field, reason)) = other(job, &header) {
            return Err(Error::input(file, field, reason));
        }
        let mut index = range.start;
        read_part(file, &table, &header, |row| {
            if picked.next_if_eq(&index).is_some() {
                rows.insert(index, (*part, row.clone()));
            }
            index += 1;
        })?;
    }
    let pending: Vec<u64> = rows.keys().copied().collect();
    let method = method_of(&gathered.header);
    let differs = |row: &Row, again: &Row| {
        let pairs = columns(row, &method).into_iter().zip(columns(again, &method));
        let mut meant = pairs.filter(|(one, _)| !TIMES.contains(&one.name.as_str()));
        let found = meant.find(|(one, other)| bytes(&one.cell) != bytes(&other.cell));
        found.map(|(column, _)| column.name)
    };
    let mut differences = BTreeMap::new();
    progress.begin(pending.len(), 0);
    let plan = |planner: &mut Planner, index: u64| job.plan(planner, index);
    let finish = |index: u64, again: Kept| {
        let Some((part, row)) = rows.get(&index) else { return Ok(()) };
        let column = differs(row, &again.row);
        progress.done(column.is_none());
        let found = column.map(|column| {
            (index, Difference { part: *part, scenario: row.scenario.clone(), column })
        });
        differences.extend(found);
        Ok(())
    };
    let outcome = pool::plan_all(jobs, &pending, plan, finish);
    progress.end();
    outcome.map(|()| differences.into_values().collect())
}

fn bytes(cell: &Cell) -> Vec<u8> {
    let mut bytes = Vec::new();
    cell.add_to(&mut bytes);
    bytes
}

/// What makes the job another than that of a part, but for the program.
fn other<const NL: usize>(job: &Job<NL>, header: &Header) -> Option<(&'static str, String)> {
    let mut ours = job.header(header.part);
    ours.campaign.version.clone_from(&header.campaign.version);
    ours.campaign.program.clone_from(&header.campaign.program);
    let found = ours.differs_from(header);
    found.map(|(field, reason)| (field, format!("the part's command makes {reason} here")))
}
