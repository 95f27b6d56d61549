//! Rows of a campaign read again from their table.

use super::table_read::TableReader;
use super::{Cell, Clearances, Closest, Flight, Nearest, Row, StageRow, Status, Verdict, columns};
use crate::error::{Error, FieldError};
use crate::method::Method;
use std::path::Path;

/// Most rows of a row group that are taken into memory at once.
pub const MOST_ROWS: usize = 1 << 16;

/// Calls `each` for the rows of a table in their order, with a row group in memory at a time.
///
/// # Errors
/// A table that is damaged or of other columns; what `each` says of a row.
pub fn read_rows(
    file: &Path,
    table: &TableReader,
    method: &Method,
    mut each: impl FnMut(Row) -> Result<(), Error>,
) -> Result<(), Error> {
    let damaged = |reason: String| Error::input(file, "", format!("is damaged: {reason}"));
    for group in 0..table.groups() {
        let rows = table.group(group, MOST_ROWS).map_err(|error| damaged(error.to_string()))?;
        for cells in rows {
            let row = row(&cells).map_err(|error| error.at(file))?;
            let expected = columns(&row, method);
            if !expected.iter().map(|column| &column.name).eq(&table.names) {
                return Err(Error::input(file, "", "has other columns than a table of a campaign"));
            }
            // What stands twice in a row is the same.
            let differs = expected.iter().zip(&cells).find(|(column, cell)| column.cell != **cell);
            match differs.filter(|(column, cell)| !both_nan(&column.cell, cell)) {
                Some((column, _)) => {
                    let reason = format!("contradicts the rest of {}", row.scenario);
                    return Err(Error::input(file, &column.name, reason));
                }
                None => each(row)?,
            }
        }
    }
    Ok(())
}

fn both_nan(one: &Cell, other: &Cell) -> bool {
    matches!((one, other), (Cell::Number(a), Cell::Number(b)) if a.is_nan() && b.is_nan())
}

/// Cells that are taken one by one.
struct Cells<'a>(std::slice::Iter<'a, Cell>);

fn wrong() -> FieldError {
    FieldError::new("", "has other columns than a table of a campaign")
}

impl Cells<'_> {
    fn text(&mut self) -> Result<String, FieldError> {
        let Some(Cell::Text(text)) = self.0.next() else { return Err(wrong()) };
        Ok(text.clone())
    }

    fn count(&mut self) -> Result<u64, FieldError> {
        let Some(Cell::Integer(n)) = self.0.next() else { return Err(wrong()) };
        u64::try_from(*n).map_err(|_| wrong())
    }

    fn number(&mut self) -> Result<f64, FieldError> {
        let Some(Cell::Number(x)) = self.0.next() else { return Err(wrong()) };
        Ok(*x)
    }

    fn stage(&mut self) -> Result<StageRow, FieldError> {
        let (iterations, cost, time_s) = (self.count()?, self.number()?, self.number()?);
        Ok(StageRow { iterations, corrections: 0, cost, time_s })
    }

    fn closest(&mut self, of: Closest) -> Result<Closest, FieldError> {
        Ok(Closest { distance: self.number()?, time_s: self.number()?, ..of })
    }

    fn flight(&mut self) -> Result<Flight, FieldError> {
        Ok(Flight {
            target_rate_rad_s: self.number()?,
            start_distance_m: self.number()?,
            peak_force_n: self.number()?,
            peak_bus_torque_n_m: self.number()?,
            peak_joint_torque_n_m: self.number()?,
            delta_v_m_s: self.number()?,
        })
    }
}

/// A word that is one of several.
fn word<T: Copy>(
    text: String,
    field: &str,
    all: &[T],
    name: impl Fn(T) -> &'static str,
) -> Result<T, FieldError> {
    let found = all.iter().find(|one| name(**one) == text);
    found.copied().ok_or_else(|| FieldError::new(field, format!("{text:?} is unknown")))
}

