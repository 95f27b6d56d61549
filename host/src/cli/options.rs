//! Options that several commands share: the same name, meaning, default and help everywhere.

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use remora_core::advanced::stages::{LINKS, NODES};
use remora_host::choice::Choice;
use remora_host::draw::MAX_COUNT;
use remora_host::error::Error;
use remora_host::formats::{Mission, NamedScenario, ScenarioSet, check_arm, read_mission};
use remora_host::lineage::Lineage;
use remora_host::method::{Deadline, Integrator, Method, Mode, Qp, WarmStart};
use remora_host::parts::Scenarios;
use remora_host::request::PlanRequest;
use std::ffi::OsStr;
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Help of `--count`, wherever scenarios are drawn.
pub const COUNT: &str = "Number of scenarios to draw";
/// Help of `--seed`.
pub const SEED: &str = "Seed of the draw";
/// Help of `--write`, wherever more than the results can be written.
pub const WRITE: &str = "Files to write too, with commas";

/// Parses a choice by its names, which stand in the help.
pub fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL.iter().map(|of| PossibleValue::new(of.name()).help(of.help()));
    PossibleValuesParser::new(values)
        .try_map(|name| T::of_name(&name).ok_or_else(|| format!("{name:?} is unknown")))
}

/// Discretisation of Stage 2.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct IntegratorArgs {
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4
    #[arg(long, value_name = "NAME", default_value_t = Integrator::RK4)]
    pub integrator: Integrator,
}

/// How plans are made.
#[derive(Clone, Debug, clap::Args)]
pub struct MethodArgs {
    /// Mode of Stage 2
    #[arg(long, value_parser = choice::<Mode>(), default_value = "optimal")]
    mode: Mode,
    /// Initial guess of Stage 2
    #[arg(long, value_parser = choice::<WarmStart>(), default_value = "auto")]
    warm_start: WarmStart,
    /// Learned model (*.model) [default: the built-in one for the integrator]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    #[command(flatten)]
    integrator: IntegratorArgs,
    /// Solver of the convex subproblems
    #[arg(long, value_parser = choice::<Qp>(), default_value = "embedded")]
    qp: Qp,
}

impl MethodArgs {
    /// Discretisation of Stage 2.
    pub fn integrator(&self) -> Integrator {
        self.integrator.integrator
    }

    /// The request for plans of a mission, which end in time where a deadline is given.
    pub fn request(
        &self,
        mission: Mission,
        deadline: Option<Deadline>,
    ) -> Result<PlanRequest, Error> {
        let (integrator, sharp) = (self.integrator(), false);
        let Self { mode, warm_start, qp, .. } = *self;
        let method = Method { mode, warm_start, qp, integrator, deadline, sharp };
        PlanRequest::new(mission, method, self.model.as_deref())
    }

    /// The request of results over many scenarios. Refuses a model that has learnt from any of them,
    /// itself or an ancestor.
    pub fn request_to_judge(
        &self,
        mission: Mission,
        deadline: Option<Deadline>,
        scenarios: &[NamedScenario],
    ) -> Result<PlanRequest, Error> {
        let request = self.request(mission, deadline)?;
        let Some(learned) = request.guess.model() else { return Ok(request) };
        let Some(model) = learned.model() else { return Ok(request) };
        let (name, provenance) = (learned.record().name, &model.header().provenance);
        let lineage = match &self.model {
            Some(file) => Lineage::beside(file, learned.checksum(), provenance)?,
            None => Lineage::of_header(&name, provenance),
        };
        if let Some(id) = lineage.learnt(scenarios) {
            let reason = format!(
                "{name} or a model that it descends from has learnt from {id}: choose another \
                 seed, or --warm-start heuristic"
            );
            return Err(Error::argument("--model", reason));
        }
        Ok(request)
    }
}

/// When plans must have ended.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct DeadlineArgs {
    /// Time for each plan, a positive number; past it the best iterate is kept, so that results
    /// depend on the machine and its load [default: none]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub deadline: Option<Deadline>,
}

