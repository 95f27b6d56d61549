//! Tables of parts, read and forged.

use super::Bench;
use remora_host::fingerprint::Fnv;
use remora_host::formats::{Cell, Column, TIMES, TableReader, TableWriter};
use std::fs;

fn cells(bench: &Bench, file: &str) -> (TableReader, Vec<Vec<Cell>>) {
    let table = TableReader::open(&bench.path(file)).unwrap();
    let groups = 0..table.groups();
    let rows = groups.flat_map(|group| table.group(group, 1 << 16).unwrap()).collect();
    (table, rows)
}

/// What a table says of itself under a key.
pub fn entry(bench: &Bench, file: &str, key: &str) -> String {
    cells(bench, file).0.entries[key].clone()
}

/// Rows of all parts but for times, bit by bit, sorted.
pub fn rows(bench: &Bench, out: &str) -> Vec<Vec<u8>> {
    let names = bench.names(out).into_iter();
    let mut all: Vec<Vec<u8>> = Vec::new();
    for name in names.filter(|name| name.starts_with("part-") && name.ends_with(".parquet")) {
        let (table, rows) = cells(bench, &format!("{out}/{name}"));
        let is_kept: Vec<bool> =
            table.names.iter().map(|name| !TIMES.contains(&name.as_str())).collect();
        for row in rows {
            let mut bytes = Vec::new();
            let kept = row.iter().zip(&is_kept).filter(|(_, is_kept)| **is_kept);
            kept.for_each(|(cell, _)| cell.add_to(&mut bytes));
            all.push(bytes);
        }
    }
    all.sort();
    all
}

/// Whether a forger has thought of the checksum.
#[derive(PartialEq)]
pub enum Sum {
    Stale,
    Right,
    Missing,
}

/// Changes a column of a part's first row.
pub fn plant(bench: &Bench, file: &str, column: &str, sum: Sum) {
    change(bench, file, column, sum, |cell| match cell {
        Cell::Number(x) => Cell::Number(0.5 * x),
        Cell::Text(_) => Cell::Text("0123456789abcdef".into()),
        other => other.clone(),
    });
}

/// Puts a cell into a part's first row, and the checksum that it then has.
pub fn put(bench: &Bench, file: &str, column: &str, cell: Cell) {
    change(bench, file, column, Sum::Right, |_| cell);
}

fn change(bench: &Bench, file: &str, column: &str, sum: Sum, to: impl FnOnce(&Cell) -> Cell) {
    let (table, mut rows) = cells(bench, file);
    let at = table.names.iter().position(|name| name == column).unwrap();
    rows[0][at] = to(&rows[0][at]);
    let mut hash = Fnv::default();
    let named = |row: &Vec<Cell>| -> Vec<Column> {
        let pairs = row.iter().zip(&table.names);
        pairs
            .map(|(cell, name)| Column { name: name.clone(), unit: "", cell: cell.clone() })
            .collect()
    };
    for row in &rows {
        let mut bytes = Vec::new();
        row.iter().for_each(|cell| cell.add_to(&mut bytes));
        hash.add(&bytes);
    }
    let rows: Vec<Vec<Column>> = rows.iter().map(named).collect();
    let is_kept = |key: &str| match key {
        "remora.units" => false,
        "remora.checksum" => sum != Sum::Missing,
        _ => true,
    };
    let entries = table.entries.iter().filter(|(key, _)| is_kept(key)).map(|(key, value)| {
        let is_new = sum == Sum::Right && key == "remora.checksum";
        let value = if is_new { hash.to_string() } else { value.clone() };
        (&*key.clone().leak(), value)
    });
    let mut writer = TableWriter::begin(Vec::new(), &rows[0], entries.collect(), true).unwrap();
    writer.write(&rows).unwrap();
    fs::write(bench.path(file), writer.end(Vec::new()).unwrap()).unwrap();
}
