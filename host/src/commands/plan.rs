//! `remora plan`

use super::Output;
use super::options::{
    DeadlineArgs, ForceArgs, JsonArgs, MethodArgs, MissionArgs, ScenarioArgs, WRITE, choice,
    is_stdout,
};
use crate::report;
use remora_host::choice::choices;
use remora_host::error::Error;
use remora_host::formats::{self, Mission, PlanFile, make_directory, plan_stem, write_atomically};
use remora_host::memory::on_large_stack;
use remora_host::picture;
use remora_host::planning::{self, PlanOutcome, Planner};
use remora_host::report::iteration_log;
use remora_host::request::PlanRequest;
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
    #[command(flatten)]
    deadline: DeadlineArgs,
    /// Worker threads [default: 1; the plan is the same with 2, but for times]
    #[arg(long, value_parser = choice::<Threads>(), value_name = "J", default_value = "1")]
    #[arg(allow_negative_numbers = true, hide_default_value = true)]
    jobs: Threads,
    /// Hold mission, options and model against checksums between iterations, and verify twice: refused where
    /// memory was damaged meanwhile; otherwise the same plan
    #[arg(long)]
    scrub: bool,
    /// Plan file to write (*.plan.json or *.plan.postcard), - for standard output [default:
    /// runs/ID.plan.json]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[arg(long, value_name = "WHAT", value_delimiter = ',', help = WRITE)]
    #[arg(value_parser = choice::<Beside>())]
    write: Vec<Beside>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Show the iterations of both stages
    #[arg(short, long)]
    verbose: bool,
}

choices! {
    /// Files beside the plan.
    enum Beside {
        /// A drawing: path, bus and arm, and all that has limits over time.
        Svg = "svg",
    }
}

/// Where plans are written unless told otherwise.
const FOLDER: &str = "runs";

const AFTER_HELP: &str = "\
Examples:
  remora plan
  remora plan --list
  remora plan -v --integrator euler
  remora plan --id pub-007 --out seven.plan.json
  remora plan --scenarios a.scenarios.json --id s1-007 --out -
  remora plan --mission light.mission.toml --mode feasible
  remora plan --warm-start heuristic
  remora plan --model mine.model
  remora plan --deadline 0.5 --jobs 2
  remora plan --scrub
  remora plan --write svg
  remora plan --out pub-000.plan.postcard

With --mission and neither --scenarios nor --id, a scenario of that mission is drawn: s1-000, the first of
`remora draw --seed 1`, or the next that is not refused.

What no plan can end well is refused before planning, with the constraint's name; then no file is
written. Clearances are smallest distances of bodies, negative where they overlap.

A file whose name ends in .postcard gets what a spacecraft would send down, in a third of the bytes; others
get text, with names and units. Each command that reads plans reads either kind of file.

The plan file holds scenario and mission; its evidence goes beside it (not with --out -), and with --write
svg a.svg beside a.plan.json. A file of --out that is there is replaced only where it is a plan of the same
scenario, or with --force.

Exit status: 0 optimal, 1 not flyable (the plan file holds the best iterate) or refused, 2 bad input,
3 verified but not converged.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        if let Some(list) = self.scenario.listed()? {
            return Ok(Output::data(list));
        }
        let mission = self.mission.mission()?;
        let scenario = self.scenario.scenario(&self.mission, &mission, self.method.integrator())?;
        let request = PlanRequest {
            threads: self.jobs,
            is_scrubbed: self.scrub,
            ..self.method.request(mission, self.deadline.deadline)?
        };
        if let Some(refusal) = request.refusal(&scenario)? {
            return Ok(Output::new(report::refusal_report(&scenario.id, &refusal), false));
        }
        let default = || Path::new(FOLDER).join(format!("{}.plan.json", scenario.id));
        let out = &self.out.clone().unwrap_or_else(default);
        self.prepare(&scenario.id, out)?;
        let planned = on_large_stack(|| Planner::new().plan(&request, &scenario))?;
        if !is_stdout(out) {
            planned.write(out)?;
        }
        if let Some(refusal) = &planned.refusal {
            return Ok(Output::new(report::refusal_report(&scenario.id, refusal), false));
        }
        if let Some(drawing) = self.drawing(out)? {
            let svg = picture::svg(&planned.file, &mission)?;
            write_atomically(&drawing, svg.as_bytes())?;
        }
        let verdict = planned.file.verdict.unwrap_or_default();
        let is_data = self.json.json || is_stdout(out);
        let text = self.report(&planned, &mission, out)?;
        Output::judged(text, verdict).or_json(is_data, &planned.file)
    }

    /// Finds out before planning what cannot be written or must be kept.
    fn prepare(&self, scenario: &str, out: &Path) -> Result<(), Error> {
        if self.out.is_none() {
            make_directory(Path::new(FOLDER))?;
        } else if !is_stdout(out) && !is_plan_of(out, scenario) {
            self.force.keep(out)?;
        }
        if let Some(drawing) = self.drawing(out)? {
            formats::check_writable(&drawing)?;
        }
        if is_stdout(out) { Ok(()) } else { planning::check_writable(out) }
    }

    /// Where the drawing of a plan goes, beside it, if one is asked for.
    fn drawing(&self, plan: &Path) -> Result<Option<PathBuf>, Error> {
        match self.write.contains(&Beside::Svg) {
            true if is_stdout(plan) => {
                let reason = "svg goes beside the plan's file, and --out - has none";
                Err(Error::argument("--write", reason))
            }
            true => Ok(Some(plan.with_file_name(format!("{}.svg", plan_stem(plan))))),
            false => Ok(None),
        }
    }

    fn report(
        &self,
        planned: &PlanOutcome,
        mission: &Mission,
        out: &Path,
    ) -> Result<String, Error> {
        let mut text = String::new();
        if self.verbose {
            text.push_str(&iteration_log("Stage 1, translation", &planned.logs[0]));
            text.push_str(&iteration_log("Stage 2, reorientation", &planned.logs[1]));
            text.push_str(&report::evidence(planned));
        }
        text.push_str(&report::plan_report(planned, mission, out));
        if let Some(drawing) = self.drawing(out)? {
            text += &format!("written: {}\n", drawing.display());
        }
        text += &report::packet_report(planned, out)?;
        text += &format!("look at it: {} view {}\n", called(), out.display());
        Ok(text)
    }
}

/// How this program was called, to be called again.
fn called() -> String {
    let program = std::env::args_os().next();
    program.map_or_else(|| "remora".into(), |program| program.to_string_lossy().into_owned())
}

/// Whether a file is an earlier plan of the same scenario, which a new one may replace.
fn is_plan_of(file: &Path, scenario: &str) -> bool {
    PlanFile::read(file).is_ok_and(|plan| plan.scenario == scenario)
}