/// Ids of the built-in set, for completions.
static BUILT_IN_IDS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let scenarios = ScenarioSet::built_in().map_or(Vec::new(), |set| set.scenarios);
    scenarios.into_iter().map(|scenario| scenario.id).collect()
});

/// Parses any id; completions offer those of the built-in set.
#[derive(Clone)]
struct ScenarioId;

impl TypedValueParser for ScenarioId {
    type Value = String;

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(BUILT_IN_IDS.iter().map(|id| PossibleValue::new(id.as_str()))))
    }
}

/// One scenario of a set.
#[derive(Clone, Debug, clap::Args)]
pub struct ScenarioArgs {
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    /// Scenario of the set [default: its first; with --mission alone one drawn for that mission, s1-000]
    #[arg(long, value_name = "ID", value_parser = ScenarioId, hide_possible_values = true)]
    id: Option<String>,
    /// List the scenarios of the set and end
    #[arg(long, conflicts_with = "id")]
    pub list: bool,
}

impl ScenarioArgs {
    /// The list of the set, where that is asked for.
    pub fn listed(&self) -> Result<Option<String>, Error> {
        if !self.list {
            return Ok(None);
        }
        let mut text = String::new();
        for scenario in set_or_built_in(self.scenarios.as_deref())?.scenarios {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", scenario.id);
        }
        Ok(Some(text))
    }

    /// The scenario of the set, or for a mission alone the first drawn one that can be planned.
    pub fn scenario(
        &self,
        from: &MissionArgs,
        mission: &Mission,
        integrator: Integrator,
    ) -> Result<NamedScenario, Error> {
        if from.mission.is_some() && self.scenarios.is_none() && self.id.is_none() {
            return remora_host::draw::first(mission, integrator).ok_or_else(no_start);
        }
        let set = set_or_built_in(self.scenarios.as_deref())?;
        let found = match &self.id {
            Some(id) => set.get(id),
            None => set.scenarios.first(),
        };
        found.cloned().ok_or_else(|| {
            let file = self.scenarios.clone().unwrap_or_else(|| "built-in scenarios".into());
            let id = self.id.as_deref().unwrap_or_default();
            Error::input(&file, "scenarios", format!("there is no scenario with id {id:?}"))
        })
    }
}

/// The mission.
#[derive(Clone, Debug, clap::Args)]
pub struct MissionArgs {
    /// Mission file (*.mission.toml) [default: the built-in mission]
    #[arg(long, value_name = "FILE")]
    mission: Option<PathBuf>,
}

impl MissionArgs {
    /// The file; the built-in mission where there is none.
    pub fn file(&self) -> Option<&Path> {
        self.mission.as_deref()
    }

    /// The mission, judged.
    pub fn mission(&self) -> Result<Mission, Error> {
        read_mission(self.file())
    }

    /// The mission of a command whose plans have all the nodes of this build.
    pub fn of_all_nodes(&self) -> Result<Mission, Error> {
        of_all_nodes(self.mission()?, self.file())
    }

    /// The mission of a command that is for arms like the built-in mission's.
    pub fn of_default_arm(&self) -> Result<Mission, Error> {
        let mission = self.mission()?;
        check_arm(mission.joints(), LINKS).map_err(|error| error.at(name_of(self.file())))?;
        Ok(mission)
    }
}

/// The mission of a file, where its plans have all the nodes of this build: what trajectories are recorded
/// for and models are made for.
pub fn of_all_nodes(mission: Mission, file: Option<&Path>) -> Result<Mission, Error> {
    match mission.approach.nodes {
        NODES => Ok(mission),
        nodes => {
            let reason = format!("is {nodes}; this command needs {NODES}");
            Err(Error::input(name_of(file), "horizon.nodes", reason))
        }
    }
}

/// Name of a mission's file in messages.
fn name_of(file: Option<&Path>) -> &Path {
    file.unwrap_or(Path::new("built-in mission"))
}

/// Scenarios of a file, or drawn.
#[derive(Clone, Debug, clap::Args)]
pub struct SetArgs {
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["count", "seed"])]
    scenarios: Option<PathBuf>,
    #[arg(long, value_name = "N", help = format!("{COUNT} [default: none]"))]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_COUNT))]
    count: Option<u64>,
    #[arg(long, value_name = "S", help = format!("{SEED} [default: none]"))]
    seed: Option<u64>,
}

