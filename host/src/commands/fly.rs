//! `remora fly`

use super::Output;
use super::flying::{FlyingArgs, Ready};
use super::options::{
    DeadlineArgs, JobsArgs, JsonArgs, MethodArgs, MissionArgs, SEED, ScenarioArgs, choice,
};
use super::parts::{PartArgs, end_when_asked};
use super::rerun::rerun;
use super::safety::{self, Safety};
use crate::report;
use remora_flight::flights_file::MAX_RUNS;
use remora_flight::parts::is_flown_in;
use remora_host::campaign::plans_of;
use remora_host::error::Error;
use remora_host::formats::{PlanFile, make_directory};
use remora_host::memory::on_large_stack;
use remora_host::planning::{Planner, check_writable};
use std::path::{Path, PathBuf};

/// Fly a plan in a world that it does not know.
///
/// The truth has its own dynamics, orbit, actuators and sensors; guidance tracks the plan by what
/// navigation makes of them. What is judged is the end effector at the port.
///
/// With --safety: says for each node of a plan what becomes of the approach if it must end there. Two ways
/// out: the abort that guidance flies, and a free drift of one orbit. The first node from which the abort
/// does not leave the target clear is the point of no return.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Plan file (*.plan.json) made with rk4, or folder of a campaign with plans; with --rerun the folder
    /// of the flights [default: a plan is made of the scenario]
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
    /// Runs of each plan, each with a draw of errors of its own
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_RUNS))]
    runs: u64,
    #[arg(long, value_name = "S", help = format!("{SEED} [default: 0]"))]
    seed: Option<u64>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    jobs: JobsArgs,
    #[command(flatten)]
    json: JsonArgs,
    /// Say for each node of the plan whether the approach can still be left
    #[arg(long, value_name = "WORLD", value_parser = choice::<Safety>(), requires = "plan")]
    #[arg(conflicts_with_all = OF_FLIGHTS)]
    safety: Option<Safety>,
    /// Fly this run of the folder again, with its history: the same bits
    #[arg(long, value_name = "RUN", requires = "plan", conflicts_with_all = OF_FLIGHTS)]
    #[arg(conflicts_with_all = ["errors", "seed", "jobs", "safety"])]
    rerun: Option<u64>,
    /// Directory of the results; made where it does not exist
    #[arg(long, value_name = "DIR", value_hint = clap::ValueHint::DirPath, required_unless_present_any = ["safety", "rerun", "list"])]
    out: Option<PathBuf>,
    // Kept last: its heading holds for all options below it.
    #[command(flatten)]
    flying: FlyingArgs,
}

/// Options of flights, which have no use where none are begun.
const OF_FLIGHTS: [&str; 21] = [
    "scenarios",
    "id",
    "list",
    "mission",
    "mode",
    "warm_start",
    "model",
    "integrator",
    "qp",
    "deadline",
    "runs",
    "part",
    "out",
    "controller",
    "joints",
    "guidance_rate",
    "camera",
    "gravity",
    "until",
    "write",
    "keep",
];

const AFTER_HELP: &str = "\
Examples:
  remora fly runs/pub-000.plan.json --out runs/flown
  remora mission errors typical > mine.errors.toml
  remora fly runs/pub-000.plan.json --errors mine.errors.toml --runs 200 --seed 3 --out runs/mine
  remora fly --id pub-007 --errors mine.errors.toml --runs 100 --controller replan --out runs/seven
  remora fly runs/pub-000.plan.json --errors mine.errors.toml --runs 5000 --part 3/50 --out shared
  remora fly --errors mine.errors.toml --runs 5000 --until 'miss_m<=0.02 p>=0.9973 conf>=0.95' --out runs/b
  remora fly runs/a --errors mine.errors.toml --runs 4 --seed 1 --out runs/a
  remora fly runs/mine --rerun 17
  remora fly runs/pub-000.plan.json --safety planned
  remora fly runs/pub-000.plan.json --safety flown --errors mine.errors.toml --seed 3

DIR gets the plan, flights.json (all that a run depends on), flights.parquet (a row a run),
flights.summary.json, flights.html, and history/RUN.jsonl and RUN.parquet of the runs that --keep names, a row a second
or with --write steps a row a step. The first twelve of these runs have pages/RUN.html, flown against planned in
three dimensions. Interrupt it at any time: the same command goes on where it stopped. Rows do not depend on the number of threads.
`remora fly DIR --rerun N` flies one run again, with its history. With --part DIR gets a table of a share of the
runs, without histories, and programs on many machines may share it: `remora campaign gather DIR` puts the parts
together.

The folder of a campaign that has ended and was asked for --write plans flies all of its plans, in the order of
their scenarios, each --runs times. --out may be the same folder, which then gets the flights too.

Exit status: 0 all captured (with --until: the share is shown; with --safety: every abort leaves the target
clear; with --rerun: flown again), 1 some are not, 2 bad input.";

