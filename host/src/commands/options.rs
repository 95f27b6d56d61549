//! Options that several commands share.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use remora_core::advanced::model::Mission;
use remora_core::advanced::stages::LINKS;
use remora_host::choice::Choice;
use remora_host::error::Error;
use remora_host::formats::{NamedScenario, ScenarioSet, read_mission};
use remora_host::learned::Learned;
use remora_host::lineage::Lineage;
use remora_host::method::{Deadline, Integrator, Method, Mode, Qp, WarmStart};
use std::path::{Path, PathBuf};

/// Parses a choice by its names, which stand in the help.
pub(super) fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL.iter().map(|of| PossibleValue::new(of.name()).help(of.help()));
    PossibleValuesParser::new(values)
        .try_map(|name| T::of_name(&name).ok_or_else(|| format!("{name:?} is unknown")))
}

/// How plans are made.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct MethodArgs {
    /// What is asked of Stage 2
    #[arg(long, value_parser = choice::<Mode>(), default_value = "optimal")]
    mode: Mode,
    /// What Stage 2 starts from
    #[arg(long, value_parser = choice::<WarmStart>(), default_value = "auto")]
    warm_start: WarmStart,
    /// Learned model (*.model) [default: the built-in one for the integrator]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// euler, rk4 (8 substeps a node) or rk4:M with M >= 4
    #[arg(long, value_name = "NAME", default_value_t = Integrator::RK4)]
    integrator: Integrator,
    /// Solver of the convex subproblems
    #[arg(long, value_parser = choice::<Qp>(), default_value = "embedded")]
    qp: Qp,
}

impl MethodArgs {
    pub(super) fn method(&self) -> Method {
        let Self { mode, warm_start, integrator, qp, .. } = *self;
        Method { mode, warm_start, qp, integrator, deadline: None }
    }

    /// The method of plans that must end in time.
    pub(super) fn method_until(&self, deadline: Option<Deadline>) -> Method {
        Method { deadline, ..self.method() }
    }

    /// The model of a learned start, where one is asked for.
    pub(super) fn model(&self) -> Result<Option<Learned>, Error> {
        Learned::chosen(self.warm_start, self.model.as_deref(), self.integrator)
    }

    /// The same, for results over many scenarios: a model is not judged by what it or an ancestor
    /// has learnt from.
    pub(super) fn model_to_judge(
        &self,
        scenarios: &[NamedScenario],
    ) -> Result<Option<Learned>, Error> {
        let learned = self.model()?;
        let Some(model) = learned.as_ref().and_then(Learned::model) else { return Ok(learned) };
        let checksum = learned.as_ref().map_or(0, Learned::checksum);
        let provenance = &model.header().provenance;
        let name = learned.as_ref().map_or(String::new(), |learned| learned.record().name);
        let lineage = match &self.model {
            Some(file) => Lineage::beside(file, checksum, provenance)?,
            None => Lineage::of_header(&name, provenance),
        };
        if let Some(id) = lineage.learnt(scenarios) {
            let reason = format!(
                "{name} or a model that it descends from has learnt from {id}: choose another \
                 seed, or --warm-start heuristic"
            );
            return Err(Error::argument("--model", reason));
        }
        Ok(learned)
    }
}

/// One scenario.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ScenarioArgs {
    /// Scenario set (*.scenarios.json) [default: the built-in set]
    #[arg(long, value_name = "FILE")]
    scenarios: Option<PathBuf>,
    /// Scenario of the set [default: its first]
    #[arg(long)]
    id: Option<String>,
}

impl ScenarioArgs {
    pub(super) fn scenario(&self) -> Result<NamedScenario, Error> {
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

/// The mission.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct MissionArgs {
    /// Mission file (*.mission.toml) [default: the built-in mission]
    #[arg(long, value_name = "FILE")]
    mission: Option<PathBuf>,
}

impl MissionArgs {
    pub(super) fn mission(&self) -> Result<Mission<LINKS>, Error> {
        read_mission(self.mission.as_deref())
    }
}

/// The scenarios of a file, or so many drawn with a seed; none where neither is asked for.
pub(super) fn read_or_drawn(
    file: Option<&Path>,
    draw: Option<u64>,
    seed: Option<u64>,
    mission: &Mission<LINKS>,
) -> Result<Option<ScenarioSet>, Error> {
    match (file, draw, seed) {
        (Some(file), _, _) => ScenarioSet::read(file).map(Some),
        (None, Some(count), Some(seed)) => drawn(count, seed, mission).map(Some),
        (None, Some(_), None) => Err(Error::argument("--draw", "needs --seed S")),
        (None, None, Some(_)) => Err(Error::argument("--seed", "needs --draw N")),
        (None, None, None) => Ok(None),
    }
}

/// Scenarios `0..count` of a seed, for the mission.
pub(super) fn drawn(count: u64, seed: u64, mission: &Mission<LINKS>) -> Result<ScenarioSet, Error> {
    remora_host::draw::draw(count, seed, mission).ok_or_else(|| {
        Error::argument("--mission", "its geometry lets no start satisfy keep-out and pointing")
    })
}
