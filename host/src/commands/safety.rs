//! `remora safety`

use super::Output;
use super::flying::FlyingArgs;
use super::options::{JobsArgs, JsonArgs, SEED};
use super::progress::Bar;
use crate::report;
use remora_flight::pilot::Sortie;
use remora_flight::ways_out::WaysOut;
use remora_host::error::Error;
use remora_host::formats::{PlanFile, Verdict};
use remora_host::with_joints;
use remora_truth::Dispersion;
use std::path::PathBuf;

/// Say for each node of a plan what becomes of the approach if it must end there.
///
/// Two ways out: the abort that guidance flies, and a free drift of one orbit. The first node from
/// which the abort does not leave the target clear is the point of no return.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json) made with rk4
    #[arg(value_name = "PLAN")]
    plan: PathBuf,
    /// Fly both ways out from each node in a world that the plan does not know, too
    #[arg(long)]
    flown: bool,
    /// Errors of the world: a file (*.errors.toml), typical or none [default: none]
    #[arg(long, value_name = "FILE", requires = "flown")]
    errors: Option<PathBuf>,
    #[arg(long, value_name = "S", requires = "flown", help = format!("{SEED} [default: 0]"))]
    seed: Option<u64>,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora safety runs/pub-000.plan.json
  remora safety runs/pub-000.plan.json --flown
  remora safety runs/pub-000.plan.json --flown --errors mine.errors.toml --seed 3 --json

Exit status: 0 every abort leaves the target clear, 1 some does not, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let file = &self.plan;
        let plan = PlanFile::read(file)?;
        if plan.verdict == Some(Verdict::NotFlyable) {
            let reason = "is not flyable: there is no approach to leave";
            return Err(Error::input(file, "verdict", reason));
        }
        let joints = plan.inputs.mission.joints();
        let errors = FlyingArgs::errors(self.errors.as_deref(), joints)?;
        let sortie = with_joints!(joints, NL => {
            Sortie::of::<NL>(file, &plan)?
        } else {
            let reason = "has no arm of 1 to 7 joints";
            return Err(Error::input(file, "inputs.mission.servicer", reason));
        });
        let mut ways = WaysOut::planned(&plan.scenario, &sortie);
        if self.flown {
            let dispersion = Dispersion { errors, seed: self.seed.unwrap_or(0), run: 0 };
            ways.fly(&sortie, &dispersion, self.jobs.jobs(), &mut Bar::named("fly"))?;
        }
        let report = report::safety_report(&ways);
        Output::new(report, ways.all_escape()).or_json(self.json.json, &ways)
    }
}