impl Args {
    pub(super) fn run(self) -> Result<Output, Error> {
        match (self.plan.as_deref(), self.rerun, self.safety) {
            (Some(folder), Some(run), _) => rerun(folder, run, self.json),
            (Some(plan), _, Some(safety)) => {
                let (errors, seed) = (self.errors.as_deref(), self.seed);
                let (jobs, json) = (self.jobs.jobs(), self.json);
                safety::Request { plan, safety, errors, seed, jobs, json }.run()
            }
            (plan, ..) => self.fly_any(plan),
        }
    }

    fn fly_any(&self, plan: Option<&Path>) -> Result<Output, Error> {
        end_when_asked();
        if let Some(list) = self.scenario.listed()? {
            return Ok(Output::data(list));
        }
        match plan {
            Some(folder) if folder.is_dir() => self.fly_folder(folder),
            Some(file) => self.fly_file(file),
            None => self.fly_scenario(),
        }
    }

    /// The folder of the results.
    fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    /// Flies the plan of a file, of which the folder gets a copy.
    fn fly_file(&self, file: &Path) -> Result<Output, Error> {
        let (plan, joints) = self.plan_to_fly(file)?;
        let errors = FlyingArgs::errors(self.errors.as_deref(), joints)?;
        let path = self.place(&plan.scenario)?;
        self.copy(&path, &plan)?;
        self.fly(vec![path], &plan, joints, errors)
    }

    /// Flies all plans of a campaign, of which the folder gets copies unless it is the campaign's.
    fn fly_folder(&self, campaign: &Path) -> Result<Output, Error> {
        let paths = plans_of(campaign)?;
        let Some(first) = paths.first() else {
            return Err(Error::input(campaign, "plans", "holds none: all scenarios were refused"));
        };
        let (plan, joints) = self.plan_to_fly(&campaign.join(first))?;
        let errors = FlyingArgs::errors(self.errors.as_deref(), joints)?;
        let is_same = |out: PathBuf| campaign.canonicalize().is_ok_and(|from| from == out);
        if !self.out().canonicalize().is_ok_and(is_same) {
            make_directory(&self.out().join("plans"))?;
            for path in &paths {
                self.copy(path, &PlanFile::read(&campaign.join(path))?)?;
            }
        }
        self.fly(paths, &plan, joints, errors)
    }

    /// The plan of a file, if it can be flown, and the joints of its arm.
    fn plan_to_fly(&self, file: &Path) -> Result<(PlanFile, usize), Error> {
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
        Ok((plan, joints))
    }

    /// Writes a plan into the folder of the results, unless it is there.
    fn copy(&self, path: &Path, plan: &PlanFile) -> Result<(), Error> {
        match self.is_there(path, plan)? {
            true => Ok(()),
            false => plan.write(&self.out().join(path)),
        }
    }

    /// Plans a scenario and flies the plan.
    fn fly_scenario(&self) -> Result<Output, Error> {
        let mission = self.mission.mission()?;
        let joints = mission.joints();
        let integrator = self.method.integrator();
        if !integrator.is_flown() {
            let reason = "euler plans say nothing between their nodes; fly rk4's";
            return Err(Error::argument("--integrator", reason));
        }
        self.flying.check_orbit(&mission.orbit)?;
        let errors = FlyingArgs::errors(self.errors.as_deref(), joints)?;
        let scenario = self.scenario.scenario(&self.mission, &mission, integrator)?;
        let path = Path::new("plans").join(format!("{}.plan.json", scenario.id));
        let out = self.out().join(&path);
        let request = self.method.request(mission, self.deadline.deadline)?;
        if let Some(refusal) = request.refusal(&scenario)? {
            return Ok(Output::new(report::refusal_report(&scenario.id, &refusal), false));
        }
        make_directory(&self.out().join("plans"))?;
        check_writable(&out)?;
        let planned = on_large_stack(|| Planner::new().plan(&request, &scenario))?;
        if !self.is_there(&path, &planned.file)? {
            planned.write(&out)?;
        }
        self.fly(vec![path], &planned.file, joints, errors)
    }

    /// Whether flights of this plan have begun in the folder. Those of another would go on with it, and their table
    /// would hold runs of both.
    fn is_there(&self, path: &Path, plan: &PlanFile) -> Result<bool, Error> {
        let file = self.out().join(path);
        if !(is_flown_in(self.out()) && file.is_file()) {
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
        make_directory(&self.out().join("plans"))?;
        Ok(Path::new("plans").join(format!("{id}.plan.json")))
    }

    fn fly(
        &self,
        plans: Vec<PathBuf>,
        first: &PlanFile,
        joints: usize,
        errors: remora_truth::Errors,
    ) -> Result<Output, Error> {
        let ready = Ready {
            out: self.out().into(),
            plans,
            joints,
            integrator: first.integrator,
            runs: (self.runs, self.seed.unwrap_or(0)),
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
