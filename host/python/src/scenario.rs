//! Scenarios: drawn, read, or given by their numbers.

use crate::argument::Argument;
use crate::arrays;
use crate::mission::Mission;
use crate::raised::{argument, wrong};
use crate::waiting::waited;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyList;
use remora_host::draw::{MAX_COUNT, draw_one};
use remora_host::formats::{
    NamedScenario, ScenarioSet, ServicerStart, TargetStart, check_id, json,
};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::path::PathBuf;

/// One approach: how the target tumbles, where the servicer starts, and how long it has.
///
/// Parameters
/// ----------
/// position : the system's centre of mass at the start, RTN [m].
/// target_attitude : of the target's body in RTN, x y z w, of unit length.
/// target_rate : the target's rate relative to RTN, in its body axes [rad/s].
/// velocity : of the system's centre of mass relative to RTN [m/s].
/// id : a name, fit for a file's.
/// bus_attitude : of the bus in RTN, x y z w; None turns the boresight towards the target.
/// bus_rate : the bus's rate relative to RTN, in RTN [rad/s]; None is at rest.
/// joint_angle : joint angles [rad]; None is the mission's.
/// joint_rate : joint rates [rad/s]; None is at rest.
/// duration_s : time to capture [s]; None is the mission's.
/// nodes : number of nodes; None is the mission's.
///
/// Raises
/// ------
/// ValueError : an argument that makes no sense, by its name.
#[pyclass(frozen, from_py_object, module = "remora")]
#[derive(Clone)]
pub(crate) struct Scenario {
    pub(crate) named: NamedScenario,
}

impl From<NamedScenario> for Scenario {
    fn from(named: NamedScenario) -> Self {
        Self { named }
    }
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (*, position, target_attitude=None, target_rate=None, velocity=None, id=None,
                        bus_attitude=None, bus_rate=None, joint_angle=None, joint_rate=None,
                        duration_s=None, nodes=None),
           text_signature = "(*, position, target_attitude=(0.0, 0.0, 0.0, 1.0), target_rate=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), id='scenario', bus_attitude=None, bus_rate=None, joint_angle=None, joint_rate=None, duration_s=None, nodes=None)")]
    #[expect(clippy::too_many_arguments, reason = "keywords, nearly each of them optional")]
    fn new(
        position: Argument<[f64; 3]>,
        target_attitude: Option<Argument<[f64; 4]>>,
        target_rate: Option<Argument<[f64; 3]>>,
        velocity: Option<Argument<[f64; 3]>>,
        id: Option<Argument<String>>,
        bus_attitude: Option<Argument<[f64; 4]>>,
        bus_rate: Option<Argument<[f64; 3]>>,
        joint_angle: Option<Argument<Vec<f64>>>,
        joint_rate: Option<Argument<Vec<f64>>>,
        duration_s: Option<Argument<f64>>,
        nodes: Option<Argument<usize>>,
    ) -> PyResult<Self> {
        let named = NamedScenario {
            id: Argument::or(id, "id", "scenario".into())?,
            target: TargetStart {
                attitude: Argument::or(target_attitude, "target_attitude", [0.0, 0.0, 0.0, 1.0])?,
                rate: Argument::or(target_rate, "target_rate", [0.0; 3])?,
            },
            servicer: ServicerStart {
                position: position.named("position")?,
                velocity: Argument::or(velocity, "velocity", [0.0; 3])?,
                bus_attitude_body_to_rtn: Argument::optional(bus_attitude, "bus_attitude")?,
                bus_rate_rtn_rad_s: Argument::optional(bus_rate, "bus_rate")?,
                joint_angle_rad: Argument::optional(joint_angle, "joint_angle")?,
                joint_rate_rad_s: Argument::optional(joint_rate, "joint_rate")?,
            },
            duration_s: Argument::optional(duration_s, "duration_s")?,
            nodes: Argument::optional(nodes, "nodes")?,
        };
        let checked = check_id(&named.id, || "id".into()).and_then(|()| named.validate());
        checked.map_err(|error| wrong("scenario", &error))?;
        Ok(Self { named })
    }

    /// Its name.
    #[getter]
    fn id(&self) -> &str {
        &self.named.id
    }

    /// The target's attitude at the start, body to RTN, x y z w.
    #[getter]
    fn target_attitude<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.named.target.attitude)
    }

    /// Its rate relative to RTN, in its body axes [rad/s].
    #[getter]
    fn target_rate<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.named.target.rate)
    }

    /// The system's centre of mass at the start, RTN [m].
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.named.servicer.position)
    }

    /// Its velocity relative to RTN [m/s].
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arrays::vector(py, &self.named.servicer.velocity)
    }

    /// Time to capture [s]; None: the mission's.
    #[getter]
    fn duration_s(&self) -> Option<f64> {
        self.named.duration_s
    }

    /// Number of nodes; None: the mission's.
    #[getter]
    fn nodes(&self) -> Option<usize> {
        self.named.nodes
    }

    fn __repr__(&self) -> String {
        format!("<remora.Scenario {}>", self.named.id)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("remora.notebook")?.call_method1("scenario", (slf,))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.named == other.named
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        hash(&self.named, &mut hasher);
        hasher.finish()
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let parse = py.get_type::<Self>().getattr("_of_text")?.unbind();
        let text =
            serde_json::to_string(&self.named).map_err(|error| argument("scenario", error))?;
        Ok((parse, (text,)))
    }

    /// The scenario of a pickle.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Self> {
        let named = json::parse_value(text.as_bytes())
            .map_err(|error| argument("scenario", error.reason))?;
        Ok(Self { named })
    }
}

