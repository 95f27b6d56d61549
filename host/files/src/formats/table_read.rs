//! Tables of Parquet files read again: their numbers by column, or all of it a row group at a time.

use super::thrift::{check_footer, page_header};
use super::{Cell, Kind, open_regular};
use crate::error::{Error, FieldError};
use bytes::Bytes;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{ColumnReader, get_column_reader};
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::metadata::{ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{
    ChunkReader, FileReader, Length, RowGroupReader, SerializedFileReader,
};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::sync::Once;

/// Most numbers of a table: half a gigabyte, a row a second of forty columns for two weeks.
const MOST_NUMBERS: u64 = 1 << 26;

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
        numbers(open).map_err(|error| Kind::Table.unless_other(file, refused(error).at(file)))
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

/// A table that is read a row group at a time, so that memory holds one of them.
pub struct TableReader {
    reader: SerializedFileReader<Checked<File>>,
    /// Names of the columns, in order.
    pub names: Vec<String>,
    /// What the file says of itself.
    pub entries: BTreeMap<String, String>,
}

impl TableReader {
    /// Opens a file; reads nothing but what it says of itself.
    ///
    /// # Errors
    /// The file with the reason why it cannot be read.
    pub fn open(file: &Path) -> Result<Self, Error> {
        let open = open_regular(file)?;
        let reader = guarded(|| Checked::open(open))
            .map_err(|error| Kind::Table.unless_other(file, refused(error).at(file)))?;
        let metadata = reader.metadata().file_metadata();
        let entries = entries(&reader);
        let columns = metadata.schema_descr().columns();
        let names = columns.iter().map(|column| column.name().into()).collect();
        Ok(Self { reader, names, entries })
    }

    /// Number of rows, as the file says.
    pub fn rows(&self) -> u64 {
        u64::try_from(self.reader.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// Number of row groups.
    pub fn groups(&self) -> usize {
        self.reader.num_row_groups()
    }

    /// The rows of a group of at most `most`.
    ///
    /// # Errors
    /// Why they cannot be read.
    pub fn group(&self, group: usize, most: usize) -> Result<Vec<Vec<Cell>>, ParquetError> {
        guarded(|| self.group_unguarded(group, most))
    }

    fn group_unguarded(&self, group: usize, most: usize) -> Result<Vec<Vec<Cell>>, ParquetError> {
        let group = self.reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
        if rows > most {
            return Err(ParquetError::General(format!("{rows} rows in a group, of {most}")));
        }
        let mut table: Vec<Vec<Cell>> =
            (0..rows).map(|_| Vec::with_capacity(self.names.len())).collect();
        for i in 0..self.names.len() {
            let cells = cells(column(&*group, i)?, rows)?;
            if cells.len() != rows {
                return Err(ParquetError::General(format!("{} rows of {rows}", cells.len())));
            }
            table.iter_mut().zip(cells).for_each(|(row, cell)| row.push(cell));
        }
        Ok(table)
    }
}

/// What a file says of itself.
fn entries(reader: &SerializedFileReader<impl ChunkReader + 'static>) -> BTreeMap<String, String> {
    let metadata = reader.metadata().file_metadata().key_value_metadata();
    let entries = metadata.into_iter().flatten();
    entries.map(|entry| (entry.key.clone(), entry.value.clone().unwrap_or_default())).collect()
}

/// The cells of a column.
fn cells(column: ColumnReader, rows: usize) -> Result<Vec<Cell>, ParquetError> {
    Ok(match column {
        ColumnReader::DoubleColumnReader(mut reader) => {
            let mut values = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut values)?;
            values.into_iter().map(Cell::Number).collect()
        }
        ColumnReader::Int64ColumnReader(mut reader) => {
            let mut values = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut values)?;
            values.into_iter().map(Cell::Integer).collect()
        }
        ColumnReader::BoolColumnReader(mut reader) => {
            let mut values = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut values)?;
            values.into_iter().map(Cell::Flag).collect()
        }
        ColumnReader::ByteArrayColumnReader(mut reader) => {
            let mut values = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut values)?;
            let text = |bytes: ByteArray| bytes.as_utf8().map(|text| Cell::Text(text.into()));
            values.into_iter().map(text).collect::<Result<_, _>>()?
        }
        _ => return Err(ParquetError::General("a column of another type".into())),
    })
}

fn refused(error: ParquetError) -> FieldError {
    let reason = match error {
        ParquetError::External(cause) => cause.to_string(),
        error => error.to_string(),
    };
    FieldError::new("", format!("is no table: {reason}"))
}

/// A file whose page headers the library reads only once they are looked at.
struct Checked<C>(C);

/// Bytes at a file's end: the length of what it says of itself, and the format's mark.
const TAIL: u64 = 8;

