//! The files of a map.

use super::page::figure;
use super::{Envelope, Map};
use crate::error::Error;
use crate::formats::{json, write_atomically};
use std::path::{Path, PathBuf};

/// Names of the files beside figures.
const JSON: &str = "envelope.json";
const CSV: &str = "envelope.csv";
const PAGE: &str = "envelope.md";

/// The files that a map may write in `out`.
pub fn files(out: &Path, envelope: &Envelope) -> Vec<PathBuf> {
    let mut names = [JSON, CSV, PAGE].map(String::from).to_vec();
    for vehicle in &envelope.vehicles {
        let horizons = envelope.grid.horizons.iter();
        names.extend(horizons.map(|h| format!("{}.svg", figure(&vehicle.name, h.value()))));
    }
    names.into_iter().map(|name| out.join(name)).collect()
}

impl Map {
    /// Writes numbers, page and figures.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, out: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut files = Vec::new();
        let mut write = |name: &str, text: &str| {
            files.push(out.join(name));
            write_atomically(&out.join(name), text.as_bytes())
        };
        let failed = |name: &str, reason: String| Error::Output { file: out.join(name), reason };
        write(JSON, &json::to_text(self).map_err(|error| failed(JSON, error.to_string()))?)?;
        write(CSV, &self.csv().map_err(|error| failed(CSV, error.to_string()))?)?;
        let page = self.page();
        write(PAGE, &page.markdown())?;
        page.plots().try_for_each(|(name, svg)| write(&format!("{name}.svg"), svg))?;
        Ok(files)
    }

    /// A row a cell; missing values are empty.
    ///
    /// # Errors
    /// An error of the CSV writer; writing to memory makes none.
    pub fn csv(&self) -> Result<String, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(COLUMNS)?;
        for cell in &self.cells {
            let (place, found) = (&cell.place, cell.found.as_ref());
            let count = |of: fn(&super::Found) -> usize| {
                found.map(|found| of(found).to_string()).unwrap_or_default()
            };
            let number = |of: fn(&super::Found) -> Option<f64>| {
                found.and_then(of).map(|x| format!("{x:?}")).unwrap_or_default()
            };
            let reasons = found.map(|found| {
                let each = found.reasons.iter().map(|(reason, count)| format!("{reason}: {count}"));
                each.collect::<Vec<_>>().join("; ")
            });
            writer.write_record([
                place.vehicle.clone(),
                place.horizon_s.to_string(),
                place.rate_deg_s.to_string(),
                place.distance_m.to_string(),
                cell.state.name().replace(' ', "_"),
                count(|found| found.scenarios),
                count(|found| found.optimal),
                count(|found| found.verified),
                count(|found| found.out_of_reach),
                cell.success().map(|success| format!("{success:?}")).unwrap_or_default(),
                number(|found| found.iterations),
                number(|found| found.time_s),
                number(|found| found.cost),
                number(|found| found.clearance_m),
                found.and_then(super::Found::worst_reason).unwrap_or_default().into(),
                reasons.unwrap_or_default(),
                cell.state.why().into(),
            ])?;
        }
        let bytes = writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}

/// Columns of the table.
const COLUMNS: [&str; 17] = [
    "vehicle",
    "horizon_s",
    "rate_deg_s",
    "distance_m",
    "state",
    "scenarios",
    "optimal",
    "verified",
    "out_of_reach",
    "success",
    "iterations",
    "time_s",
    "cost",
    "clearance_m",
    "worst_reason",
    "reasons",
    "why",
];

#[cfg(test)]
mod tests {
    use super::super::map::tests::map;

    #[test]
    fn a_cell_is_a_row() {
        let text = map().csv().unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 9);
        assert!(lines[0].starts_with("vehicle,horizon_s,rate_deg_s,distance_m,state,scenarios,"));
        assert_eq!(lines[1], "default,60,0,2,impossible,,,,,,,,,,,,\"joint 2, too slow\"");
        assert_eq!(lines[5], "default,600,0,2,no_start,,,,,,,,,,,,");
        let expected =
            "default,600,0.5,5,planned,4,3,0,0,0.75,9.0,0.25,0.18,0.125,clearance,clearance: 1,";
        assert_eq!(lines[8], expected);
    }
}
