//! `remora mission`

use super::Output;
use crate::report;
use remora_host::error::Error;
use remora_host::formats::{json, read_mission};
use remora_host::method::Integrator;
use remora_host::vehicle::Vehicle;
use std::path::{Path, PathBuf};

/// Print what follows from a mission's numbers, and refuse one that cannot end.
///
/// Reach and extension of the arm, masses and inertia, keep-out radii, the time that joints take,
/// and what force, torque and the grid of nodes leave to spare for the fastest scenario drawn.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Mission file (*.mission.toml) [default: the built-in mission]
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// euler, rk4 or rk4:M: it decides what is in force where the mission says auto
    #[arg(long, value_name = "NAME", default_value_t = Integrator::RK4)]
    integrator: Integrator,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const AFTER_HELP: &str = "\
Examples:
  remora mission
  remora mission light.mission.toml
  remora mission light.mission.toml --json

Exit status: 0 nothing forbids an approach to end, 1 infeasible (the constraint is named), 2 bad
input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = read_mission(self.file.as_deref())?;
        let vehicle = Vehicle::of(&mission, self.integrator);
        let text = match self.json {
            true => json::to_text(&vehicle)
                .map_err(|error| Error::output(Path::new("standard output"), &error.into()))?,
            false => report::vehicle_report(&vehicle),
        };
        Ok(Output::new(text, vehicle.refused.is_none()))
    }
}