/// The row of some cells, which are in the order of [`columns`]. Which body was nearest is not in them.
fn row(cells: &[Cell]) -> Result<Row, FieldError> {
    let cells = &mut Cells(cells.iter());
    let scenario = cells.text()?;
    let status = word(cells.text()?, "status", &Status::ALL, Status::name)?;
    let (mut stage1, mut stage2) = (cells.stage()?, cells.stage()?);
    let inference_s = cells.number()?;
    let mut residuals = [0.0; super::Residuals::COUNT];
    for residual in &mut residuals {
        *residual = cells.number()?;
    }
    let verdict = word(cells.text()?, "verdict", &Verdict::ALL, Verdict::name)?;
    let reason = cells.text()?;
    let mut clearances = Clearances::NONE;
    for of in [&mut clearances.arm, &mut clearances.bus, &mut clearances.own] {
        *of = cells.closest(*of)?;
    }
    cells.text()?; // mode
    let warm_start = cells.text()?;
    // Solver, integrator and whether it is verified.
    cells.0.by_ref().take(3).for_each(drop);
    let flight = cells.flight()?;
    let mut nearest = Nearest::NONE;
    nearest.at.distance = cells.number()?;
    let (time_s, cpu_time_s) = (cells.number()?, cells.number()?);
    (stage1.corrections, stage2.corrections) = (cells.count()?, cells.count()?);
    let plan_checksum = cells.text()?;
    nearest.pair = cells.text()?;
    nearest.at.time_s = cells.number()?;
    let end_effector = cells.closest(Closest::NONE)?;
    Ok(Row {
        scenario,
        status,
        verdict,
        reason,
        warm_start,
        stage1,
        stage2,
        inference_s,
        residuals,
        clearances,
        nearest,
        end_effector,
        flight,
        time_s,
        cpu_time_s,
        plan_checksum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::results::tests::{origin, rows};
    use crate::formats::{TableWriter, parquet_bytes};

    fn read(file: &Path, method: &Method) -> Result<Vec<Row>, Error> {
        let mut read = Vec::new();
        read_rows(file, &TableReader::open(file)?, method, |row| {
            read.push(row);
            Ok(())
        })?;
        Ok(read)
    }

    #[test]
    fn rows_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.parquet");
        let method = Method::default();
        std::fs::write(&file, parquet_bytes(&rows(), &origin()).unwrap()).unwrap();
        let plain = read(&file, &method).unwrap();
        // In groups and compressed.
        let table: Vec<_> = rows().iter().map(|row| columns(row, &method)).collect();
        let mut writer = TableWriter::begin(Vec::new(), &table[0], Vec::new(), true).unwrap();
        writer.write(&table[..2]).unwrap();
        writer.write(&table[2..]).unwrap();
        std::fs::write(&file, writer.end(vec![("remora.a", "b".into())]).unwrap()).unwrap();
        let grouped = read(&file, &method).unwrap();
        assert_eq!(TableReader::open(&file).unwrap().entries["remora.a"], "b");
        for found in [plain, grouped] {
            assert_eq!(found.len(), 3);
            for (row, written) in found.iter().zip(&rows()) {
                let bytes = |row: &Row| {
                    let mut bytes = Vec::new();
                    columns(row, &method).iter().for_each(|column| column.cell.add_to(&mut bytes));
                    bytes
                };
                assert_eq!(bytes(row), bytes(written));
                assert_eq!(row.stage2.corrections, written.stage2.corrections);
            }
        }
    }

    #[test]
    fn what_is_no_row_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.parquet");
        let method = Method::default();
        let refused = |change: &dyn Fn(&mut Vec<super::super::Column>)| {
            let mut row = columns(&rows()[0], &method);
            change(&mut row);
            std::fs::write(&file, super::super::parquet_table(&[row], Vec::new()).unwrap())
                .unwrap();
            read(&file, &method).unwrap_err().to_string()
        };
        assert!(refused(&|row| row[1].cell = Cell::Text("fine".into())).contains("status: "));
        assert!(refused(&|row| row.truncate(9)).contains("has other columns"));
        assert!(refused(&|row| row[0].name = "id".into()).contains("has other columns"));
        let flag = refused(&|row| row[33].cell = Cell::Flag(false));
        assert!(flag.ends_with("verified: contradicts the rest of a"), "{flag}");
    }
}
