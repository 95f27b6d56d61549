//! Initial guess of Stage 2: the heuristic, a model, or the caller's own.

use crate::argument::Argument;
use crate::arrays;
use crate::planning::Bench;
use crate::raised::{Failure, argument, raised};
use crate::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use remora_core::advanced::planner::Nominal;
use remora_core::advanced::stages::size;
use remora_host::error::Error;
use remora_host::formats::{Limit, MAX_JOINTS, Mission, NamedScenario, read_bytes};
use remora_host::guess::Guess;
use remora_host::learned::Learned;
use remora_host::method::{Integrator, Method, WarmStart};
use remora_host::planning::{PlanOutcome, Planner};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Function that makes a model again, and its arguments: name and bytes.
type Pickle = (Py<PyAny>, (String, Py<PyBytes>));

/// A learned model of a file. It stays in memory until the interpreter ends.
///
/// Parameters
/// ----------
/// path : the file (`*.model`), such as `remora-train` makes.
///
/// Raises
/// ------
/// ValueError : a file that is no model, or one that cannot be used.
#[pyclass(frozen, from_py_object, module = "remora")]
#[derive(Clone)]
pub(crate) struct Model {
    pub(crate) learned: Arc<Learned>,
    bytes: &'static [u8],
}

/// Models in memory. Equal bytes are held once.
static KNOWN: Mutex<Vec<Model>> = Mutex::new(Vec::new());

impl Model {
    /// Finds a model of these bytes, or holds them from now on.
    fn of(name: &str, bytes: Vec<u8>, file: &Path) -> PyResult<Self> {
        let mut known = KNOWN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let is_it = |model: &&Self| *model.bytes == *bytes && model.name() == name;
        if let Some(model) = known.iter().find(is_it) {
            return Ok(model.clone());
        }
        let bytes: &'static [u8] = bytes.leak();
        let learned = Learned::new(name, bytes);
        if let Some(reason) = learned.refused() {
            return Err(raised(Error::input(file, "", reason)));
        }
        let model = Self { learned: Arc::new(learned), bytes };
        known.push(model.clone());
        Ok(model)
    }

    /// Argument for a model in memory: a model of a file, or the name of the built-in ones.
    fn known<'py>(learned: &Arc<Learned>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let known = KNOWN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let found = known.iter().find(|model| Arc::ptr_eq(&model.learned, learned)).cloned();
        Ok(match found {
            Some(model) => Bound::new(py, model)?.into_any(),
            None => "model".into_pyobject(py)?.into_any(),
        })
    }
}

#[pymethods]
impl Model {
    #[new]
    fn new(path: Argument<PathBuf>) -> PyResult<Self> {
        let path = path.named("path")?;
        let bytes = read_bytes(&path, Limit::BINARY).map_err(raised)?;
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        Self::of(&name, bytes, &path)
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

    fn __eq__(&self, other: &Self) -> bool {
        self.bytes == other.bytes && self.name() == other.name()
    }

    fn __hash__(&self) -> u64 {
        u64::from_str_radix(&self.checksum(), 16).unwrap_or(0)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<Pickle> {
        let read = py.get_type::<Self>().getattr("_of_bytes")?.unbind();
        Ok((read, (self.name(), PyBytes::new(py, self.bytes).unbind())))
    }

    /// The model of a pickle.
    #[staticmethod]
    fn _of_bytes(name: &str, bytes: Vec<u8>) -> PyResult<Self> {
        Self::of(name, bytes, Path::new(name))
    }
}

/// Initial guess of Stage 2.
#[derive(Clone)]
pub(crate) enum Start {
    Heuristic,
    Model(Arc<Learned>),
    /// Torques, a row an interval.
    Torques {
        torques: Vec<f32>,
        shape: (usize, usize),
    },
    /// Asked for torques with the scene.
    Function(Arc<Py<PyAny>>),
    /// The rest of a plan from a time after its first node [s].
    Left(Arc<Nominal<MAX_JOINTS>>, f64),
}

impl Start {
    /// Argument `initial_guess` for it; none for the rest of a plan, which no argument can name.
    pub(crate) fn given<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(match self {
            Self::Heuristic => Some("heuristic".into_pyobject(py)?.into_any()),
            Self::Model(learned) => Some(Model::known(learned, py)?),
            Self::Torques { torques, shape } => {
                let rows: Vec<Vec<f64>> = torques
                    .chunks(shape.1.max(1))
                    .map(|row| row.iter().map(|x| f64::from(*x)).collect())
                    .collect();
                Some(arrays::matrix(py, &rows)?.into_any())
            }
            Self::Function(_) | Self::Left(..) => None,
        })
    }

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
pub(crate) fn plan(
    bench: &mut Bench<'_>,
    mission: &Mission,
    scenario: &NamedScenario,
    method: &Method,
    start: &Start,
) -> Result<(PlanOutcome, Start), Failure> {
    let clock = bench.caller.clock();
    with_guess(bench, mission, scenario, method.integrator, start, |planner, guess| {
        planner.plan_from(&clock, mission, scenario, method, guess)
    })
}

/// Hands `work` the start as the library takes it.
pub(crate) fn with_guess<T>(
    bench: &mut Bench<'_>,
    mission: &Mission,
    scenario: &NamedScenario,
    integrator: Integrator,
    start: &Start,
    work: impl FnOnce(&mut Planner, Guess<'_>) -> T,
) -> Result<(T, Start), Failure> {
    let planner = &mut *bench.planner;
    match start {
        Start::Heuristic => return Ok((work(planner, Guess::Heuristic), start.clone())),
        Start::Model(model) => return Ok((work(planner, Guess::Model(model)), start.clone())),
        Start::Left(plan, elapsed) => {
            return Ok((work(planner, Guess::Left(plan, *elapsed)), start.clone()));
        }
        Start::Torques { .. } | Start::Function(_) => {}
    }
    let refused = |refusal| Failure::Refused(scenario.id.clone(), refusal);
    let approach = planner.approach(mission, scenario, integrator).map_err(refused)?;
    let shape = (approach.nodes() - 1, size::controls(mission.joints()));
    let torques = match start {
        Start::Function(function) => {
            let (function, scene) =
                (function.clone(), Scene::new(approach.clone(), scenario.clone()));
            bench.caller.call(move |py| {
                let answer = function.call1(py, (scene,))?;
                arrays::numbers("initial_guess", answer.bind(py), shape)
            })?
        }
        Start::Torques { torques, shape: found } if *found == shape => torques.clone(),
        _ => {
            let reason = format!("the plan needs torques of shape {shape:?}");
            return Err(argument("initial_guess", reason).into());
        }
    };
    let motion = approach.roll_out(&torques);
    let planned = work(&mut *bench.planner, Guess::Given(&motion));
    Ok((planned, Start::Torques { torques, shape }))
}
