//! Doing a sample of gathered work again: a machine that computes wrongly is found by what it came to.

use super::gather::read_part;
use super::job::{self, Job};
use super::nodes::Numbers;
use super::work::Work;
use super::{GatheredParts, KEY, PartHeader};
use crate::campaign::Summary;
use crate::error::Error;
use crate::formats::{Cell, Column, TIMES, TableReader, node_columns};
use crate::part::{self, Part, picked};
use crate::pool;
use crate::progress::Progress;
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
    /// What it is of: id of the scenario.
    pub scenario: String,
    /// The first column that differs; of a table of nodes with the node before it.
    pub column: String,
}

/// What was there of a number.
#[derive(Clone, Debug)]
pub struct Then<T> {
    /// The part that it stands in.
    pub part: Part,
    /// What it is of: id of the scenario.
    pub scenario: String,
    /// What it came to.
    pub value: T,
}

/// Does all numbers of a sample again; those that come to something else, in their order. `differs` names the first
/// column that does.
///
/// # Errors
/// What ends the work; a thread that cannot be started.
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
    /// So many of `count`.
    pub fn of(sample: u64, count: u64) -> Self {
        Self(picked(sample, count).into_iter().peekable())
    }

    /// Those of a part, whose numbers follow those of the parts before.
    pub fn within(&mut self, range: &Range<u64>) -> Vec<u64> {
        while self.0.next_if(|number| *number < range.start).is_some() {}
        std::iter::from_fn(|| self.0.next_if(|number| *number < range.end)).collect()
    }
}

/// Plans `sample` of the rows again, spread evenly over the scenarios, and compares all columns but times,
/// and what stands at the nodes where there is a table of them. Another build of the program may do it; mission, settings and scenarios must be the parts' own.
///
/// # Errors
/// A job that is not the parts'; a part that has changed since; a thread that cannot be started.
pub fn recompute<const NL: usize>(
    job: &Job<NL>,
    gathered: &GatheredParts<Summary>,
    sample: u64,
    jobs: NonZeroUsize,
    progress: &mut dyn Progress,
) -> Result<Vec<Difference>, Error> {
    let mut rows = BTreeMap::new();
    let mut picked = Sample::of(sample, job.count());
    for (part, file) in &gathered.tables {
        let range = part.range(job.count());
        let here = picked.within(&range);
        if !here.is_empty() {
            read_sampled(job, (*part, file), &here, &mut rows)?;
        }
    }
    let differs = |then: &Kept, again: &job::Kept| {
        let row = differing(&then.row, &job.columns(again), |name| !TIMES.contains(&name));
        row.or_else(|| differing_nodes::<NL>(&then.nodes, &again.nodes))
    };
    again(&rows, jobs, |planner, number| job.run(planner, number), differs, progress)
}

/// What a part's tables have of a scenario.
struct Kept {
    row: Vec<Column>,
    /// What stands at each node, time first; nothing in a part without nodes.
    nodes: Numbers,
}

/// Reads the rows of a part that are sampled.
fn read_sampled<const NL: usize>(
    job: &Job<NL>,
    (part, file): (Part, &Path),
    here: &[u64],
    rows: &mut BTreeMap<u64, Then<Kept>>,
) -> Result<(), Error> {
    let table = TableReader::open(file)?;
    let header: PartHeader = part::said(file, &table, KEY)?;
    if let Some((field, reason)) = other(job, &header) {
        return Err(Error::input(file, field, reason));
    }
    let mut numbers = part.range(job.count());
    read_part(file, &table, &header, |row, nodes| {
        let number = numbers.next().filter(|number| here.binary_search(number).is_ok());
        let value = || Kept { row: job.columns_of(row), nodes };
        let then = |value| Then { part, scenario: row.scenario.clone(), value };
        rows.extend(number.map(|number| (number, then(value()))));
        Ok(())
    })
}

/// The first number at a node that has other bits: node and column.
fn differing_nodes<const NL: usize>(
    one: &[Vec<f64>],
    other: &[Vec<Option<f64>>],
) -> Option<String> {
    if one.len() != other.len() {
        return Some(format!("nodes: {}, not {}", one.len(), other.len()));
    }
    let is_other = |x: f64, y: Option<f64>| match y {
        Some(y) => x.to_bits() != y.to_bits(),
        None => !x.is_nan(),
    };
    let at = |(node, (one, other)): (usize, (&Vec<f64>, &Vec<Option<f64>>))| {
        let column = match one.len() == other.len() {
            true => one.iter().zip(other).position(|(x, y)| is_other(*x, *y))?,
            false => 0,
        };
        let names = node_columns(NL);
        let name = column.checked_sub(1).and_then(|column| names.get(column));
        Some(format!("node {node}: {}", name.map_or("time_s", |(name, _)| name.as_str())))
    };
    one.iter().zip(other).enumerate().find_map(at)
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

/// What makes the job another than that of a part, but for the program.
fn other<const NL: usize>(job: &Job<NL>, header: &PartHeader) -> Option<(&'static str, String)> {
    let mut ours = job.header(header.part);
    ours.campaign.version.clone_from(&header.campaign.version);
    ours.campaign.program.clone_from(&header.campaign.program);
    let found = ours.differs_from(header);
    found.map(|(field, reason)| (field, format!("the part's command makes {reason} here")))
}
