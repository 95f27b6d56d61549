//! `remora plan`

use super::Output;
use super::options::{MethodArgs, MissionArgs, ScenarioArgs, choice};
use crate::report;
use remora_host::error::Error;
use remora_host::formats::{PlanVerdict, check_writable, make_directory, write_atomically};
use remora_host::method::Deadline;
use remora_host::picture;
use remora_host::planning::PlanJob;
use remora_host::report::iteration_log;
use remora_host::threads::Threads;
use std::path::{Path, PathBuf};

/// Plan one approach and write the plan.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
    /// Time for the whole plan, a positive number; past it the best iterate is kept and the status
    /// is deadline [default: none]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    deadline: Option<Deadline>,
    /// Threads that work on the plan; it is the same with either, but for times
    #[arg(long, value_parser = choice::<Threads>(), value_name = "N", default_value = "1")]
    #[arg(allow_negative_numbers = true)]
    threads: Threads,
    /// Plan file to write [default: runs/ID.plan.json]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the plan too: path, bus and arm, and all that has limits over time
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Show the iterations of both stages
    #[arg(short, long)]
    verbose: bool,
}

/// Where plans are written unless told otherwise.
const FOLDER: &str = "runs";

const AFTER_HELP: &str = "\
Examples:
  remora plan
  remora plan -v --integrator euler
  remora plan --scenarios a.scenarios.json --id s1-007 --out seven.plan.json
  remora plan --mission light.mission.toml --mode feasible
  remora plan --warm-start heuristic
  remora plan --integrator euler --model mine.model
  remora plan --deadline 0.5 --threads 2
  remora plan --plot plan.svg

What no plan can end well is refused before planning, with the constraint's name; then no file is
written. Clearances are smallest distances of bodies, negative where they overlap.

Exit status: 0 optimal, 1 not flyable (the plan file holds the best iterate) or refused, 2 bad input,
3 verified but not converged.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        let scenario = self.scenario.scenario()?;
        let mission = self.mission.mission()?;
        let out = match &self.out {
            Some(out) => out.clone(),
            None => Path::new(FOLDER).join(format!("{}.plan.json", scenario.id)),
        };
        let method = self.method.method_until(self.deadline);
        let model = self.method.model()?;
        let job = PlanJob { scenario, mission, method, model, threads: self.threads, out };
        if let Some(refusal) = job.refusal()? {
            return Ok(Output::new(report::refusal_report(&job.scenario.id, &refusal), false));
        }
        if self.out.is_none() {
            make_directory(Path::new(FOLDER))?;
        }
        if let Some(plot) = &self.plot {
            check_writable(plot)?;
        }
        let planned = job.run()?;
        if let Some(plot) = &self.plot {
            let svg = picture::svg(&planned.file, &job.mission)?;
            write_atomically(plot, svg.as_bytes())?;
        }

        let mut text = String::new();
        if self.verbose {
            text.push_str(&iteration_log("Stage 1, translation", &planned.logs[0]));
            text.push_str(&iteration_log("Stage 2, reorientation", &planned.logs[1]));
            text.push_str(&report::evidence(&planned));
        }
        text.push_str(&report::plan_report(&planned, &job.mission, &job.out));
        if let Some(plot) = &self.plot {
            text += &format!("written: {}\n", plot.display());
        }
        Ok(Output::judged(text, planned.file.verdict.unwrap_or(PlanVerdict::NotFlyable)))
    }
}