impl<C: ChunkReader + 'static> Checked<C> {
    /// Opens a file that says of itself what can be.
    fn open(file: C) -> Result<SerializedFileReader<Self>, ParquetError> {
        let size = file.len();
        // What is shorter than it says the library refuses.
        if let Some(end) = size.checked_sub(TAIL) {
            let tail = file.get_bytes(end, TAIL as usize)?;
            let length = tail.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
            if let Some(begin) = end.checked_sub(length.into()) {
                check_footer(&file.get_bytes(begin, length as usize)?)?;
            }
        }
        let reader = SerializedFileReader::new(Self(file))?;
        check_columns(reader.metadata(), size)?;
        Ok(reader)
    }
}

impl<C: ChunkReader> Length for Checked<C> {
    fn len(&self) -> u64 {
        self.0.len()
    }
}

impl<C: ChunkReader> ChunkReader for Checked<C> {
    type T = CheckedRead<C::T>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let read = self.0.get_read(start)?;
        // Columns end before the tail.
        Ok(match start.saturating_add(TAIL) < self.len() {
            true => CheckedRead::Before(read),
            false => CheckedRead::Tail(read),
        })
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        self.0.get_bytes(start, length)
    }
}

/// What the library reads byte by byte: a page's header, and of a file its tail.
enum CheckedRead<R> {
    /// Before a header, which may not be asked for.
    Before(R),
    /// In a header.
    Header(io::Cursor<Vec<u8>>),
    Tail(R),
}

impl<R: Read> Read for CheckedRead<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if let Self::Before(read) = self {
            *self = Self::Header(io::Cursor::new(page_header(read)?));
        }
        match self {
            Self::Before(read) | Self::Tail(read) => read.read(buffer),
            Self::Header(header) => header.read(buffer),
        }
    }
}

/// A column of a row group.
fn column(group: &dyn RowGroupReader, i: usize) -> Result<ColumnReader, ParquetError> {
    let pages = Box::new(SoundPages(group.get_column_page_reader(i)?));
    Ok(get_column_reader(group.metadata().schema_descr().column(i), pages))
}

/// Pages whose dictionaries have no more values than bytes: the reader of columns sets aside memory for as many as a
/// page says.
struct SoundPages(Box<dyn PageReader>);

impl Iterator for SoundPages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for SoundPages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.0.get_next_page()?;
        match &page {
            Some(Page::DictionaryPage { buf, num_values, .. })
                if usize::try_from(*num_values).map_or(true, |count| count > buf.len()) =>
            {
                Err(ParquetError::General("a dictionary has more values than bytes".into()))
            }
            _ => Ok(page),
        }
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.0.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.0.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool, ParquetError> {
        self.0.at_record_boundary()
    }
}

thread_local! {
    /// Whether this thread is reading pages: a panic then is a refusal in the making.
    static IS_READING: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// The reader of pages takes a file's word for much: what it panics on instead of refusing it becomes a refusal here,
/// and nothing is printed of it.
fn guarded<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !IS_READING.get() {
                usual(panic);
            }
        }));
    });
    IS_READING.set(true);
    let read = std::panic::catch_unwind(AssertUnwindSafe(read));
    IS_READING.set(false);
    read.unwrap_or_else(|_| Err(ParquetError::General("it is damaged".into())))
}

fn numbers(file: impl ChunkReader + 'static) -> Result<Numbers, ParquetError> {
    guarded(|| unguarded(file))
}

fn unguarded(file: impl ChunkReader + 'static) -> Result<Numbers, ParquetError> {
    let reader = Checked::open(file)?;
    if numbers_promised(reader.metadata()) > MOST_NUMBERS {
        return Err(ParquetError::General("more numbers than there is memory for".into()));
    }
    let metadata = reader.metadata().file_metadata();
    let mut found = Numbers { entries: entries(&reader), ..Numbers::default() };
    let names: Vec<String> =
        metadata.schema_descr().columns().iter().map(|column| column.name().into()).collect();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        for (i, name) in names.iter().enumerate() {
            if let Some(values) = values(column(&*group, i)?, rows)? {
                found.columns.entry(name.clone()).or_default().extend(values);
            }
        }
    }
    check_lengths(&found)?;
    Ok(found)
}

/// Refuses columns that are not within the file, before its tail.
fn check_columns(metadata: &ParquetMetaData, size: u64) -> Result<(), ParquetError> {
    let wrong = |reason: &str| Err(ParquetError::General(reason.into()));
    for group in metadata.row_groups() {
        if group.num_rows() < 0 {
            return wrong("a negative number of rows");
        }
        for column in group.columns() {
            let begin = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
            let end = begin.checked_add(column.compressed_size()).map(u64::try_from);
            if begin < 0
                || column.compressed_size() < 0
                || !matches!(end, Some(Ok(end)) if end <= size.saturating_sub(TAIL))
            {
                return wrong("a column is not within the file");
            }
        }
    }
    Ok(())
}

