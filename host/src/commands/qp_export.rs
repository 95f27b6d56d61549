//! `remora qp-export`

use super::Output;
use super::options::{ForceArgs, JsonArgs, MethodArgs, MissionArgs, ScenarioArgs};
use crate::report;
use remora_host::error::Error;
use remora_host::export::ExportJob;
use std::path::PathBuf;

/// Plan one approach and write every convex subproblem that was solved on the way.
///
/// Each file holds one quadratic program with its solution: matrices and bounds node by node, so
/// that any other solver can be run on it. The form is described in docs/formats.md.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora qp-export --scenarios a.scenarios.json --id s1-007 --out programs
  remora qp-export --integrator euler --qp clarabel --out programs

Writes DIR/stage1-001.qp.json and so on: stage, iteration and, after it, second-order correction.
Subproblems that stand in DIR from before are replaced; with anything else in it DIR is refused,
unless --force is given.

Exit status: 0 plan optimal, 1 not flyable, 3 verified but not converged (the subproblems are written
all the same), 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        if let Some(list) = self.scenario.listed()? {
            return Ok(Output::data(list));
        }
        let (mission, method) = (self.mission.mission()?, self.method.method());
        let job = ExportJob {
            scenario: self.scenario.scenario(&self.mission, &mission, method.integrator)?,
            mission,
            method,
            model: self.method.model()?,
            out: self.out.unwrap_or_default(),
            force: self.force.force,
        };
        let exported = job.run()?;
        let verdict = exported.planned.file.verdict.unwrap_or_default();
        Output::judged(report::export_report(&exported, &job.out), verdict)
            .or_json(self.json.json, &exported.stages)
    }
}
