//! A map that was made: `envelope.json`.

use super::grid::listed;
use super::{Cell, Envelope, Grid, Number, Vehicle};
use crate::formats::Limits;
use crate::method::{Integrator, WarmStart};
use crate::provenance::Provenance;
use serde::{Deserialize, Serialize};

/// The `format` of the file.
pub const FORMAT: &str = "remora-envelope/1";

/// Cells of a map, and the command and program that made them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// [`FORMAT`].
    pub format: String,
    /// The command that makes it again.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Provenance: the build of the program, and the machine.
    pub provenance: Provenance,
    /// Discretisation of Stage 2.
    pub integrator: Integrator,
    /// Initial guess of Stage 2.
    pub warm_start: WarmStart,
    /// Scenarios a cell.
    pub count: u64,
    /// Seed of their draw.
    pub seed: u64,
    /// The vehicles.
    pub vehicles: Vec<VehicleRecord>,
    /// Horizons [s].
    pub horizons_s: Vec<f64>,
    /// Norms of the target's rate [deg/s].
    pub rates_deg_s: Vec<f64>,
    /// Distances ahead of the port [m].
    pub distances_m: Vec<f64>,
    /// The cells: vehicles, in each of them horizons, rates, distances.
    pub cells: Vec<Cell>,
}

/// Record of a vehicle: its file, masses and limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VehicleRecord {
    /// Its name.
    pub name: String,
    /// Its mission file; none is built in.
    pub file: Option<String>,
    /// Mass of bus and arm [kg].
    pub mass_kg: f64,
    /// Force limits [N].
    pub force_limit_n: Limits,
    /// Bus torque limits [N m].
    pub bus_torque_limit_n_m: Limits,
    /// Joint torque limits [N m].
    pub joint_torque_limit_n_m: Limits,
    /// Joint rate limits [rad/s].
    pub joint_rate_limit_rad_s: Limits,
    /// Keep-out distances, far and near [m].
    pub keep_out_m: [f64; 2],
}

impl VehicleRecord {
    fn new(vehicle: &Vehicle) -> Self {
        let s = &vehicle.mission().servicer;
        Self {
            name: vehicle.name.clone(),
            file: vehicle.file.as_ref().map(|file| file.display().to_string()),
            mass_kg: s.bus_mass_kg + s.links.iter().map(|link| link.mass_kg).sum::<f64>(),
            force_limit_n: s.force_limit_n.clone(),
            bus_torque_limit_n_m: s.bus_torque_limit_n_m.clone(),
            joint_torque_limit_n_m: s.joint_torque_limit_n_m.clone(),
            joint_rate_limit_rad_s: s.joint_rate_limit_rad_s.clone(),
            keep_out_m: vehicle.keep_out(),
        }
    }
}

impl Map {
    pub(super) fn new(envelope: &Envelope, provenance: Provenance, cells: Vec<Cell>) -> Self {
        let values = |axis: &[Number]| axis.iter().map(|number| number.value()).collect();
        let grid = &envelope.grid;
        Self {
            format: FORMAT.into(),
            command: command(envelope),
            version: env!("CARGO_PKG_VERSION").into(),
            provenance,
            integrator: envelope.request.method.integrator,
            warm_start: envelope.request.method.warm_start,
            count: envelope.count,
            seed: envelope.seed,
            vehicles: envelope.vehicles.iter().map(VehicleRecord::new).collect(),
            horizons_s: values(&grid.horizons),
            rates_deg_s: values(&grid.rates),
            distances_m: values(&grid.distances),
            cells,
        }
    }

    /// The cells of a vehicle and horizon: a row a rate, in it the distances.
    pub fn rows(&self, vehicle: &str, horizon_s: f64) -> Vec<Vec<&Cell>> {
        let here =
            |cell: &&Cell| cell.place.vehicle == vehicle && cell.place.horizon_s == horizon_s;
        let cells: Vec<&Cell> = self.cells.iter().filter(here).collect();
        cells.chunks(self.distances_m.len().max(1)).map(<[&Cell]>::to_vec).collect()
    }

    /// The cells without their times: the same on every machine.
    pub fn timeless_cells(&self) -> Vec<Cell> {
        let mut cells = self.cells.clone();
        let found = cells.iter_mut().filter_map(|cell| cell.found.as_mut());
        found.for_each(|found| found.time_s = None);
        cells
    }