/// How many numbers a file says that it has.
fn numbers_promised(metadata: &ParquetMetaData) -> u64 {
    let of_group = |group: &RowGroupMetaData| {
        let rows = u64::try_from(group.num_rows()).unwrap_or(0);
        rows.saturating_mul(group.num_columns() as u64)
    };
    metadata.row_groups().iter().map(of_group).fold(0, u64::saturating_add)
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
    use crate::formats::{Cell, Column, TableWriter, parquet_table};

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

    /// Nothing in a table says of its rows what they themselves say.
    #[test]
    fn a_table_has_no_statistics() {
        let table: Vec<_> = (0..300).map(|i| row(0.5, i)).collect();
        for is_compressed in [false, true] {
            let mut writer =
                TableWriter::begin(Vec::new(), &table[0], Vec::new(), is_compressed).unwrap();
            writer.write(&table).unwrap();
            let bytes = Bytes::from(writer.end(Vec::new()).unwrap());
            let reader = SerializedFileReader::new(bytes).unwrap();
            let columns = reader.metadata().row_groups().iter().flat_map(|group| group.columns());
            for column in columns {
                assert_eq!(column.statistics(), None);
                assert_eq!(column.column_index_offset(), None);
                assert_eq!(column.offset_index_offset(), None);
                assert_eq!(column.bloom_filter_offset(), None);
            }
        }
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

    /// Lists in pages' headers that are longer than the file, or of flags that take no room: each kept the library busy
    /// for longer than the fuzzer waits. The third had a dictionary without end.
    // Verifies REM-IO-006.
    #[test]
    fn what_the_fuzzer_found_is_refused() {
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ci/fuzz/corpus/table");
        for name in ["timeout-3a771c67cd", "timeout-c1de69e406", "oom-4b92d49b63"] {
            let error = Numbers::read(&corpus.join(name)).unwrap_err().to_string();
            assert!(error.contains("is no table"), "{error}");
            assert!(error.ends_with("which the format has not"), "{error}");
        }
    }

    /// A list of flags in the header of the first page, whose footer is sound.
    // Verifies REM-IO-006.
    #[test]
    fn a_page_with_a_list_of_flags_is_refused() {
        let mut bytes = parquet_table(&[row(0.5, 1)], Vec::new()).unwrap();
        bytes[4..11].copy_from_slice(&[0x99, 0xf1, 0xff, 0xff, 0xff, 0xff, 0x07]);
        let error = Numbers::parse(bytes).unwrap_err().reason;
        assert!(error.ends_with("a field 9 of type 9, which the format has not"), "{error}");
    }

    /// A dictionary that promises more values than it has bytes.
    // Verifies REM-IO-006.
    #[test]
    fn a_dictionary_of_more_values_than_bytes_is_refused() {
        let mut bytes = parquet_table(&[row(0.5, 1)], Vec::new()).unwrap();
        // A dictionary of eight bytes and one value: it shall have 63.
        let head = [0x15, 0x04, 0x15, 0x10, 0x15, 0x10, 0x4c, 0x15, 0x02];
        assert_eq!(bytes[4..13], head);
        bytes[12] = 0x7e;
        let error = Numbers::parse(bytes).unwrap_err().reason;
        assert!(error.ends_with("a dictionary has more values than bytes"), "{error}");
    }

    /// A page that goes by a dictionary where there is none: the library panics.
    // Verifies REM-IO-006.
    #[test]
    fn a_panic_of_the_library_is_a_refusal() {
        let mut bytes = parquet_table(&[row(0.5, 1)], Vec::new()).unwrap();
        // The dictionary's header says that it is an index, which readers pass over.
        assert_eq!(bytes[4..6], [0x15, 0x04]);
        bytes[5] = 0x02;
        let error = Numbers::parse(bytes).unwrap_err().reason;
        assert!(error.ends_with("it is damaged"), "{error}");
    }

    /// Wherever a byte is another: numbers, as many in each column, or a refusal.
    // Verifies REM-IO-006.
    #[test]
    fn damage_is_answered() {
        let rows: Vec<_> = (0..3).map(|i| row(0.5, i)).collect();
        let whole = parquet_table(&rows, vec![("remora.format", "a/1".to_string())]).unwrap();
        for at in 0..whole.len() {
            for with in [0x00, 0x01, 0x7f, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] = with;
                if let Ok(table) = Numbers::parse(bytes) {
                    let lengths: Vec<usize> = table.columns.values().map(Vec::len).collect();
                    assert!(lengths.windows(2).all(|pair| pair[0] == pair[1]), "{at} {with}");
                }
            }
        }
    }
}
