//! `remora check`

use super::Output;
use super::options::MissionArgs;
use crate::report;
use remora_host::checking::Check;
use remora_host::error::Error;
use remora_host::formats::ScenarioSet;
use remora_host::method::Integrator;
use std::path::PathBuf;

/// Verify plan files, whoever wrote them.
///
/// Recomputes the residuals from the numbers in the file, with code that the planner does not use.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenario set (*.scenarios.json) that holds the plans' scenarios
    #[arg(long, value_name = "FILE")]
    scenarios: PathBuf,
    #[command(flatten)]
    mission: MissionArgs,
    /// euler, rk4 or rk4:M [default: what each plan names]
    #[arg(long, value_name = "NAME")]
    integrator: Option<Integrator>,
    /// Count a plan that says something else of itself than what is recomputed as failed
    #[arg(long)]
    strict: bool,
    /// Plan files (*.plan.json)
    #[arg(required = true, value_name = "PLAN")]
    plans: Vec<PathBuf>,
}

const AFTER_HELP: &str = "\
Examples:
  remora check --scenarios a.scenarios.json s1-007.plan.json
  remora check --scenarios a.scenarios.json --strict runs/a/plans/*.plan.json
  remora check --scenarios a.scenarios.json --integrator rk4:20 s1-007.plan.json

Exit status: 0 all feasible, 1 some are not (with --strict: or disagree), 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let check = Check {
            scenarios: ScenarioSet::read(&self.scenarios)?,
            mission: self.mission.mission()?,
            integrator: self.integrator,
            plans: self.plans,
        };
        let verdicts = check.run()?;
        let good = verdicts
            .iter()
            .all(|verdict| verdict.feasible && (!self.strict || verdict.disagreements.is_empty()));
        Ok(Output::new(report::check_report(&verdicts, &check.mission.tolerances), good))
    }
}
