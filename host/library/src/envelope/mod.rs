//! Envelopes: where the planner works, over tumble rate, distance and horizon, for some vehicles.
//!
//! A cell of the map is a [`Vehicle`]'s mission with its horizon, the distance ahead of the port
//! and the norm of the target's rate replaced, and scenarios drawn for it. Finished cells go to an
//! append-only journal; a map that was interrupted goes on there.
//!
//! ```text
//! DIR/journal.jsonl            what was asked for, then a line a cell that was planned
//! DIR/envelope.json            all cells
//! DIR/envelope.csv             the same, a row a cell
//! DIR/envelope.md              the page
//! DIR/envelope-VEHICLE-HORIZON.svg
//! ```

mod cell;
mod grid;
mod header;
mod map;
mod output;
mod overview;
mod page;
mod reach;
mod vehicle;

pub use cell::{Attempt, Cell, CellPlace, Found, State};
pub use grid::{Grid, Number};
pub use map::{FORMAT, Map, VehicleRecord};
pub use output::files;
pub use vehicle::Vehicle;

use crate::error::Error;
use crate::formats::{self, Mission, NamedScenario, check_writable, make_directory};
use crate::method::{Integrator, Method};
use crate::planning::Planner;
use crate::pool;
use crate::progress::Progress;
use crate::provenance::Provenance;
use crate::request::PlanRequest;
use cell::CellWork;
use header::{EnvelopeHeader, JOURNAL};
use remora_core::advanced::planner::Verdict;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Scenarios a cell where nothing else is asked for, and of the coarse map.
pub const COUNT: u64 = 10;
/// See [`COUNT`].
pub const COARSE_COUNT: u64 = 2;
/// Seed where nothing else is asked for.
pub const SEED: u64 = 1;

/// The discretisation where nothing else is asked for. Half the substeps of the default: a map
/// asks whether plans exist, not for their last digit.
pub const INTEGRATOR: Integrator = Integrator::Rk4 { substeps: 4 };

/// A map to be made: the input of `remora campaign envelope`.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// The vehicles, at least one; names are unique.
    pub vehicles: Vec<Vehicle>,
    /// The axes.
    pub grid: Grid,
    /// Scenarios a cell.
    pub count: u64,
    /// Seed of their draw.
    pub seed: u64,
    /// How to plan, with the embedded solver; each cell has a mission of its own.
    pub request: PlanRequest,
    /// Number of worker threads.
    pub jobs: NonZeroUsize,
}

/// A map that was made.
#[derive(Clone, Debug)]
pub struct EnvelopeResult {
    /// The map.
    pub map: Map,
    /// Plans of this run.
    pub planned: usize,
    /// Plans of earlier runs.
    pub resumed: usize,
    /// How long it took [s].
    pub wall_s: f64,
    /// The files written.
    pub files: Vec<PathBuf>,
}

/// A cell that is being planned: what came of its scenarios so far.
struct Begun {
    attempts: Vec<Attempt>,
    cell: Option<Cell>,
}

impl Envelope {
    /// The coarse map of the built-in vehicles.
    ///
    /// # Errors
    /// None, as long as the built-in missions are sound.
    pub fn coarse(jobs: NonZeroUsize) -> Result<Self, Error> {
        let method = Method { integrator: INTEGRATOR, ..Method::default() };
        Ok(Self {
            vehicles: Vehicle::built_in()?,
            grid: Grid::coarse(),
            count: COARSE_COUNT,
            seed: SEED,
            request: PlanRequest { method, ..PlanRequest::default() },
            jobs,
        })
    }

    /// Makes the map without any files, with a program of the checkout in `root`.
    ///
    /// # Errors
    /// Threads that cannot be started.
    pub fn map(&self, root: &Path, progress: &mut dyn Progress) -> Result<Map, Error> {
        let (cells, _) = self.cells(Vec::new(), progress, |_| Ok(()))?;
        Ok(Map::new(self, Provenance::gather(root), cells))
    }