/// Hashes a scenario. Equal scenarios have equal hashes, with zeros of either sign.
fn hash(named: &NamedScenario, hasher: &mut impl Hasher) {
    // Destructured, so that no new field is forgotten.
    let NamedScenario { id, target, servicer, duration_s, nodes } = named;
    let ServicerStart {
        position,
        velocity,
        bus_attitude_body_to_rtn,
        bus_rate_rtn_rad_s,
        joint_angle_rad,
        joint_rate_rad_s,
    } = servicer;
    (id, nodes).hash(hasher);
    let given: [Option<&[f64]>; 9] = [
        Some(&target.attitude),
        Some(&target.rate),
        Some(position),
        Some(velocity),
        bus_attitude_body_to_rtn.as_ref().map(|numbers| &numbers[..]),
        bus_rate_rtn_rad_s.as_ref().map(|numbers| &numbers[..]),
        joint_angle_rad.as_deref(),
        joint_rate_rad_s.as_deref(),
        duration_s.as_ref().map(std::slice::from_ref),
    ];
    for numbers in given {
        let bits = numbers.map(|of| of.iter().map(|x| (x + 0.0).to_bits()).collect::<Vec<_>>());
        bits.hash(hasher);
    }
}

/// Draws scenarios, for `remora.draw`. Signals are answered between groups of them.
#[pyfunction]
#[pyo3(signature = (count, seed, mission))]
pub(crate) fn draw<'py>(
    py: Python<'py>,
    count: Argument<u64>,
    seed: Argument<u64>,
    mission: Option<Argument<Mission>>,
) -> PyResult<Bound<'py, PyList>> {
    /// Scenarios that take a few milliseconds to draw.
    const GROUP: u64 = 1000;
    let (count, seed) = (count.named("count")?, seed.named("seed")?);
    if !(1..=MAX_COUNT).contains(&count) {
        return Err(argument("count", format!("must lie in [1, {MAX_COUNT}]")));
    }
    let mission = Mission::or_default(Argument::optional(mission, "mission")?)?;
    let drawn = PyList::empty(py);
    for first in (0..count).step_by(GROUP as usize) {
        let group = first..count.min(first + GROUP);
        for scenario in py.detach(|| draw_group(seed, group, &mission))? {
            drawn.append(scenario)?;
        }
        py.check_signals()?;
    }
    Ok(drawn)
}

fn draw_group(seed: u64, group: Range<u64>, mission: &Mission) -> PyResult<Vec<Scenario>> {
    let draw = |index| draw_one(seed, index, mission.judged()).map(Scenario::from);
    group.map(draw).collect::<Option<_>>().ok_or_else(|| {
        argument("mission", "its geometry lets no start satisfy keep-out and pointing")
    })
}

/// Reads scenarios, for `remora.scenarios`.
#[pyfunction]
#[pyo3(signature = (path))]
pub(crate) fn scenarios(
    py: Python<'_>,
    path: Option<Argument<PathBuf>>,
) -> PyResult<Vec<Scenario>> {
    let path = Argument::optional(path, "path")?;
    waited(py, move |_| {
        let set = path.map_or_else(ScenarioSet::built_in, |path| ScenarioSet::read(&path))?;
        Ok(set.scenarios.into_iter().map(Scenario::from).collect())
    })
}