/// Scenarios and where they come from.
pub struct Chosen {
    /// The scenarios.
    pub scenarios: Vec<NamedScenario>,
    /// The seed of the draw, where they were drawn.
    pub seed: Option<u64>,
}

impl SetArgs {
    /// How many are to be drawn.
    pub fn count(&self) -> Option<u64> {
        self.count
    }

    /// How many are to be drawn, by which seed.
    fn draw(&self) -> Result<Option<(u64, u64)>, Error> {
        match (self.count, self.seed) {
            (Some(_), None) => Err(Error::argument("--count", "needs --seed S")),
            (None, Some(_)) => Err(Error::argument("--seed", "needs --count N")),
            (count, seed) => Ok(count.zip(seed)),
        }
    }

    /// The scenarios of the file, of the draw, or of the built-in set.
    pub fn chosen(&self, mission: &Mission) -> Result<Chosen, Error> {
        let set = match self.draw()? {
            Some((count, seed)) => drawn(count, seed, mission)?,
            None => set_or_built_in(self.scenarios.as_deref())?,
        };
        Ok(Chosen { scenarios: set.scenarios, seed: self.seed })
    }

    /// Source of the scenarios, without drawing them all.
    pub fn source(&self, mission: &Mission) -> Result<Scenarios, Error> {
        match (self.count, self.seed) {
            (Some(count), Some(seed)) => {
                drawn(1, seed, mission).map(|_| Scenarios::Drawn { seed, count })
            }
            _ => self.chosen(mission).map(|chosen| Scenarios::Listed(chosen.scenarios)),
        }
    }
}

/// The scenarios of a file, or the built-in ones.
pub fn set_or_built_in(file: Option<&Path>) -> Result<ScenarioSet, Error> {
    file.map_or_else(ScenarioSet::built_in, ScenarioSet::read)
}

/// Scenarios `0..count` of a seed, for the mission.
pub fn drawn(count: u64, seed: u64, mission: &Mission) -> Result<ScenarioSet, Error> {
    remora_host::draw::draw(count, seed, mission).ok_or_else(no_start)
}

fn no_start() -> Error {
    Error::argument("--mission", "its geometry lets no start satisfy keep-out and pointing")
}

/// A number of threads; each has a stack and memory of its own.
pub fn jobs() -> impl TypedValueParser<Value = NonZeroUsize> {
    let jobs = clap::value_parser!(u16).range(1..=1024);
    jobs.map(|jobs| NonZeroUsize::new(jobs.into()).unwrap_or(NonZeroUsize::MIN))
}

/// How many threads work.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct JobsArgs {
    /// Worker threads [default: the machine's cores]
    #[arg(long, value_name = "J", value_parser = jobs())]
    jobs: Option<NonZeroUsize>,
}

impl JobsArgs {
    /// The number of threads.
    pub fn jobs(self) -> NonZeroUsize {
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        self.jobs.unwrap_or_else(cores)
    }
}

/// Option that silences reports.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct QuietArgs {
    /// Print no report and no progress, only errors and what was asked for as data
    #[arg(short, long, global = true)]
    pub quiet: bool,
}

/// Results as data.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct JsonArgs {
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    pub json: bool,
}

/// Option that lets files be replaced.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ForceArgs {
    /// Replace files that are there
    #[arg(long)]
    pub force: bool,
}

impl ForceArgs {
    /// Refuses to replace a file that is there.
    pub fn keep(self, file: &Path) -> Result<(), Error> {
        match !self.force && file.is_file() {
            true => Err(Error::Output { file: file.into(), reason: EXISTS.into() }),
            false => Ok(()),
        }
    }
}

/// Why a file is not replaced.
const EXISTS: &str = "exists; --force replaces it";

/// Whether a file stands for standard output.
pub fn is_stdout(file: &Path) -> bool {
    file.as_os_str() == "-"
}