    /// Plans what is not in the journal of `out` yet, then writes map and page there.
    ///
    /// # Errors
    /// A directory or file that cannot be written (found out before planning); a journal of other
    /// work; a map that is being made in the same directory already.
    pub fn run(&self, out: &Path, progress: &mut dyn Progress) -> Result<EnvelopeResult, Error> {
        let started = Instant::now();
        // Provenance comes before any output file, which must not count as a change of the sources.
        let provenance = Provenance::gather(Path::new("."));
        let (path, header) = (out.join(JOURNAL), EnvelopeHeader::new(self));
        header::Journal::look(&path, &header, &|_| Ok(()))?;
        make_directory(out)?;
        files(out, self).iter().try_for_each(|file| check_writable(file))?;
        let (mut journal, finished) = header::Journal::open(&path, &header, &|_| Ok(()))?;
        formats::remove_partials(out);

        let (cells, planned) = self.cells(finished, progress, |cell| journal.append(cell))?;
        let all: usize =
            cells.iter().filter_map(|cell| cell.found.as_ref()).map(|found| found.scenarios).sum();
        let map = Map::new(self, provenance, cells);
        let files = map.write(out)?;
        let wall_s = started.elapsed().as_secs_f64();
        Ok(EnvelopeResult { map, planned, resumed: all - planned, wall_s, files })
    }

    /// All cells, those that are `finished` taken as they are, and how many plans the others took.
    fn cells(
        &self,
        finished: Vec<Cell>,
        progress: &mut dyn Progress,
        mut keep: impl FnMut(&Cell) -> Result<(), Error>,
    ) -> Result<(Vec<Cell>, usize), Error> {
        let prepared: Vec<CellWork> = self.places().map(|(v, p)| self.prepare(v, p)).collect();
        let mut begun: Vec<Begun> = prepared.iter().map(|p| Begun::new(p, &finished)).collect();
        let plans = |prepared: &CellWork| prepared.ready().map_or(0, |(_, drawn)| drawn.len());
        let total: usize = prepared.iter().map(plans).sum();
        let pending: Vec<(usize, usize)> = (0..prepared.len())
            .filter(|i| begun[*i].cell.is_none())
            .flat_map(|i| (0..plans(&prepared[i])).map(move |scenario| (i, scenario)))
            .collect();
        progress.begin(total, total - pending.len());
        let plan = |planner: &mut Planner, (i, scenario): (usize, usize)| {
            let nothing = || Error::Thread { reason: "a cell without scenarios".into() };
            let (mission, drawn) = prepared[i].ready().ok_or_else(nothing)?;
            Ok(self.attempt(planner, mission, &drawn[scenario]))
        };
        let finish = |(i, _): (usize, usize), attempt: Attempt| {
            progress.done(attempt.verdict == Verdict::Optimal);
            begun[i].attempts.push(attempt);
            if begun[i].attempts.len() == plans(&prepared[i]) {
                let cell = Cell::planned(prepared[i].place.clone(), &begun[i].attempts);
                keep(&cell)?;
                begun[i].cell = Some(cell);
            }
            Ok(())
        };
        let outcome = pool::plan_all(self.jobs, &pending, plan, finish);
        progress.end();
        outcome?;
        Ok((begun.into_iter().filter_map(|begun| begun.cell).collect(), pending.len()))
    }

    /// Vehicles and places of all cells, in the order of the map.
    fn places(&self) -> impl Iterator<Item = (&Vehicle, CellPlace)> {
        let places = |vehicle: &Vehicle| self.grid.places(&vehicle.name).into_iter();
        self.vehicles.iter().flat_map(move |vehicle| places(vehicle).map(move |p| (vehicle, p)))
    }

    /// Prepares a cell: its mission and scenarios, or the reason why nothing can be planned.
    fn prepare(&self, vehicle: &Vehicle, place: CellPlace) -> CellWork {
        match vehicle.at(&place) {
            Err(state) => CellWork::settled(place, state),
            Ok(mission) => CellWork::drawn(place, mission, self.seed, self.count),
        }
    }

    fn attempt(
        &self,
        planner: &mut Planner,
        mission: &Mission,
        scenario: &NamedScenario,
    ) -> Attempt {
        let request = PlanRequest { mission: *mission, ..self.request.clone() };
        let report = planner.plan_in_place(&request, scenario);
        let is_out_of_reach =
            reach::is_without_path(&report) && reach::is_proved(planner, request, scenario);
        Attempt::of(&report, &mission.tolerances, is_out_of_reach)
    }
}

impl Begun {
    fn new(prepared: &CellWork, finished: &[Cell]) -> Self {
        let there = || finished.iter().rfind(|cell| cell.place == prepared.place).cloned();
        Self { attempts: Vec::new(), cell: prepared.cell().or_else(there) }
    }
}
