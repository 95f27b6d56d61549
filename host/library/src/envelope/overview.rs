//! A map in one table: success of each cell, and reasons for plans that are not optimal.

use super::page::figure;
use super::{Cell, Map};
use crate::report::{Align, Page, Table};
use std::collections::BTreeMap;

impl Map {
    /// The section: the table of successes, figures below.
    pub fn overview(&self) -> Page {
        let mut page = Page::new("envelope", "Envelope");
        let (plans, optimal) = self.totals();
        let count = |name: &str| self.cells.iter().filter(|c| c.state.name() == name).count();
        page.text(format!(
            "Of {} cells {} are planned, {} impossible, {} without a start, {} refused. Of {plans} plans \
             {optimal} are verified and optimal ({}, initial guess {}, seed {}).",
            self.cells.len(),
            count("planned"),
            count("impossible"),
            count("no start"),
            count("refused"),
            self.integrator,
            self.warm_start.name(),
            self.seed,
        ));
        page.text(
            "Share of verified optimal plans in per cent, by tumble rate and distance ahead of the port. The last \
             column counts the other plans by reason.",
        );
        page.table(self.successes());
        for vehicle in &self.vehicles {
            for horizon in &self.horizons_s {
                let rows = self.rows(&vehicle.name, *horizon);
                if rows.iter().flatten().all(|cell| cell.success().is_none()) {
                    continue;
                }
                if let Ok(svg) = self.heat(&vehicle.name, *horizon, &rows).svg() {
                    let caption = format!("{}, {horizon} s [%]", vehicle.name);
                    page.plot(&figure(&vehicle.name, *horizon), &caption, svg);
                }
            }
        }
        page
    }

    /// Success of each cell: a row a vehicle and horizon, a column a rate and distance.
    fn successes(&self) -> Table {
        let mut head = vec![("vehicle".to_string(), Align::Left)];
        for rate in &self.rates_deg_s {
            let distances = self.distances_m.iter();
            head.extend(distances.map(|d| (format!("{rate} deg/s, {d} m"), Align::Right)));
        }
        head.push(("not optimal".into(), Align::Left));
        let mut table = Table::with_columns(head);
        for vehicle in &self.vehicles {
            for horizon in &self.horizons_s {
                let cells: Vec<&Cell> =
                    self.rows(&vehicle.name, *horizon).into_iter().flatten().collect();
                let name = format!("{}, {horizon} s", vehicle.name);
                let shown = cells.iter().map(|cell| match cell.success() {
                    Some(success) => format!("{:.0}", 100.0 * success),
                    None => cell.state.name().into(),
                });
                table.push([name].into_iter().chain(shown).chain([reasons(&cells)]).collect());
            }
        }
        table
    }
}

/// Counts of plans that are not optimal, by reason.
fn reasons(cells: &[&Cell]) -> String {
    let mut counts = BTreeMap::new();
    let planned = cells.iter().filter(|cell| cell.success().is_some());
    for (reason, count) in planned.filter_map(|c| c.found.as_ref()).flat_map(|f| &f.reasons) {
        *counts.entry(reason).or_insert(0) += *count;
    }
    let texts = counts.into_iter().map(|(reason, count)| format!("{count} `{reason}`"));
    texts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::map::tests::map;

    #[test]
    fn the_overview_has_a_row_for_each_vehicle_and_horizon() {
        let page = map().overview();
        let text = page.markdown();
        for part in [
            "Of 8 cells 2 are planned, 4 impossible, 2 without a start, 0 refused. Of 8 plans 7 are",
            "optimal (rk4, initial guess heuristic, seed 1).",
            "| vehicle | 0 deg/s, 2 m | 0 deg/s, 5 m | 0.5 deg/s, 2 m | 0.5 deg/s, 5 m | not optimal |",
            "| default, 60 s | impossible | impossible | impossible | impossible |  |",
            "| default, 600 s | no start | 100 | no start | 75 | 1 `clearance` |",
            "(envelope-default-600.svg)",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert_eq!(page.plots().count(), 1);
    }
}
