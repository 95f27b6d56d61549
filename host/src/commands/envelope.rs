//! `remora campaign envelope`

use super::Output;
use super::options::{COUNT, JobsArgs, JsonArgs, SEED, choice};
use super::progress::Bar;
use crate::report;
use remora_host::draw::MAX_COUNT;
use remora_host::envelope::{self, Envelope, Grid, Number, Vehicle};
use remora_host::error::Error;
use remora_host::formats::Mission;
use remora_host::method::{Integrator, Method, WarmStart};
use remora_host::request::PlanRequest;
use std::path::PathBuf;

/// Map where the planner works, over tumble rate, distance and horizon, for some vehicles.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Mission file (*.mission.toml) [default: the built-in mission, a strong and a small servicer;
    /// may be given several times, a vehicle each]
    #[arg(long, value_name = "FILE")]
    mission: Vec<PathBuf>,
    /// Norms of the target's rate [deg/s] [default: 0,0.5,1,2,3,5,7]
    #[arg(long, value_name = "R,..", value_delimiter = ',', allow_hyphen_values = true)]
    rate: Option<Vec<Number>>,
    /// Distances ahead of the port [m] [default: 2,5,10,20,30,50,100]
    #[arg(long, value_name = "D,..", value_delimiter = ',', allow_hyphen_values = true)]
    distance: Option<Vec<Number>>,
    /// Horizons [s] [default: 60,120,300,600,1200]
    #[arg(long, value_name = "T,..", value_delimiter = ',', allow_hyphen_values = true)]
    horizon: Option<Vec<Number>>,
    /// A small part of the map, in well under a minute
    #[arg(long, conflicts_with_all = ["rate", "distance", "horizon"])]
    coarse: bool,
    #[arg(long, value_name = "N")]
    #[arg(help = format!("{COUNT} [default: 10 a cell; 2 with --coarse]"))]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: Option<u64>,
    #[arg(long, value_name = "S", default_value_t = envelope::SEED, help = SEED)]
    seed: u64,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4 [default: rk4:4]
    #[arg(long, value_name = "NAME")]
    integrator: Option<Integrator>,
    /// Initial guess of Stage 2
    #[arg(long, value_parser = choice::<WarmStart>(), default_value = "heuristic")]
    warm_start: WarmStart,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist [default: runs/envelope, or
    /// runs/envelope-coarse with --coarse]
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    out: Option<PathBuf>,
}

const AFTER_HELP: &str = "\
Examples:
  remora campaign envelope                          three vehicles, an hour or so on two cores
  remora campaign envelope --coarse                 a small part of it, as CI does
  remora campaign envelope --mission mine.mission.toml --horizon 90,180 --count 30 --out runs/mine
  remora campaign envelope --rate 0.06 --distance 5 --horizon 1200 --count 300

A cell is the vehicle's mission with duration, standoff and rate replaced; keep-out, margins and all
else stay. Built-in models know the built-in mission alone, so that plans start from the heuristic
unless told otherwise. Interrupt it at any time: the same command goes on at the cell where it stopped, also with
more rates, distances or horizons. Results do not depend on the number of threads, but for times.

Exit status: 0 done, whatever the plans came to, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let grid = self.grid()?;
        let vehicles = match self.mission.is_empty() {
            true => Vehicle::built_in()?,
            false => Vehicle::read(&self.mission)?,
        };
        let integrator = self.integrator.unwrap_or(envelope::INTEGRATOR);
        let count = if self.coarse { envelope::COARSE_COUNT } else { envelope::COUNT };
        let method = Method { integrator, warm_start: self.warm_start, ..Method::default() };
        let envelope = Envelope {
            vehicles,
            grid,
            count: self.count.unwrap_or(count),
            seed: self.seed,
            // Each cell has a mission of its own.
            request: PlanRequest::new(Mission::default(), method, None)?,
            jobs: self.jobs.jobs(),
        };
        let default = if self.coarse { "runs/envelope-coarse" } else { "runs/envelope" };
        let out = self.out.unwrap_or_else(|| default.into());
        let made = envelope.run(&out, &mut Bar::named("envelope"))?;
        Output::new(report::envelope_report(&made), true).or_json(self.json.json, &made.map)
    }

    fn grid(&self) -> Result<Grid, Error> {
        let default = if self.coarse { Grid::coarse() } else { Grid::default() };
        let grid = Grid {
            rates: self.rate.clone().unwrap_or(default.rates),
            distances: self.distance.clone().unwrap_or(default.distances),
            horizons: self.horizon.clone().unwrap_or(default.horizons),
        };
        grid.check().map_err(|(option, reason)| Error::argument(option, reason))?;
        Ok(grid)
    }
}
