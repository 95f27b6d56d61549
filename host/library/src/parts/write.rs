//! The tables of a part, written from its journal a few thousand rows at a time.

use super::work::{Kept, Work};
use super::{FORMAT, NODES, NODES_FORMAT};
use crate::error::Error;
use crate::fingerprint::Fnv;
use crate::formats::{
    ABOUT_NODES, Cell, Column, Row, TableWriter, about, node_columns, node_row, write_as_it_comes,
};
use crate::journal::Journal;
use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// Rows of a row group.
const GROUP: usize = 4096;
/// Plans of a row group of nodes.
const GROUP_OF_NODES: usize = 128;

/// The table of nodes beside that of rows.
pub(super) fn nodes_file(table: &Path) -> PathBuf {
    let name = table.file_name().unwrap_or_default().to_string_lossy();
    table.with_file_name(format!("{NODES}{name}"))
}

/// Writes the rows at `places`, of which there is one at least.
pub(super) fn write_rows<W: Work>(
    work: &W,
    file: &Path,
    entries: Vec<(&'static str, String)>,
    journal: &Journal<W::Kept>,
    places: &[u64],
) -> Result<(), Error> {
    let read = |place: &u64| journal.read(*place).map(|kept| work.columns(&kept));
    let like = places.first().map(read).transpose()?.unwrap_or_default();
    let groups = places.chunks(GROUP).map(|group| group.iter().map(read).collect());
    write_table(file, &like, groups, entries)
}

/// Writes what stands at the nodes of the plans at `places`.
pub(super) fn write_nodes(
    file: &Path,
    joints: usize,
    said: impl Iterator<Item = (&'static str, String)>,
    journal: &Journal<Kept>,
    places: &[u64],
) -> Result<(), Error> {
    let names = node_columns(joints);
    let like = node_row("", 0, &[], &names);
    let groups = places.chunks(GROUP_OF_NODES).map(|group| {
        let mut rows = Vec::new();
        for place in group {
            let Kept { row: Row { scenario, .. }, nodes, .. } = journal.read(*place)?;
            for (node, numbers) in nodes.iter().enumerate() {
                let numbers: Vec<f64> =
                    numbers.iter().map(|number| number.unwrap_or(f64::NAN)).collect();
                rows.push(node_row(&scenario, node, &numbers, &names));
            }
        }
        Ok(rows)
    });
    let entries = [(FORMAT, NODES_FORMAT.to_string()), about(&ABOUT_NODES)];
    write_table(file, &like, groups, entries.into_iter().chain(said).collect())
}

/// Writes groups of rows with columns as in the row `like`.
fn write_table(
    file: &Path,
    like: &[Column],
    groups: impl Iterator<Item = Result<Vec<Vec<Column>>, Error>>,
    entries: Vec<(&'static str, String)>,
) -> Result<(), Error> {
    write_as_it_comes(file, |handle| {
        let mut writer =
            TableWriter::begin(handle, like, entries, true).map_err(io::Error::other)?;
        for group in groups {
            let group = group.map_err(io::Error::other)?;
            writer.write(&group).map_err(io::Error::other)?;
        }
        writer.end().map_err(io::Error::other)?;
        Ok(())
    })
}

/// Checksum of rows in their order.
#[derive(Default)]
pub struct Checksum {
    hash: Fnv,
    bytes: Vec<u8>,
}

impl Checksum {
    /// Adds a row.
    pub fn add(&mut self, row: &[Column]) {
        self.add_some(row, |_| true);
    }

    /// Adds the columns of a row that `is_meant` names.
    pub(super) fn add_some(&mut self, row: &[Column], is_meant: impl Fn(&str) -> bool) {
        let meant = row.iter().filter(|column| is_meant(&column.name));
        self.add_cells(meant.map(|column| &column.cell));
    }

    fn add_cells<'a>(&mut self, cells: impl IntoIterator<Item = &'a Cell>) {
        self.bytes.clear();
        cells.into_iter().for_each(|cell| cell.add_to(&mut self.bytes));
        self.hash.add(&self.bytes);
    }
}

impl Display for Checksum {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.hash.fmt(f)
    }
}
