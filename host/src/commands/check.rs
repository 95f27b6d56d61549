//! `remora check`

use super::Output;
use super::options::JsonArgs;
use crate::report;
use remora_host::checking::{Check, Checks, FileValue, PlanCheck};
use remora_host::error::Error;
use remora_host::formats::{ScenarioSet, Verdict, read_mission_file};
use remora_host::method::Integrator;
use std::path::PathBuf;

/// Verify plan files, whoever wrote them.
///
/// Recomputes the residuals from the numbers in the file, with code that the planner does not use. How near a plan
/// is to a local optimum is found from one subproblem of each stage at the plan.
/// A plan file holds its scenario and its mission.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Scenario set (*.scenarios.json) [default: what each plan holds; another is an error]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    /// Mission file (*.mission.toml) [default: what each plan holds; another is an error]
    #[arg(long, value_name = "FILE")]
    mission: Option<PathBuf>,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4 [default: what each plan names]
    #[arg(long, value_name = "NAME")]
    integrator: Option<Integrator>,
    /// Count a plan that says something else of itself than what is recomputed as failed
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    json: JsonArgs,
    /// Plan files (*.plan.json)
    #[arg(required = true, value_name = "PLAN")]
    plans: Vec<PathBuf>,
}

const AFTER_HELP: &str = "\
Examples:
  remora check runs/pub-000.plan.json
  remora check --strict runs/a/plans/*.plan.json
  remora check --integrator rk4:20 s1-007.plan.json
  remora check --mission mine.mission.toml s1-007.plan.json

One plan is shown with all its residuals, several as a table. A plan that was made for another scenario
or mission than one given is refused.

A plan is called optimal where it is verified here, locally optimal here to 1 % of the cost, and says that it
is solved. Whether a better optimum lies elsewhere is not found out.

Exit status: 0 all optimal, 1 some are not flyable (with --strict: or disagree), 2 bad input, 3 all
verified but some not converged, by their own word or by what was found.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let scenarios = self
            .scenarios
            .map(|file| ScenarioSet::read(&file).map(|value| FileValue { file, value }));
        let mission = self
            .mission
            .map(|file| read_mission_file(Some(&file)).map(|value| FileValue { file, value }));
        let check = Check {
            scenarios: scenarios.transpose()?,
            mission: mission.transpose()?,
            integrator: self.integrator,
            plans: self.plans,
        };
        let checked = check.run()?;
        let disagrees = |plan: &PlanCheck| !plan.disagreements.is_empty();
        let worst = match self.strict && checked.iter().any(disagrees) {
            true => Verdict::NotFlyable,
            false => checked.iter().map(|plan| plan.verdict).max().unwrap_or(Verdict::Optimal),
        };
        Output::judged(report::check_report(&checked), worst)
            .or_json(self.json.json, &Checks::new(&checked))
    }
}
