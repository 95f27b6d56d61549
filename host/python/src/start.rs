//! What Stage 2 starts from: the heuristic, a model, or the caller's own.

use crate::arrays;
use crate::raised::{Failure, argument, raised};
use crate::scene::Scene;
use pyo3::prelude::*;
use remora_core::advanced::model;
use remora_core::advanced::planner::Nominal;
use remora_core::advanced::stages::size;
use remora_host::approach::Approach;
use remora_host::formats::{MAX_JOINTS, NamedScenario};
use remora_host::guess::{self, Guess};
use remora_host::learned::Learned;
use remora_host::method::{Integrator, Method, WarmStart};
use remora_host::planning::{Planned, Planner, WallClock};
use std::path::PathBuf;
use std::sync::Arc;

/// A learned model of a file (`*.model`). It stays in memory until the interpreter ends.
#[pyclass(frozen, from_py_object, module = "remora")]
#[derive(Clone)]
pub(crate) struct Model {
    pub(crate) learned: Arc<Learned>,
}

#[pymethods]
impl Model {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        Ok(Self { learned: Arc::new(Learned::usable(&path).map_err(raised)?) })
    }

    /// Name of the file.
    #[getter]
    fn name(&self) -> String {
        self.learned.record().name
    }

    /// CRC-32 of the file's bytes but its own.
    #[getter]
    fn checksum(&self) -> String {
        self.learned.record().checksum
    }

    fn __repr__(&self) -> String {
        format!("<remora.Model {}>", self.learned.record().name)
    }
}

/// What Stage 2 is to start from.
#[derive(Clone)]
pub(crate) enum Start {
    Heuristic,
    Model(Arc<Learned>),
    /// Torques, a row an interval.
    Torques(Vec<f32>),
    /// Asked for torques with the scene.
    Function(Arc<Py<PyAny>>),
    /// What is left of a plan so many seconds after its first node: in a build with room for any arm.
    Left(Arc<Nominal<MAX_JOINTS>>, f64),
}

impl Start {
    /// The method's name for it.
    pub(crate) fn warm_start(&self) -> WarmStart {
        match self {
            Self::Model(_) => WarmStart::Model,
            _ => WarmStart::Heuristic,
        }
    }
}

/// Plans a scenario that is not refused; with the start that can be had again, a function's answer for a
/// function.
pub(crate) fn plan<const NL: usize>(
    planner: &mut Planner,
    mission: &model::Mission<NL>,
    scenario: &NamedScenario,
    method: &Method,
    start: &Start,
) -> Result<(Planned, Start), Failure> {
    with_guess(planner, mission, scenario, method.integrator, start, |planner, guess| {
        planner.plan_from(&WallClock::start(), mission, scenario, method, guess)
    })
}

/// Hands `work` the start as the library takes it.
pub(crate) fn with_guess<const NL: usize, T>(
    planner: &mut Planner,
    mission: &model::Mission<NL>,
    scenario: &NamedScenario,
    integrator: Integrator,
    start: &Start,
    work: impl FnOnce(&mut Planner, Guess<'_, NL>) -> T,
) -> Result<(T, Start), Failure> {
    match start {
        Start::Heuristic => return Ok((work(planner, Guess::Heuristic), start.clone())),
        Start::Model(model) => return Ok((work(planner, Guess::Model(model)), start.clone())),
        Start::Left(plan, elapsed) => {
            let (nodes, duration) = (plan.nodes, plan.duration);
            let reorientation = guess::resized(&plan.reorientation);
            let plan = Nominal { reorientation, nodes, duration };
            return Ok((work(planner, Guess::Left(&plan, *elapsed)), start.clone()));
        }
        Start::Torques(_) | Start::Function(_) => {}
    }
    let refused = |refusal| Failure::Refused(scenario.id.clone(), refusal);
    let approach = planner.approach(mission, scenario, integrator).map_err(refused)?;
    let torques = torques(start, &approach)?;
    let motion = approach.roll_out(&torques);
    Ok((work(planner, Guess::Given(&motion)), Start::Torques(torques)))
}

/// Torques that are given, or that a function answers, in the number that the approach needs.
fn torques<const NL: usize>(start: &Start, approach: &Approach<NL>) -> Result<Vec<f32>, Failure> {
    let shape = (approach.nodes() - 1, size::controls(NL));
    match start {
        Start::Function(function) => Python::attach(|py| {
            let scene = Scene::new(approach.clone());
            let answer = function.call1(py, (scene,))?;
            Ok(arrays::numbers("initial_guess", answer.bind(py), shape)?)
        }),
        Start::Torques(torques) if torques.len() == shape.0 * shape.1 => Ok(torques.clone()),
        _ => {
            let reason = format!("the plan needs torques of shape {shape:?}");
            Err(argument("initial_guess", reason).into())
        }
    }
}
