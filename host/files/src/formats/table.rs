//! Tables as Parquet files, with units and origin beside the rows.

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use serde_json::{Map, Value, json};
use std::io::Write;
use std::sync::Arc;

/// A cell of the table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A whole number.
    Integer(i64),
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
}

impl Cell {
    fn physical(&self) -> Physical {
        match self {
            Self::Text(_) => Physical::BYTE_ARRAY,
            Self::Integer(_) => Physical::INT64,
            Self::Number(_) => Physical::DOUBLE,
            Self::Flag(_) => Physical::BOOLEAN,
        }
    }

    /// Adds its bytes to those of others, so that no two rows have the same.
    pub fn add_to(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Text(text) => {
                bytes.extend((text.len() as u64).to_le_bytes());
                bytes.extend(text.as_bytes());
            }
            Self::Integer(n) => bytes.extend(n.to_le_bytes()),
            Self::Number(x) => bytes.extend(x.to_bits().to_le_bytes()),
            Self::Flag(is) => bytes.push(u8::from(*is)),
        }
    }

    /// The type's name in metadata of tables on the web.
    pub(super) fn datatype(&self) -> &'static str {
        match self {
            Self::Text(_) => "string",
            Self::Integer(_) => "integer",
            Self::Number(_) => "double",
            Self::Flag(_) => "boolean",
        }
    }
}

/// A cell with name and unit of its column; the unit is empty where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name of the column.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Value of the column in the row.
    pub cell: Cell,
}

/// A Parquet file that is written a row group at a time, so that memory holds one of them.
pub struct TableWriter<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> TableWriter<W> {
    /// A table of columns as in the row `like`, compressed (Snappy, where it is built in) or not, with units and `entries` in its
    /// metadata: strings, 64-bit integers, doubles and booleans. It has no statistics: readers that pass over row
    /// groups by them would believe a damaged one, which no checksum of the rows finds.
    ///
    /// # Errors
    /// Where the sink cannot be written.
    pub fn begin(
        sink: W,
        like: &[Column],
        entries: Vec<(&'static str, String)>,
        is_compressed: bool,
    ) -> Result<Self, ParquetError> {
        let with_units = like.iter().filter(|column| !column.unit.is_empty());
        let units: Map<String, Value> =
            with_units.map(|column| (column.name.clone(), column.unit.into())).collect();
        let entries = entries.into_iter().chain([("remora.units", json!(units).to_string())]);
        let metadata = entries.map(|(key, value)| KeyValue::new(key.to_string(), value)).collect();
        let compression = match is_compressed && cfg!(feature = "snappy") {
            true => Compression::SNAPPY,
            false => Compression::UNCOMPRESSED,
        };
        let properties = WriterProperties::builder()
            .set_key_value_metadata(Some(metadata))
            .set_compression(compression)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_offset_index_disabled(true)
            .build();
        SerializedFileWriter::new(sink, schema(like)?, Arc::new(properties)).map(Self)
    }

    /// Writes rows as a group.
    ///
    /// # Errors
    /// Where the sink cannot be written.
    pub fn write(&mut self, rows: &[Vec<Column>]) -> Result<(), ParquetError> {
        let Some(first) = rows.first() else { return Ok(()) };
        let mut group = self.0.next_row_group()?;
        for j in 0..first.len() {
            write_column(&mut group, rows.iter().map(|row| &row[j].cell))?;
        }
        group.close().map(drop)
    }

    /// Ends the file; the sink.
    ///
    /// # Errors
    /// Where the sink cannot be written.
    pub fn end(self) -> Result<W, ParquetError> {
        self.0.into_inner()
    }
}

/// A table as a Parquet file: uncompressed, one row group ([`TableWriter`]).
///
/// # Errors
/// Where there is no row, or too much of them for memory.
pub fn parquet(
    table: &[Vec<Column>],
    entries: Vec<(&'static str, String)>,
) -> Result<Vec<u8>, ParquetError> {
    let first = table.first().ok_or_else(|| ParquetError::General("no rows".into()))?;
    let mut writer = TableWriter::begin(Vec::new(), first, entries, false)?;
    writer.write(table)?;
    writer.end()
}

fn schema(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let column = |Column { name, cell, .. }: &Column| {
        let string = matches!(cell, Cell::Text(_)).then_some(LogicalType::String);
        let column = Type::primitive_type_builder(name, cell.physical())
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(string)
            .build()?;
        Ok(Arc::new(column))
    };
    let fields = columns.iter().map(column).collect::<Result<Vec<_>, ParquetError>>()?;
    Ok(Arc::new(Type::group_type_builder("results").with_fields(fields).build()?))
}

/// Writes the next column of a row group.
fn write_column<'a, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    cells: impl Iterator<Item = &'a Cell>,
) -> Result<(), ParquetError> {
    let (mut texts, mut integers, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
    let mut flags = Vec::new();
    for cell in cells {
        match cell {
            Cell::Text(text) => texts.push(ByteArray::from(text.as_str())),
            Cell::Integer(n) => integers.push(*n),
            Cell::Number(x) => numbers.push(*x),
            Cell::Flag(is) => flags.push(*is),
        }
    }
    let missing = || ParquetError::General("fewer columns than the schema has".into());
    let mut column = group.next_column()?.ok_or_else(missing)?;
    if !texts.is_empty() {
        column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
    } else if !integers.is_empty() {
        column.typed::<Int64Type>().write_batch(&integers, None, None)?;
    } else if !flags.is_empty() {
        column.typed::<BoolType>().write_batch(&flags, None, None)?;
    } else {
        column.typed::<DoubleType>().write_batch(&numbers, None, None)?;
    }
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};

    fn row(x: f64, n: i64) -> Vec<Column> {
        let column = |name: &str, cell| Column { name: name.into(), unit: "", cell };
        vec![
            column("x[0]", Cell::Number(x)),
            column("n", Cell::Integer(n)),
            column("word", Cell::Text("a".into())),
        ]
    }

    /// A table has no statistics of its rows, and its groups hold all of them.
    #[test]
    fn a_table_has_no_statistics() {
        let table: Vec<_> = (0..300).map(|i| row(0.5, i)).collect();
        for is_compressed in [false, true] {
            let mut file = tempfile::tempfile().unwrap();
            let sink = file.try_clone().unwrap();
            let mut writer =
                TableWriter::begin(sink, &table[0], Vec::new(), is_compressed).unwrap();
            writer.write(&table[..200]).unwrap();
            writer.write(&table[200..]).unwrap();
            writer.end().unwrap();
            std::io::Seek::rewind(&mut file).unwrap();
            let reader = SerializedFileReader::new(file).unwrap();
            let columns = reader.metadata().row_groups().iter().flat_map(|group| group.columns());
            for column in columns {
                assert_eq!(column.statistics(), None);
                assert_eq!(column.column_index_offset(), None);
                assert_eq!(column.offset_index_offset(), None);
                assert_eq!(column.bloom_filter_offset(), None);
            }
            let read: Vec<i64> = reader
                .get_row_iter(None)
                .unwrap()
                .map(|row| match row.unwrap().get_column_iter().nth(1) {
                    Some((_, parquet::record::Field::Long(n))) => *n,
                    other => panic!("{other:?}"),
                })
                .collect();
            assert_eq!(read, (0..300).collect::<Vec<_>>());
        }
    }
}
