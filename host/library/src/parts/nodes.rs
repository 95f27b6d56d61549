//! A part's table of nodes, read beside its rows.

use super::write::{Checksum, nodes_file};
use super::{CHECKSUM, FORMAT, KEY, NODES_FORMAT, PartHeader};
use crate::error::Error;
use crate::formats::{Cell, MAX_JOINTS, MOST_ROWS, Row, TableReader, node_columns, node_row};
use crate::part;
use std::iter::Peekable;
use std::path::{Path, PathBuf};
use std::vec::IntoIter;

/// More nodes than the plan of any build has.
const MOST_NODES: usize = 10_000;

/// The numbers of a plan, a row a node, time first.
pub(super) type Numbers = Vec<Vec<f64>>;

/// A table of nodes, handed out plan by plan. Memory: a row group.
pub(super) struct Nodes {
    file: PathBuf,
    table: TableReader,
    /// The group that is read next.
    group: usize,
    rows: Peekable<IntoIter<Vec<Cell>>>,
    checksum: Checksum,
}

impl Nodes {
    /// Opens the table beside that of the rows, and refuses one that is not the part's own.
    pub(super) fn open(rows: &Path, header: &PartHeader) -> Result<Self, Error> {
        let file = nodes_file(rows);
        let table = TableReader::open(&file)?;
        if table.entries.get(FORMAT).is_none_or(|format| format != NODES_FORMAT) {
            return Err(Error::input(&file, FORMAT, format!("is not {NODES_FORMAT}")));
        }
        let said: PartHeader = part::said(&file, &table, KEY)?;
        if let Some(reason) = said.mismatch(header) {
            return Err(Error::input(&file, "part", reason));
        }
        let is_of = |joints: usize| {
            let row = node_row("", 0, &[], &node_columns(joints));
            row.iter().map(|column| &column.name).eq(&table.names)
        };
        if !(1..=MAX_JOINTS).any(is_of) {
            return Err(Error::input(&file, "", "has other columns than a table of nodes"));
        }
        let (rows, checksum) = (Vec::new().into_iter().peekable(), Checksum::default());
        Ok(Self { file, table, group: 0, rows, checksum })
    }

    /// The nodes of the plan that a row is of, which are the table's next; none where the scenario was refused.
    pub(super) fn of(&mut self, row: &Row) -> Result<Numbers, Error> {
        let mut nodes = Numbers::new();
        if row.is_refused() {
            return Ok(nodes);
        }
        while let Some(cells) = self.next_of(&row.scenario, nodes.len())? {
            let numbers: Vec<f64> = cells[2..].iter().filter_map(number).collect();
            // Its time is a number whatever became of the plan.
            let certain = if row.is_verified() { numbers.len() } else { 1 };
            if numbers.len() + 2 != cells.len() || !numbers[..certain].iter().all(|x| x.is_finite())
            {
                let reason = format!("holds no number at node {} of it", nodes.len());
                return Err(Error::input(&self.file, &row.scenario, reason));
            }
            nodes.push(numbers);
        }
        match (2..=MOST_NODES).contains(&nodes.len()) {
            true => Ok(nodes),
            false => {
                let reason = format!("has {} nodes where its plan is next", nodes.len());
                Err(Error::input(&self.file, &row.scenario, reason))
            }
        }
    }

    /// The table's next row, where it is this node of this scenario.
    fn next_of(&mut self, scenario: &str, node: usize) -> Result<Option<Vec<Cell>>, Error> {
        while self.rows.peek().is_none() && self.group < self.table.groups() {
            let damaged = |error| Error::input(&self.file, "", format!("is damaged: {error}"));
            let rows = self.table.group(self.group, MOST_ROWS).map_err(damaged)?;
            rows.iter().for_each(|cells| self.checksum.add_cells(cells));
            self.rows = rows.into_iter().peekable();
            self.group += 1;
        }
        let is_next = |cells: &Vec<Cell>| match &cells[..] {
            [Cell::Text(id), Cell::Integer(at), ..] => {
                id == scenario && usize::try_from(*at) == Ok(node) && node < MOST_NODES
            }
            _ => false,
        };
        Ok(self.rows.next_if(is_next))
    }

    /// Refuses more rows than the part's plans have, and rows that are not as they were written.
    pub(super) fn end(mut self) -> Result<(), Error> {
        // No scenario has this id: it is the next one's row that is looked at.
        self.next_of("", 0)?;
        if let Some(Cell::Text(id)) = self.rows.peek().and_then(|cells| cells.first()) {
            return Err(Error::input(&self.file, id, "has nodes that are of no plan of the part"));
        }
        // Tables of nodes had none at first.
        match self.table.entries.contains_key(CHECKSUM) {
            true => self.checksum.check(&self.file, &self.table),
            false => Ok(()),
        }
    }
}

fn number(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(x) => Some(*x),
        _ => None,
    }
}