    /// Plans, and how many of them are optimal, over the cells that could be planned.
    pub fn totals(&self) -> (usize, usize) {
        let found = self.cells.iter().filter(|cell| cell.success().is_some());
        let found = found.filter_map(|cell| cell.found.as_ref());
        found.fold((0, 0), |sum, found| (sum.0 + found.scenarios, sum.1 + found.optimal))
    }

    /// Command, version and commit, for the footer of a figure.
    pub fn made_by(&self) -> String {
        let commit: String = self.provenance.commit.chars().take(12).collect();
        let changes = if self.provenance.is_modified { " with changes" } else { "" };
        format!("{}; remora {}, commit {commit}{changes}", self.command, self.version)
    }
}

/// The command line of a map, what is default left out.
fn command(envelope: &Envelope) -> String {
    let Envelope { vehicles, grid, count, seed, request, .. } = envelope;
    let method = &request.method;
    let mut line = String::from("remora campaign envelope");
    let mut add = |text: String| line.push_str(&text);
    for file in vehicles.iter().filter_map(|vehicle| vehicle.file.as_ref()) {
        add(format!(" --mission {}", file.display()));
    }
    if *grid == Grid::coarse() {
        add(" --coarse".into());
    } else {
        let default = Grid::default();
        let axes = [
            ("rate", &grid.rates, &default.rates),
            ("distance", &grid.distances, &default.distances),
            ("horizon", &grid.horizons, &default.horizons),
        ];
        for (name, axis, _) in axes.into_iter().filter(|(_, axis, default)| axis != default) {
            add(format!(" --{name} {}", listed(axis)));
        }
    }
    add(format!(" --count {count} --seed {seed} --integrator {}", method.integrator));
    if method.warm_start != WarmStart::Heuristic {
        add(format!(" --warm-start {}", method.warm_start.name()));
    }
    line
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Attempt, CellPlace, State};
    use super::*;
    use crate::request::PlanRequest;
    use remora_core::advanced::planner::Verdict;
    use std::num::NonZeroUsize;
    use std::path::Path;

    /// A map of two horizons, two rates and two distances, made without planning.
    pub fn map() -> Map {
        let number = |text: &str| text.parse::<Number>().unwrap();
        let envelope = Envelope {
            vehicles: Vehicle::built_in().unwrap()[..1].to_vec(),
            grid: Grid {
                rates: ["0", "0.5"].map(number).into(),
                distances: ["2", "5"].map(number).into(),
                horizons: ["60", "600"].map(number).into(),
            },
            count: 4,
            seed: 1,
            request: PlanRequest::default(),
            jobs: NonZeroUsize::MIN,
        };
        let cell = |place: CellPlace| {
            let attempt = |reason: Option<&str>| Attempt {
                verdict: if reason.is_some() { Verdict::NotFlyable } else { Verdict::Optimal },
                reason: reason.map(String::from),
                is_out_of_reach: false,
                iterations: 9,
                time_s: 0.25,
                cost: 0.18,
                clearance_m: Some(0.125),
            };
            let state = match (place.horizon_s, place.distance_m) {
                (60.0, _) => State::Impossible { why: "joint 2, too slow".into() },
                (_, 2.0) => State::NoStart,
                _ => {
                    let reason = (place.rate_deg_s > 0.0).then_some("clearance");
                    let attempts = [attempt(None), attempt(None), attempt(None), attempt(reason)];
                    return Cell::planned(place, &attempts);
                }
            };
            Cell { place, state, found: None }
        };
        let cells = envelope.places().map(|(_, place)| cell(place)).collect();
        let mut provenance = Provenance::gather(Path::new("/"));
        provenance.commit = "0123456789abcdef".into();
        Map::new(&envelope, provenance, cells)
    }

    #[test]
    fn a_map_knows_its_command_and_its_rows() {
        let map = map();
        let expected = "remora campaign envelope --rate 0,0.5 --distance 2,5 --horizon 60,600 --count 4 \
                        --seed 1 --integrator rk4";
        assert_eq!(map.command, expected);
        assert!(map.made_by().ends_with("; remora 0.1.0, commit 0123456789ab"));
        let rows = map.rows("default", 600.0);
        assert_eq!((rows.len(), rows[1].len()), (2, 2));
        assert_eq!(rows[1][1].success(), Some(0.75));
        assert_eq!(map.totals(), (8, 7));
    }

    #[test]
    fn a_map_survives_a_round_trip() {
        let text = crate::formats::json::to_text(&map()).unwrap();
        let back: Map = crate::formats::json::parse(&text, FORMAT).unwrap();
        assert_eq!(back, map());
    }
}
