//! Tables of Parquet files read again: their numbers by column.

use super::open_regular;
use crate::error::{Error, FieldError};
use parquet::column::reader::ColumnReader;
use bytes::Bytes;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use std::collections::BTreeMap;
use std::path::Path;

/// What a table holds in numbers; columns of text and flags are passed over.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    /// Rows by the name of their column.
    pub columns: BTreeMap<String, Vec<f64>>,
    /// What the file says of itself.
    pub entries: BTreeMap<String, String>,
}

impl Numbers {
    /// Reads a file.
    ///
    /// # Errors
    /// The file with the reason why it cannot be read.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let open = open_regular(file)?;
        numbers(open).map_err(|error| refused(error).at(file))
    }

    /// Reads what a file holds.
    ///
    /// # Errors
    /// The reason why it is no table.
    pub fn parse(bytes: Vec<u8>) -> Result<Self, FieldError> {
        numbers(Bytes::from(bytes)).map_err(refused)
    }

    /// A column of as many rows as the first.
    ///
    /// # Errors
    /// The column that is missing.
    pub fn column(&self, file: &Path, name: &str) -> Result<&[f64], Error> {
        let missing = || Error::input(file, name, "is missing: there is no such column of numbers");
        self.columns.get(name).map(Vec::as_slice).ok_or_else(missing)
    }
}

fn refused(error: ParquetError) -> FieldError {
    FieldError::new("", format!("is no table: {error}"))
}

fn numbers(file: impl ChunkReader + 'static) -> Result<Numbers, ParquetError> {
    let reader = SerializedFileReader::new(file)?;
    let metadata = reader.metadata().file_metadata();
    let mut found = Numbers::default();
    for entry in metadata.key_value_metadata().into_iter().flatten() {
        found.entries.insert(entry.key.clone(), entry.value.clone().unwrap_or_default());
    }
    let names: Vec<String> =
        metadata.schema_descr().columns().iter().map(|column| column.name().into()).collect();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        for (i, name) in names.iter().enumerate() {
            if let Some(values) = values(group.get_column_reader(i)?, rows)? {
                found.columns.entry(name.clone()).or_default().extend(values);
            }
        }
    }
    check_lengths(&found)?;
    Ok(found)
}

/// Columns are as long as each other, whatever a file says of its rows.
fn check_lengths(found: &Numbers) -> Result<(), ParquetError> {
    let rows = found.columns.values().map(Vec::len).max().unwrap_or(0);
    match found.columns.iter().find(|(_, values)| values.len() != rows) {
        Some((name, values)) => {
            Err(ParquetError::General(format!("{name} has {} rows of {rows}", values.len())))
        }
        None => Ok(()),
    }
}

/// The numbers of a column, if it holds any.
fn values(column: ColumnReader, rows: usize) -> Result<Option<Vec<f64>>, ParquetError> {
    Ok(match column {
        ColumnReader::DoubleColumnReader(mut reader) => {
            // A file may say that it has more rows than there is memory.
            let mut values = Vec::new();
            reader.read_records(rows, None, None, &mut values)?;
            Some(values)
        }
        ColumnReader::Int64ColumnReader(mut reader) => {
            let mut values = Vec::new();
            reader.read_records(rows, None, None, &mut values)?;
            Some(values.into_iter().map(|n| n as f64).collect())
        }
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Cell, Column, parquet_table};

    fn row(x: f64, n: i64) -> Vec<Column> {
        let column = |name: &str, cell| Column { name: name.into(), unit: "", cell };
        vec![
            column("x[0]", Cell::Number(x)),
            column("n", Cell::Integer(n)),
            column("word", Cell::Text("a".into())),
        ]
    }

    #[test]
    fn what_was_written_is_read_again_bit_by_bit() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.parquet");
        let table = [row(0.1, 1), row(f64::INFINITY, -2)];
        let entries = vec![("remora.format", "a/1".to_string())];
        std::fs::write(&file, parquet_table(&table, entries).unwrap()).unwrap();
        let found = Numbers::read(&file).unwrap();
        assert_eq!(found.column(&file, "x[0]").unwrap(), [0.1, f64::INFINITY]);
        assert_eq!(found.column(&file, "n").unwrap(), [1.0, -2.0]);
        assert_eq!(found.entries["remora.format"], "a/1");
        let error = found.column(&file, "word").unwrap_err().to_string();
        assert!(error.ends_with("word: is missing: there is no such column of numbers"), "{error}");
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.parquet");
        assert!(
            Numbers::read(&file).unwrap_err().to_string().ends_with("no such file or directory")
        );
        std::fs::write(&file, "{}").unwrap();
        assert!(Numbers::read(&file).unwrap_err().to_string().contains("is no table"));
    }
}
