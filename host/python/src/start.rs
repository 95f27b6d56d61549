//! Initial guess of Stage 2: the heuristic, a model, or the caller's own.

use crate::argument::Argument;
use crate::arrays;
use crate::bench::Bench;
use crate::raised::{Failure, argument, raised};
use crate::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use remora_core::advanced::stages::size;
use remora_host::error::Error;
use remora_host::formats::{Limit, NamedScenario, read_bytes};
use remora_host::learned::Learned;
use remora_host::method::{Integrator, WarmStart};
use remora_host::request::{Guess, PlanRequest};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

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
    /// A guess of the library's.
    Ready(Guess),
    /// Torques, a row an interval.
    Torques { torques: Vec<f32>, shape: (usize, usize) },
    /// Asked for torques with the scene.
    Function(Arc<Py<PyAny>>),
}

/// The built-in model of an integrator, looked at once.
fn built_in(integrator: Integrator) -> Arc<Learned> {
    static MODELS: [OnceLock<Arc<Learned>>; 2] = [OnceLock::new(), OnceLock::new()];
    let model = &MODELS[usize::from(integrator.is_flown())];
    model.get_or_init(|| Arc::new(Learned::built_in(integrator))).clone()
}

/// Reason to refuse a guess of another kind.
const EXPECTED: &str = "is neither \"model\", \"heuristic\", a Model, a Plan, (Plan, seconds), an array of torques \
                        nor a function of a Scene";

impl Start {
    /// The rollout of the built-in model.
    pub(crate) fn built_in(integrator: Integrator) -> Self {
        Self::Ready(Guess::Model(built_in(integrator)))
    }

    /// The start that was given under a name; plans are none.
    pub(crate) fn of(
        name: &str,
        given: &Bound<'_, PyAny>,
        integrator: Integrator,
    ) -> PyResult<Self> {
        if let Ok(word) = given.extract::<String>() {
            return match word.as_str() {
                "heuristic" => Ok(Self::Ready(Guess::Heuristic)),
                "model" => Ok(Self::built_in(integrator)),
                _ => Err(argument(name, format!("{word:?} {EXPECTED}"))),
            };
        }
        if let Ok(model) = given.cast::<Model>() {
            return Ok(Self::Ready(Guess::Model(model.get().learned.clone())));
        }
        if given.is_callable() {
            return Ok(Self::Function(Arc::new(given.clone().unbind())));
        }
        let Ok(array) = arrays::array(given) else {
            return Err(argument(name, format!("{} {EXPECTED}", given.get_type())));
        };
        let shape = array.getattr("shape")?;
        match shape.extract::<(usize, usize)>() {
            // Whether it is the arm's is looked at where the plan is made.
            Ok(shape) => {
                let torques = arrays::numbers(name, &array, shape)?;
                Ok(Self::Torques { torques, shape })
            }
            Err(_) => {
                let reason = format!("has shape {shape}, expected a row of torques an interval");
                Err(argument(name, reason))
            }
        }
    }

    /// Argument `initial_guess` for it; none for the rest of a plan, which no argument can name.
    pub(crate) fn given<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(match self {
            Self::Ready(Guess::Heuristic) => Some("heuristic".into_pyobject(py)?.into_any()),
            Self::Ready(Guess::Model(learned)) => Some(Model::known(learned, py)?),
            Self::Torques { torques, shape } => {
                let rows: Vec<Vec<f64>> = torques
                    .chunks(shape.1.max(1))
                    .map(|row| row.iter().map(|x| f64::from(*x)).collect())
                    .collect();
                Some(arrays::matrix(py, &rows)?.into_any())
            }
            Self::Ready(_) | Self::Function(_) => None,
        })
    }

    /// The method's name for it.
    pub(crate) fn warm_start(&self) -> WarmStart {
        match self {
            Self::Ready(Guess::Model(_)) => WarmStart::Model,
            _ => WarmStart::Heuristic,
        }
    }

    /// The guess as the library takes it, and the start that makes it again: a function's answer for a
    /// function.
    pub(crate) fn guess(
        &self,
        bench: &mut Bench<'_>,
        request: &PlanRequest,
        scenario: &NamedScenario,
    ) -> Result<(Guess, Self), Failure> {
        if let Self::Ready(guess) = self {
            return Ok((guess.clone(), self.clone()));
        }
        let approach = bench.approach(request, scenario)?;
        let shape = (approach.nodes() - 1, size::controls(request.mission.joints()));
        let torques = match self {
            Self::Function(function) => {
                let (function, scene) =
                    (function.clone(), Scene::new(approach.clone(), scenario.clone()));
                bench.caller.call(move |py| {
                    let answer = function.call1(py, (scene,))?;
                    arrays::numbers("initial_guess", answer.bind(py), shape)
                })?
            }
            Self::Torques { torques, shape: found } if *found == shape => torques.clone(),
            _ => {
                let reason = format!("the plan needs torques of shape {shape:?}");
                return Err(argument("initial_guess", reason).into());
            }
        };
        let motion = approach.roll_out(&torques);
        Ok((Guess::Given(Arc::new(motion)), Self::Torques { torques, shape }))
    }
}
