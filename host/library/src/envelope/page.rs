//! The page of a map: for each vehicle and horizon a table and a figure, and what fails.

use super::{Cell, Found, Map, VehicleRecord};
use crate::report::plot::Heat;
use crate::report::{Align, Page, Table, number, time};
use std::collections::BTreeMap;

impl Map {
    /// The page, with the vehicles and their provenance.
    pub fn page(&self) -> Page {
        let mut page = self.body();
        page.heading("Vehicles").table(vehicles(&self.vehicles));
        page.text(
            "A shorter horizon needs more force and torque, with the square of its shortness: what a \
             strong vehicle does in a minute a weak one cannot do at all.",
        );
        page.heading("Measured by").table(self.provenance.table()).command(&self.command);
        page
    }

    /// The page without the vehicles and what it was measured by.
    fn body(&self) -> Page {
        let mut page = Page::new("envelope", "Where the planner works");
        page.text(
            "Made by `remora campaign envelope`; not to be edited. What a cell is and how to read the map: \
             `docs/guides/campaigns.md`.",
        );
        let (plans, optimal) = self.totals();
        let count = |name: &str| self.cells.iter().filter(|c| c.state.name() == name).count();
        page.text(format!(
            "{} cells of {} scenarios: {} planned, {} impossible, {} without a start, {} refused. \
             Of {plans} plans {optimal} are verified and optimal. {}, start {}, seed {}.",
            self.cells.len(),
            self.count,
            count("planned"),
            count("impossible"),
            count("no start"),
            count("refused"),
            self.integrator,
            self.warm_start.name(),
            self.seed,
        ));
        page.text(
            "Cells: **success** with its 95 % interval (Clopper and Pearson); median iterations of \
             Stage 2; median time; median cost; smallest clearance.",
        );
        for vehicle in &self.vehicles {
            self.add_vehicle(vehicle, &mut page);
        }
        page
    }

    fn add_vehicle(&self, vehicle: &VehicleRecord, page: &mut Page) {
        let name = &vehicle.name;
        page.heading(format!("Vehicle {name}"));
        for horizon in &self.horizons_s {
            let rows = self.rows(name, *horizon);
            if let Some(why) = common_reason(&rows) {
                page.text(format!("**{horizon} s**: {why}."));
                continue;
            }
            page.text(format!("**{horizon} s**")).table(self.grid(&rows));
            if let Ok(svg) = self.heat(name, *horizon, &rows).svg() {
                let caption = format!("Success of {name} in {horizon} s [%]");
                page.plot(&figure(name, *horizon), &caption, svg);
            }
        }
        page.text(format!("What fails with {name}, and why: plans by horizon."));
        page.table(self.failures(name));
    }

    /// A row a rate, a column a distance.
    fn grid(&self, rows: &[Vec<&Cell>]) -> Table {
        let distances =
            self.distances_m.iter().map(|distance| (format!("{distance} m"), Align::Right));
        let head = [("tumble".to_string(), Align::Left)].into_iter().chain(distances);
        let mut table = Table::with_columns(head.collect());
        for (rate, cells) in self.rates_deg_s.iter().zip(rows) {
            let name = format!("{rate} deg/s");
            table.push([name].into_iter().chain(cells.iter().map(|cell| shown(cell))).collect());
        }
        table
    }

    /// Shares of optimal plans of a vehicle in a horizon.
    pub(super) fn heat(&self, vehicle: &str, horizon_s: f64, rows: &[Vec<&Cell>]) -> Heat {
        let names = |axis: &[f64]| axis.iter().map(f64::to_string).collect();
        Heat {
            title: format!("{vehicle}, {horizon_s} s: verified optimal plans [%]"),
            x_label: "distance ahead of the port [m]".into(),
            y_label: "tumble [deg/s]".into(),
            x: names(&self.distances_m),
            y: names(&self.rates_deg_s),
            shares: rows
                .iter()
                .map(|row| row.iter().map(|cell| cell.interval()).collect())
                .collect(),
            footer: self.made_by(),
        }
    }

