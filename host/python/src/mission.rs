//! Missions of arms of any number of joints.

use crate::arrays;
use crate::raised::{raised, wrong};
use crate::urdf::{self, Said};
use numpy::PyArray1;
use pyo3::prelude::*;
use remora_core::advanced::model;
use remora_host::error::Error;
use remora_host::formats::{
    self, MissionFile, PLANNED_JOINTS, checksum_of_mission, read_mission_file,
};
use remora_host::with_joints;
use std::any::Any;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// A mission: target, orbit, servicer with its arm, limits, weights and tolerances.
#[pyclass(frozen, from_py_object, module = "remora")]
#[derive(Clone)]
pub(crate) struct Mission {
    file: Arc<MissionFile>,
    /// The core's mission of as many joints as the file's arm has.
    sized: Arc<dyn Any + Send + Sync>,
    checksum: String,
}

impl Mission {
    /// The mission of a file, judged; `name` is the file's.
    pub(crate) fn new(file: MissionFile, name: &Path) -> Result<Self, Error> {
        with_joints!(file.joints(), NL => {
            let mission = file.mission_of::<NL>().map_err(|error| error.at(name))?;
            let checksum = checksum_of_mission(&mission);
            Ok(Self { file: Arc::new(file), sized: Arc::new(mission), checksum })
        } else {
            Err(file.wrong_joints(PLANNED_JOINTS).at(name))
        })
    }

    /// The core's mission, asked for with the number of joints that it has.
    pub(crate) fn of<const NL: usize>(&self) -> Result<&model::Mission<NL>, Error> {
        self.sized.downcast_ref().ok_or_else(|| Error::Thread {
            reason: format!("a mission of {} joints is asked for with {NL}", self.joints()),
        })
    }

    /// The mission that a caller gave, or the built-in one.
    pub(crate) fn or_default(given: Option<Self>) -> PyResult<Self> {
        given.map_or_else(Self::default, Ok)
    }
}

#[pymethods]
impl Mission {
    /// The built-in mission.
    #[staticmethod]
    pub(crate) fn default() -> PyResult<Self> {
        static BUILT_IN: OnceLock<Mission> = OnceLock::new();
        if let Some(mission) = BUILT_IN.get() {
            return Ok(mission.clone());
        }
        let name = Path::new("built-in mission");
        let mission = Self::new(MissionFile::default(), name).map_err(raised)?;
        Ok(BUILT_IN.get_or_init(|| mission).clone())
    }

    /// The mission of a file (`*.mission.toml`).
    #[staticmethod]
    fn from_toml(path: PathBuf) -> PyResult<Self> {
        let file = read_mission_file(Some(&path)).map_err(raised)?;
        Self::new(file, &path).map_err(raised)
    }

    /// A mission for the arm of a URDF, as `remora import` makes it.
    #[staticmethod]
    #[pyo3(signature = (path, *, tip=None, base=None, bus=None, mount=None, boresight=None, axis=None,
                        start=None, armature=None, limits=None, hold=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, each of them optional")]
    fn from_urdf(
        path: PathBuf,
        tip: Option<String>,
        base: Option<String>,
        bus: Option<PathBuf>,
        mount: Option<Vec<f64>>,
        boresight: Option<[f64; 3]>,
        axis: Option<[f64; 3]>,
        start: Option<Vec<f64>>,
        armature: Option<Vec<f64>>,
        limits: Option<BTreeMap<String, [f64; 4]>>,
        hold: Option<BTreeMap<String, f64>>,
    ) -> PyResult<Self> {
        let said = Said { tip, base, bus, mount, boresight, axis, start, armature, limits, hold };
        let file = urdf::mission_file(&path, said)?;
        Self::new(file, &path).map_err(raised)
    }

    /// Number of the arm's joints.
    #[getter]
    pub(crate) fn joints(&self) -> usize {
        self.file.joints()
    }

    /// Number of a plan's nodes.
    #[getter]
    fn nodes(&self) -> usize {
        self.file.horizon.nodes
    }

    /// Time to capture [s].
    #[getter]
    fn duration_s(&self) -> f64 {
        self.file.horizon.duration_s
    }

    /// Checksum of all its numbers.
    #[getter]
    pub(crate) fn checksum(&self) -> &str {
        &self.checksum
    }

    /// Largest torques: of the bus about its axes, then of the joints [N m].
    #[getter]
    fn torque_limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let limits: Vec<f64> = with_joints!(self.joints(), NL => {
            let servicer = &self.of::<NL>().map_err(raised)?.servicer;
            let (bus, joints) = (&servicer.max_bus_torque, &servicer.max_joint_torque);
            bus.iter().chain(joints.iter()).copied().collect()
        } else { Vec::new() });
        Ok(arrays::vector(py, &limits))
    }

    /// The mission as a file's text; written to `path` where one is given.
    #[pyo3(signature = (path=None))]
    fn to_toml(&self, path: Option<PathBuf>) -> PyResult<String> {
        let text = toml::to_string(&*self.file)
            .map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))?;
        if let Some(path) = path {
            formats::write_atomically(&path, text.as_bytes()).map_err(raised)?;
        }
        Ok(text)
    }

    fn __repr__(&self) -> String {
        format!("<remora.Mission {}, {} joints>", self.checksum, self.joints())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.checksum == other.checksum
    }

    fn __hash__(&self) -> u64 {
        u64::from_str_radix(&self.checksum, 16).unwrap_or(0)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let parse = py.get_type::<Self>().getattr("_of_text")?.unbind();
        Ok((parse, (self.to_toml(None)?,)))
    }

    /// The mission of a file's text.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Self> {
        let file = MissionFile::parse(text).map_err(|error| wrong("mission", &error))?;
        Self::new(file, Path::new("mission")).map_err(raised)
    }
}
