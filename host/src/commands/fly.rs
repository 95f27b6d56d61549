//! `remora fly`

use super::Output;
use super::flying::{FlyingArgs, Ready, RunsArgs};
use super::options::{
    DeadlineArgs, JobsArgs, JsonArgs, MethodArgs, MissionArgs, SEED, ScenarioArgs,
};
use super::parts::{PartArgs, end_when_asked};
use crate::report;
use remora_core::advanced::model::Mission;
use remora_flight::parts::is_flown_in;
use remora_host::error::Error;
use remora_host::formats::{PlanFile, make_directory};
use remora_host::planning::PlanJob;
use remora_host::threads::Threads;
use remora_host::with_joints;
use std::path::{Path, PathBuf};

/// Fly a plan in a world that it does not know.
///
/// The truth has its own dynamics, orbit, actuators and sensors; guidance tracks the plan by what
/// navigation makes of them. What is judged is the end effector at the port.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json) made with rk4 [default: one is made of the scenario]
    #[arg(value_name = "PLAN", conflicts_with_all = ["scenarios", "id", "mission"])]
    plan: Option<PathBuf>,
    #[command(flatten)]
    scenario: ScenarioArgs,
    #[command(flatten)]
    mission: MissionArgs,
    #[command(flatten)]
    method: MethodArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    /// Errors of the world: a file (*.errors.toml), typical or none [default: none]
    #[arg(long, value_name = "FILE")]
    errors: Option<PathBuf>,
    #[command(flatten)]
    runs: RunsArgs,
    #[arg(long, value_name = "S", help = format!("{SEED} [default: 0]"))]
    seed: Option<u64>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    // Kept last: its heading holds for all options below it.
    #[command(flatten)]
    flying: FlyingArgs,
}

const AFTER_HELP: &str = "\
Examples:
  remora fly runs/pub-000.plan.json --out runs/flown
  remora errors --default > mine.errors.toml
  remora fly runs/pub-000.plan.json --errors mine.errors.toml --runs 200 --seed 3 --out runs/mine
  remora fly --id pub-007 --errors mine.errors.toml --runs 100 --controller replan --out runs/seven
  remora fly runs/pub-000.plan.json --errors mine.errors.toml --runs 5000 --part 3/50 --out shared
  remora fly --errors mine.errors.toml --runs 5000 --until 'miss_m<=0.02 p>=0.9973 conf>=0.95' --out runs/b

DIR gets the plan, flights.json (all that a run depends on), flights.parquet (a row a run),
flights.summary.json, flights.html, and history/RUN.jsonl and RUN.parquet of the runs that --keep names, a row a second
or with --history a row a step. The first twelve of these runs have pages/RUN.html, flown against planned in
three dimensions. Interrupt it at any time: the same command goes on where it stopped. Rows do not depend on the number of threads.
`remora rerun DIR --run N` flies one run again, with its history. With --part DIR gets a table of a share of the
runs, without histories, and programs on many machines may share it: `remora gather DIR` puts the parts together.

Exit status: 0 all captured (with --until: the share is shown), 1 some are not, 2 bad input.";

impl Args {
    /// How many runs it flies; none where it lists scenarios.
    pub(super) fn runs(&self) -> Option<u64> {
        (!self.scenario.list).then_some(self.runs.runs)
    }

    pub(super) fn run(self) -> Result<Output, Error> {
        end_when_asked();
        if let Some(list) = self.scenario.listed()? {
            return Ok(Output::data(list));
        }
        match self.plan.clone() {
            Some(file) => self.fly_file(&file),
            None => {
                let mission = self.mission.any()?;
                with_joints!(mission.joints(), NL => {
                    self.fly_scenario::<NL>(mission.of()?)
                } else {
                    Err(mission.wrong_joints())
                })
            }
        }
    }

    /// Flies the plan of a file, of which the folder gets a copy.
    fn fly_file(&self, file: &Path) -> Result<Output, Error> {
        let plan = PlanFile::read(file)?;
        if !plan.integrator.is_flown() {
            let reason = format!(
                "is {}: between its nodes the plan says nothing; plan with rk4",
                plan.integrator
            );
            return Err(Error::input(file, "integrator", reason));
        }
        let mission = &plan.inputs.mission;
        self.flying.check_orbit(&mission.target_orbit().map_err(|error| error.at(file))?)?;
        let joints = mission.joints();
        let errors = FlyingArgs::errors(self.errors.as_deref(), joints)?;
        let path = self.place(&plan.scenario)?;
        if !self.is_there(&path, &plan)? {
            plan.write(&self.out.join(&path))?;
        }
        self.fly(path, &plan, joints, errors)
    }

    /// Plans a scenario and flies the plan.
    fn fly_scenario<const NL: usize>(&self, mission: Mission<NL>) -> Result<Output, Error> {
        let method = self.method.method_until(&self.deadline);
        if !method.integrator.is_flown() {
            let reason = "euler plans say nothing between their nodes; fly rk4's";
            return Err(Error::argument("--integrator", reason));
        }
        self.flying.check_orbit(&mission.orbit)?;
        let errors = FlyingArgs::errors(self.errors.as_deref(), NL)?;
        let scenario = self.scenario.scenario(&self.mission, &mission, method.integrator)?;
        let path = Path::new("plans").join(format!("{}.plan.json", scenario.id));
        let out = self.out.join(&path);
        let (threads, model) = (Threads::default(), self.method.model()?);
        let job = PlanJob { scenario, mission, method, model, threads, is_scrubbed: false, out };
        if let Some(refusal) = job.refusal()? {
            return Ok(Output::new(report::refusal_report(&job.scenario.id, &refusal), false));
        }
        make_directory(&self.out.join("plans"))?;
        job.check_writable()?;
        let planned = job.plan()?;
        if !self.is_there(&path, &planned.file)? {
            job.write(&planned)?;
        }
        self.fly(path, &planned.file, NL, errors)
    }

    /// Whether flights of this plan have begun in the folder. Those of another would go on with it, and their table
    /// would hold runs of both.
    fn is_there(&self, path: &Path, plan: &PlanFile) -> Result<bool, Error> {
        let file = self.out.join(path);
        if !(is_flown_in(&self.out) && file.is_file()) {
            return Ok(false);
        }
        match PlanFile::read(&file)?.flies_as(plan) {
            true => Ok(true),
            false => {
                let reason =
                    "is another plan, of the flights that have begun there: choose another --out";
                Err(Error::Output { file, reason: reason.into() })
            }
        }
    }

    /// Where the plan of a scenario goes, from the folder.
    fn place(&self, id: &str) -> Result<PathBuf, Error> {
        make_directory(&self.out.join("plans"))?;
        Ok(Path::new("plans").join(format!("{id}.plan.json")))
    }

    fn fly(
        &self,
        plan: PathBuf,
        file: &PlanFile,
        joints: usize,
        errors: remora_truth::Errors,
    ) -> Result<Output, Error> {
        let ready = Ready {
            out: self.out.clone(),
            plans: vec![plan],
            joints,
            integrator: file.integrator,
            runs: (self.runs.runs, self.seed.unwrap_or(0)),
            jobs: self.jobs.jobs(),
        };
        if let Some(part) = self.part.part {
            let made = self.flying.fly_part(ready, errors, part)?;
            return Output::new(report::part_report(&made), true).or_json(self.json.json, &made);
        }
        let (results, is_well) = self.flying.fly(ready, errors)?;
        Output::new(report::flights_report(&results), is_well)
            .or_json(self.json.json, &results.summary)
    }
}
