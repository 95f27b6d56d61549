//! `remora export --format qp`

use super::Output;
use super::options::{JsonArgs, MethodArgs, MissionArgs, ScenarioArgs};
use crate::report;
use remora_host::error::Error;
use remora_host::export::ExportJob;
use std::path::PathBuf;

/// The plan whose subproblems are written.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Subproblems, with --format qp")]
pub(super) struct ProgramsArgs {
    #[command(flatten)]
    pub(super) scenario: ScenarioArgs,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
}

impl ProgramsArgs {
    /// Plans, and writes every subproblem that is solved on the way.
    pub(super) fn write(self, out: PathBuf, force: bool, json: JsonArgs) -> Result<Output, Error> {
        let (mission, integrator) = (self.mission.of_default_arm()?, self.method.integrator());
        let job = ExportJob {
            scenario: self.scenario.scenario(&self.mission, &mission, integrator)?,
            request: self.method.request(mission, None)?,
            out,
            force,
        };
        let exported = job.run()?;
        let verdict = exported.planned.file.verdict.unwrap_or_default();
        Output::judged(report::export_report(&exported, &job.out), verdict)
            .or_json(json.json, &exported.stages)
    }
}
