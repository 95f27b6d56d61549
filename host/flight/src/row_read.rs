//! Rows of flights read again from their table.

use crate::flight::Ending;
use crate::judge::{Arrival, Room};
use crate::row::{FlightRow, Row};
use remora_host::formats::Cell;

/// Cells that are taken one by one.
struct Cells<'a>(std::slice::Iter<'a, Cell>);

impl Cells<'_> {
    fn number(&mut self) -> Option<f64> {
        match self.0.next()? {
            Cell::Number(x) => Some(*x),
            _ => None,
        }
    }

    /// A whole number that the table has as a double.
    fn count(&mut self) -> Option<u32> {
        let number = self.number()?;
        // Saturates; of what is no number, zero.
        let count = number as u32;
        (f64::from(count) == number).then_some(count)
    }

    fn text(&mut self) -> Option<&str> {
        match self.0.next()? {
            Cell::Text(text) => Some(text),
            _ => None,
        }
    }
}

impl Row {
    /// The row of some cells, which are in the order of [`Row::columns`]; none where they are no row.
    pub fn of_cells(cells: &[Cell]) -> Option<Self> {
        let mut cells = Cells(cells.iter());
        let Cell::Integer(run) = cells.0.next()? else { return None };
        let run = u64::try_from(*run).ok()?;
        let scenario = cells.text()?.to_string();
        let ending = cells.text()?;
        if ending == "no_plan" {
            let is_nothing = |cell: &Cell| match cell {
                Cell::Number(x) => x.is_nan(),
                Cell::Text(text) => text.is_empty(),
                _ => false,
            };
            return cells.0.all(is_nothing).then_some(Self { run, scenario, flown: None });
        }
        let ending = Ending::ALL.into_iter().find(|one| one.name() == ending)?;
        Some(Self { run, scenario, flown: Some(flown(ending, &mut cells)?) })
    }
}

fn flown(ending: Ending, cells: &mut Cells<'_>) -> Option<FlightRow> {
    let time_s = cells.number()?;
    let miss_m = cells.number()?;
    let miss_target_m = [cells.number()?, cells.number()?, cells.number()?];
    let (angle_rad, speed_m_s) = (cells.number()?, cells.number()?);
    let arrival = Arrival { miss_m, miss_target_m, angle_rad, speed_m_s };
    let room = Room {
        arm_m: cells.number()?,
        bus_m: cells.number()?,
        own_m: cells.number()?,
        keep_out_m: cells.number()?,
        view: cells.number()?,
        joint_rad: cells.number()?,
        joint_rate: cells.number()?,
        command: cells.number()?,
    };
    let violations = cells.text()?.split('+').filter(|name| !name.is_empty());
    let violations = violations.map(String::from).collect();
    let replans = [cells.count()?, cells.count()?];
    let tracking = [cells.number()?, cells.number()?];
    let impulse_n_s = cells.number()?;
    let mut drawn = Vec::new();
    while let Some(value) = cells.number() {
        drawn.push(value);
    }
    Some(FlightRow {
        ending,
        time_s,
        arrival,
        room,
        violations,
        replans,
        tracking,
        impulse_n_s,
        drawn,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::ErrorColumn;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        let flown = FlightRow {
            ending: Ending::Missed,
            time_s: 1200.0,
            arrival: Arrival {
                miss_m: 0.25,
                miss_target_m: [1.0, 2.0, 3.0],
                angle_rad: 4.0,
                speed_m_s: 5.0,
            },
            room: Room { view: 0.5, command: f64::INFINITY, ..Room::ALL },
            violations: vec!["arm".into(), "own".into()],
            replans: [3, 2],
            tracking: [0.1, 0.2],
            impulse_n_s: 7.0,
            drawn: vec![8.0, -0.0],
        };
        let drawn = ["a", "b"].map(|name| ErrorColumn { name: name.into(), unit: "m" });
        for row in [
            Row { run: 5, scenario: "s1-000".into(), flown: Some(flown.clone()) },
            Row {
                run: 6,
                scenario: "b".into(),
                flown: Some(FlightRow { violations: Vec::new(), ..flown }),
            },
            Row { run: 7, scenario: "c".into(), flown: None },
        ] {
            let cells: Vec<Cell> =
                row.columns(&drawn).into_iter().map(|column| column.cell).collect();
            assert_eq!(Row::of_cells(&cells), Some(row));
            assert_eq!(Row::of_cells(&cells[..2]), None);
        }
    }

    #[test]
    fn cells_of_no_flight_are_no_row() {
        let row = |flown| Row { run: 5, scenario: "a".into(), flown };
        let cells = |row: Row| -> Vec<Cell> {
            row.columns(&[]).into_iter().map(|column| column.cell).collect()
        };
        let mut none = cells(row(None));
        let replans = none.iter().rposition(|cell| matches!(cell, Cell::Text(_))).unwrap() + 1;
        none[replans] = Cell::Number(0.0);
        assert_eq!(Row::of_cells(&none), None);
        for count in [-1.0, 0.5, f64::NAN, 1e10] {
            let mut cells = cells(row(None));
            cells[2] = Cell::Text("missed".into());
            assert_eq!(Row::of_cells(&cells), None);
            cells[replans..].fill(Cell::Number(0.0));
            assert!(Row::of_cells(&cells).is_some());
            cells[replans] = Cell::Number(count);
            assert_eq!(Row::of_cells(&cells), None, "{count}");
        }
    }
}
