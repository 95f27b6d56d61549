//! `remora mission show`

use super::Output;
use super::options::{IntegratorArgs, JsonArgs};
use crate::report;
use remora_host::error::Error;
use remora_host::formats::read_mission;
use remora_host::vehicle::Vehicle;
use std::path::PathBuf;

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
    #[command(flatten)]
    integrator: IntegratorArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora mission show
  remora mission show light.mission.toml
  remora mission show light.mission.toml --json

The integrator decides what is in force where the mission says auto.

Exit status: 0 nothing forbids an approach to end, 1 infeasible (the constraint is named), 2 bad
input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let mission = read_mission(self.file.as_deref())?;
        let vehicle = Vehicle::of(&mission, self.integrator.integrator);
        let can_end = vehicle.refused.is_none();
        Output::new(report::vehicle_report(&vehicle), can_end).or_json(self.json.json, &vehicle)
    }
}
