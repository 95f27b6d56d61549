//! Doing a sample of gathered work again: a machine that computes wrongly is found by what it came to.

use super::gather::read_part;
use super::job::Job;
use super::work::Kept;
use super::work::Work;
use super::{GatheredParts, PartHeader};
use crate::campaign::Summary;
use crate::error::Error;
use crate::formats::{Cell, Column, TIMES};
use crate::part::{Part, picked};
use crate::pool;
use crate::progress::Progress;
use crate::rows_file::RowsFile;
use serde::Serialize;
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::Path;

/// A row that is not what the same number comes to here.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The part.
    pub part: Part,
    /// Id of the scenario.
    pub scenario: String,
    /// The first column that differs.
    pub column: String,
}

/// Earlier result of a number, to compare with.
#[derive(Clone, Debug)]
pub struct Then<T> {
    /// The part that it stands in.
    pub part: Part,
    /// Id of the scenario.
    pub scenario: String,
    /// The result.
    pub value: T,
}

/// Does all numbers of a sample again; those that come to something else, in their order. `differs` names the first
/// column that does.
///
/// # Errors
/// An error that ends the work; a thread that cannot be started.
pub fn again<T: Sync, A: Send, W: Default>(
    sample: &BTreeMap<u64, Then<T>>,
    jobs: NonZeroUsize,
    run: impl Fn(&mut W, u64) -> Result<A, Error> + Sync,
    differs: impl Fn(&T, &A) -> Option<String>,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let pending: Vec<u64> = sample.keys().copied().collect();
    let mut found = BTreeMap::new();
    progress.begin(pending.len(), 0);
    let finish = |number: u64, again: A| {
        let Some(Then { part, scenario, value }) = sample.get(&number) else { return Ok(()) };
        let column = differs(value, &again);
        progress.done(column.is_none());
        let difference =
            |column| (number, Difference { part: *part, scenario: scenario.clone(), column });
        found.extend(column.map(difference));
        Ok(())
    };
    let outcome = pool::plan_all_with(jobs, &pending, |_| W::default(), run, finish);
    progress.end();
    outcome.map(|()| found.into_values().collect())
}

/// Numbers of a sample that are drawn evenly over all parts, handed out part by part.
#[derive(Debug)]
pub struct Sample(std::iter::Peekable<std::vec::IntoIter<u64>>);

impl Sample {
    /// Draws `sample` numbers out of `count`.
    pub fn of(sample: u64, count: u64) -> Self {
        Self(picked(sample, count).into_iter().peekable())
    }

    /// The numbers of a part, which follow those of the parts before.
    pub fn within(&mut self, range: &Range<u64>) -> Vec<u64> {
        while self.0.next_if(|number| *number < range.start).is_some() {}
        std::iter::from_fn(|| self.0.next_if(|number| *number < range.end)).collect()
    }
}

/// Plans `sample` of the rows again, spread evenly over the scenarios, and compares all columns but times.
/// Another build of the program may do it; mission, settings and scenarios must be the parts' own.
///
/// # Errors
/// A job that is not the parts'; a part that has changed since; a thread that cannot be started.
pub fn recompute(
    job: &Job,
    gathered: &GatheredParts<Summary>,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let mut rows = BTreeMap::new();
    let mut picked = Sample::of(sample, job.count());
    for (part, file) in &gathered.files {
        let range = part.range(job.count());
        let here = picked.within(&range);
        if !here.is_empty() {
            read_sampled(job, (*part, file), &here, &mut rows)?;
        }
    }
    let differs = |then: &Vec<Column>, again: &Kept| {
        differing(then, &job.columns(again), |name| !TIMES.contains(&name))
    };
    again(&rows, jobs, |planner, number| job.run(planner, number), differs, progress)
}

/// Reads the rows of a part that are sampled.
fn read_sampled(
    job: &Job,
    (part, file): (Part, &Path),
    here: &[u64],
    sampled: &mut BTreeMap<u64, Then<Vec<Column>>>,
) -> Result<(), Error> {
    let rows = RowsFile::<PartHeader>::open(file)?;
    if let Some((field, reason)) = other(job, &rows.header) {
        return Err(Error::input(file, field, reason));
    }
    let mut numbers = part.range(job.count());
    read_part(file, rows, |row| {
        let number = numbers.next().filter(|number| here.binary_search(number).is_ok());
        let then = || Then { part, scenario: row.scenario.clone(), value: job.columns_of(row) };
        sampled.extend(number.map(|number| (number, then())));
        Ok(())
    })
}

/// The first column that is meant and has other bits.
pub fn differing(
    one: &[Column],
    other: &[Column],
    is_meant: impl Fn(&str) -> bool,
) -> Option<String> {
    let mut meant = one.iter().zip(other).filter(|(column, _)| is_meant(&column.name));
    let found = meant.find(|(one, other)| bytes(&one.cell) != bytes(&other.cell));
    found.map(|(column, _)| column.name.clone())
}

fn bytes(cell: &Cell) -> Vec<u8> {
    let mut bytes = Vec::new();
    cell.add_to(&mut bytes);
    bytes
}

/// First difference of the job from that of a part, but for the program.
fn other(job: &Job, header: &PartHeader) -> Option<(&'static str, String)> {
    let mut ours = job.header(header.part);
    ours.campaign.version.clone_from(&header.campaign.version);
    ours.campaign.program.clone_from(&header.campaign.program);
    let found = ours.differs_from(header);
    found.map(|(field, reason)| (field, format!("the part's command makes {reason} here")))
}
