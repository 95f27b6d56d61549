//! Scenarios: drawn, read, or given by their numbers.

use crate::arrays;
use crate::mission::Mission;
use crate::raised::{argument, raised, wrong};
use numpy::PyArray1;
use pyo3::prelude::*;
use remora_host::draw::{MAX_COUNT, draw as drawn};
use remora_host::formats::{NamedScenario, ScenarioSet, ServicerStart, TargetStart, check_id};
use remora_host::with_joints;
use std::path::PathBuf;

/// One approach: how the target tumbles, where the servicer starts, and how long it has.
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
    #[pyo3(signature = (*, position, target_attitude=[0.0, 0.0, 0.0, 1.0], target_rate=[0.0; 3],
                        velocity=[0.0; 3], id="scenario".to_string(), bus_attitude=None, bus_rate=None,
                        joint_angle=None, joint_rate=None, duration_s=None, nodes=None),
           text_signature = "(*, position, target_attitude=(0.0, 0.0, 0.0, 1.0), target_rate=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), id='scenario', bus_attitude=None, bus_rate=None, joint_angle=None, joint_rate=None, duration_s=None, nodes=None)")]
    #[expect(clippy::too_many_arguments, reason = "keywords, nearly each of them optional")]
    fn new(
        position: [f64; 3],
        target_attitude: [f64; 4],
        target_rate: [f64; 3],
        velocity: [f64; 3],
        id: String,
        bus_attitude: Option<[f64; 4]>,
        bus_rate: Option<[f64; 3]>,
        joint_angle: Option<Vec<f64>>,
        joint_rate: Option<Vec<f64>>,
        duration_s: Option<f64>,
        nodes: Option<usize>,
    ) -> PyResult<Self> {
        let named = NamedScenario {
            id,
            target: TargetStart { attitude: target_attitude, rate: target_rate },
            servicer: ServicerStart {
                position,
                velocity,
                bus_attitude_body_to_rtn: bus_attitude,
                bus_rate_rtn_rad_s: bus_rate,
                joint_angle_rad: joint_angle,
                joint_rate_rad_s: joint_rate,
            },
            duration_s,
            nodes,
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

    fn __eq__(&self, other: &Self) -> bool {
        self.named == other.named
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let parse = py.get_type::<Self>().getattr("_of_text")?.unbind();
        let set = ScenarioSet::new(vec![self.named.clone()]);
        let text = serde_json::to_string(&set).map_err(|error| argument("scenario", error))?;
        Ok((parse, (text,)))
    }

    /// The first scenario of a set's text.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Self> {
        let set = ScenarioSet::parse(text).map_err(|error| wrong("scenario", &error))?;
        let first = set.scenarios.into_iter().next();
        first.map(Self::from).ok_or_else(|| argument("scenario", "is none"))
    }
}

/// Scenarios 0 to `count` of a seed, drawn from the mission's ranges: the same everywhere.
#[pyfunction]
#[pyo3(signature = (count, seed=1, mission=None))]
pub(crate) fn draw(
    py: Python<'_>,
    count: u64,
    seed: u64,
    mission: Option<Mission>,
) -> PyResult<Vec<Scenario>> {
    if !(1..=MAX_COUNT).contains(&count) {
        return Err(argument("count", format!("must lie in [1, {MAX_COUNT}]")));
    }
    let mission = Mission::or_default(mission)?;
    let set = with_joints!(mission.joints(), NL => {
        let mission = mission.of::<NL>().map_err(raised)?;
        py.detach(|| drawn(count, seed, mission))
    } else { None });
    let reason = "its geometry lets no start satisfy keep-out and pointing";
    let set = set.ok_or_else(|| argument("mission", reason))?;
    Ok(set.scenarios.into_iter().map(Scenario::from).collect())
}

/// The scenarios of a set (`*.scenarios.json`), or the sixty built-in ones.
#[pyfunction]
#[pyo3(signature = (path=None))]
pub(crate) fn scenarios(path: Option<PathBuf>) -> PyResult<Vec<Scenario>> {
    let set = path.map_or_else(ScenarioSet::built_in, |path| ScenarioSet::read(&path));
    Ok(set.map_err(raised)?.scenarios.into_iter().map(Scenario::from).collect())
}
