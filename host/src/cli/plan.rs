//! `remora plan`

use super::Output;
use super::options::{MethodArgs, MissionArgs};
use crate::error::Error;
use crate::formats::{NamedScenario, PlanStatus, ScenarioSet};
use crate::planning::PlanJob;
use crate::report;
use std::path::PathBuf;

/// Plan one approach and write the plan.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    /// Scenario of the set [default: its first]
    #[arg(long)]
    id: Option<String>,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
    /// Plan file to write [default: ID.plan.json]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Show the iterations of both stages
    #[arg(short, long)]
    verbose: bool,
}

const AFTER_HELP: &str = "\
Examples:
  remora plan
  remora plan -v --integrator euler
  remora plan --scenarios a.scenarios.json --id s1-007 --out seven.plan.json
  remora plan --mission light.mission.toml --mode feasible

Exit status: 0 solved, 1 not solved (the plan file holds the best iterate), 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let scenario = self.scenario()?;
        let mission = self.mission.mission()?;
        let default = || PathBuf::from(format!("{}.plan.json", scenario.id));
        let out = self.out.clone().unwrap_or_else(default);
        let job = PlanJob { scenario, mission, method: self.method.method(), out };
        let planned = job.run()?;

        let mut text = String::new();
        if self.verbose {
            text.push_str(&report::iteration_log("Stage 1, translation", &planned.logs[0]));
            text.push_str(&report::iteration_log("Stage 2, reorientation", &planned.logs[1]));
            text.push_str(&report::evidence(&planned));
        }
        text.push_str(&report::plan_report(&planned, &job.mission.tolerances, &job.out));
        Ok(Output::new(text, planned.file.status == PlanStatus::Solved))
    }

    fn scenario(&self) -> Result<NamedScenario, Error> {
        let (file, set) = match (&self.scenarios, &self.id) {
            (Some(file), _) => (file.clone(), ScenarioSet::read(file)?),
            (None, None) => (PathBuf::new(), ScenarioSet::built_in()?),
            (None, Some(_)) => return Err(Error::argument("--id", "needs --scenarios FILE")),
        };
        let found = match &self.id {
            Some(id) => set.get(id),
            None => set.scenarios.first(),
        };
        found.cloned().ok_or_else(|| {
            let id = self.id.as_deref().unwrap_or_default();
            Error::input(&file, "scenarios", format!("there is no scenario with id {id:?}"))
        })
    }
}
