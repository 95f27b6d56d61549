//! Options that several commands share.

use crate::error::Error;
use crate::formats::{ScenarioSet, read_mission};
use crate::method::{Integrator, Method, Mode, Qp, WarmStart};
use remora_core::model::Mission;
use remora_core::stages::LINKS;
use std::path::PathBuf;

/// How plans are made.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct MethodArgs {
    /// What is asked of Stage 2
    #[arg(long, value_enum, default_value_t = Mode::Optimal)]
    mode: Mode,
    /// What Stage 2 starts from
    #[arg(long, value_enum, default_value_t = WarmStart::Heuristic)]
    warm_start: WarmStart,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4
    #[arg(long, value_name = "NAME", default_value_t = Integrator::RK4)]
    integrator: Integrator,
    /// Solver of the convex subproblems
    #[arg(long, value_enum, default_value_t = Qp::Clarabel)]
    qp: Qp,
}

impl MethodArgs {
    pub(super) fn method(self) -> Method {
        let Self { mode, warm_start, integrator, qp } = self;
        Method { mode, warm_start, qp, integrator }
    }
}

/// The mission.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct MissionArgs {
    /// Mission file (*.mission.toml) [default: the built-in mission]
    #[arg(long, value_name = "FILE")]
    mission: Option<PathBuf>,
}

impl MissionArgs {
    pub(super) fn mission(&self) -> Result<Mission<LINKS>, Error> {
        read_mission(self.mission.as_deref())
    }
}

/// Scenarios `0..count` of a seed, for the mission.
pub(super) fn drawn(count: u64, seed: u64, mission: &Mission<LINKS>) -> Result<ScenarioSet, Error> {
    crate::draw::draw(count, seed, mission).ok_or_else(|| {
        Error::argument("--mission", "its geometry lets no start satisfy keep-out and pointing")
    })
}