    /// A row a reason, a column a horizon.
    fn failures(&self, vehicle: &str) -> Table {
        let found = |horizon: f64| -> Vec<&Found> {
            let cells = self.rows(vehicle, horizon).into_iter().flatten();
            cells.filter(|cell| cell.success().is_some()).filter_map(|c| c.found.as_ref()).collect()
        };
        let columns: Vec<Vec<&Found>> = self.horizons_s.iter().map(|h| found(*h)).collect();
        let horizons = self.horizons_s.iter().map(|horizon| (format!("{horizon} s"), Align::Right));
        let head = [(String::new(), Align::Left)].into_iter().chain(horizons);
        let mut table = Table::with_columns(head.collect());
        let mut add = |name: String, count: &dyn Fn(&Found) -> usize| {
            let sums = columns.iter().map(|found| found.iter().map(|f| count(f)).sum::<usize>());
            let cells: Vec<String> = sums.map(|sum| sum.to_string()).collect();
            table.push([name].into_iter().chain(cells).collect());
        };
        add("plans".into(), &|found| found.scenarios);
        add("verified, optimal".into(), &|found| found.optimal);
        let mut reasons: BTreeMap<&String, usize> = BTreeMap::new();
        for (reason, count) in columns.iter().flatten().flat_map(|found| &found.reasons) {
            *reasons.entry(reason).or_insert(0) += count;
        }
        let mut reasons: Vec<(&String, usize)> = reasons.into_iter().collect();
        reasons.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        for (reason, _) in reasons {
            add(format!("`{reason}`"), &|found| found.reasons.get(reason).copied().unwrap_or(0));
        }
        table
    }
}

/// Name of a figure's file, without the extension.
pub(super) fn figure(vehicle: &str, horizon_s: f64) -> String {
    format!("envelope-{vehicle}-{horizon_s}")
}

/// Reason why nothing could be planned in any of the cells, where it is one for all.
fn common_reason(rows: &[Vec<&Cell>]) -> Option<String> {
    let first = rows.first()?.first()?;
    let same = rows.iter().flatten().all(|cell| cell.state == first.state);
    if !same || first.success().is_some() {
        return None;
    }
    Some(match first.state.why() {
        "" => format!("{} in any cell", first.state.name()),
        why => format!("{}, {why}", first.state.name()),
    })
}

/// A cell in a table.
fn shown(cell: &Cell) -> String {
    let (Some(success), Some(found)) = (cell.interval(), &cell.found) else {
        return cell.state.name().into();
    };
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let clearance = found.clearance_m.map(|clearance| format!("; {clearance:.2} m"));
    format!(
        "**{:.0} %** ({:.0} to {:.0} %); {}; {}; {}{}",
        100.0 * success.value,
        100.0 * success.low,
        100.0 * success.high,
        or_none(found.iterations.map(|iterations| iterations.to_string())),
        or_none(found.time_s.map(time)),
        or_none(found.cost.map(number)),
        clearance.unwrap_or_default(),
    )
}

fn vehicles(records: &[VehicleRecord]) -> Table {
    let mut table = Table::new(
        "vehicle | >mass | >force | >bus torque | >joint torque | >joint rate | >keep-out far, near | file",
    );
    for record in records {
        let [far, near] = record.keep_out_m;
        table.row([
            record.name.clone(),
            format!("{} kg", record.mass_kg),
            format!("{} N", record.force_limit_n),
            format!("{} N m", record.bus_torque_limit_n_m),
            format!("{} N m", record.joint_torque_limit_n_m),
            format!("{} rad/s", record.joint_rate_limit_rad_s),
            format!("{far}, {near} m"),
            record.file.clone().unwrap_or_else(|| "built in".into()),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::super::map::tests::map;

    #[test]
    fn the_page_shows_what_was_planned_and_says_what_was_not() {
        let page = map().page();
        let text = page.markdown();
        for part in [
            "8 cells of 4 scenarios: 2 planned, 4 impossible, 2 without a start, 0 refused. Of 8 \
             plans 7 are verified and optimal. rk4, start heuristic, seed 1.",
            "| default | 530 kg | 2.5 N | 0.005 N m |",
            "\n**60 s**: impossible, joint 2, too slow.\n",
            "| tumble | 2 m | 5 m |\n| --- | ---: | ---: |\n",
            "| 0 deg/s | no start | **100 %** (40 to 100 %); 9; 250.0 ms; 0.1800; 0.12 m |",
            "| 0.5 deg/s | no start | **75 %** (19 to 99 %); 9; 250.0 ms; 0.1800; 0.12 m |",
            "|  | 60 s | 600 s |",
            "| plans | 0 | 8 |\n| verified, optimal | 0 | 7 |\n| `clearance` | 0 | 1 |",
            "(envelope-default-600.svg)",
            "| commit | `0123456789ab",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        let plots: Vec<_> = page.plots().collect();
        assert_eq!(plots.len(), 1);
        assert!(
            plots[0].1.contains("remora campaign envelope") && plots[0].1.contains("0123456789ab")
        );
    }
}
