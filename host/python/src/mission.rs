//! Missions of arms of any number of joints.

use crate::argument::Argument;
use crate::arrays;
use crate::raised::{argument, raised, wrong};
use crate::urdf::{self, Said};
use crate::waiting::waited;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_host::error::{Error, FieldError};
use remora_host::formats::{
    self, MissionFile, checksum_of_mission, json, read_mission_file, toml_text,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// A mission: target, orbit, servicer with its arm, limits, weights and tolerances.
///
/// It cannot be changed; `replace` makes another. Sections of the mission file are attributes, such as
/// `mission.servicer.bus_mass_kg`.
#[pyclass(frozen, from_py_object, module = "remora")]
#[derive(Clone)]
pub(crate) struct Mission {
    file: Arc<MissionFile>,
    judged: Arc<formats::Mission>,
    checksum: String,
}

impl Mission {
    /// The mission of a file, judged; `name` is the file's.
    pub(crate) fn new(file: MissionFile, name: &Path) -> Result<Self, Error> {
        let mission = file.mission().map_err(|error| error.at(name))?;
        let checksum = checksum_of_mission(&mission);
        Ok(Self { file: Arc::new(file), judged: Arc::new(mission), checksum })
    }

    /// The library's mission.
    pub(crate) fn judged(&self) -> &formats::Mission {
        &self.judged
    }

    /// The mission that a caller gave, or the built-in one.
    pub(crate) fn or_default(given: Option<Self>) -> PyResult<Self> {
        given.map_or_else(Self::default, Ok)
    }
}

#[pymethods]
impl Mission {
    /// The built-in mission.
    ///
    /// Returns
    /// -------
    /// The mission that all calls use by default.
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

    /// The mission of a file.
    ///
    /// Parameters
    /// ----------
    /// path : the file (`*.mission.toml`).
    ///
    /// Returns
    /// -------
    /// The mission; keys that the file leaves out keep their defaults.
    ///
    /// Raises
    /// ------
    /// ValueError : file, field and reason.
    #[staticmethod]
    fn from_toml(path: Argument<PathBuf>) -> PyResult<Self> {
        let path = path.named("path")?;
        let file = read_mission_file(Some(&path)).map_err(raised)?;
        Self::new(file, &path).map_err(raised)
    }

    /// A mission for the arm of a URDF, as `remora mission import` makes it.
    ///
    /// Parameters
    /// ----------
    /// path : the URDF.
    /// tip : link of the end effector; None is the only link at an end.
    /// base : link that is the bus; None is the root.
    /// bus : a mission file that gives bus, target and all else; None is the built-in mission.
    /// mount : where the arm's base is on the bus: x, y, z [m] and perhaps roll, pitch, yaw [rad].
    /// boresight : direction in which the bus looks, its axes.
    /// axis : direction of approach of the end effector, its link's axes.
    /// start : joint angles at the start [rad].
    /// armature : inertia of the motors about the joints [kg m^2].
    /// limits : by joint: lower and upper angle [rad], rate [rad/s] and torque [N m].
    /// hold : by joint, the angle at which it is held [rad].
    /// point_mass : links whose own inertia is left out.
    ///
    /// Returns
    /// -------
    /// The mission.
    ///
    /// Raises
    /// ------
    /// ValueError : file, element and reason; an argument by its name.
    /// KeyboardInterrupt : Ctrl-C, within a second.
    #[staticmethod]
    #[pyo3(signature = (path, *, tip=None, base=None, bus=None, mount=None, boresight=None, axis=None,
                        start=None, armature=None, limits=None, hold=None, point_mass=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, each of them optional")]
    fn from_urdf(
        py: Python<'_>,
        path: Argument<PathBuf>,
        tip: Option<Argument<String>>,
        base: Option<Argument<String>>,
        bus: Option<Argument<PathBuf>>,
        mount: Option<Argument<Vec<f64>>>,
        boresight: Option<Argument<[f64; 3]>>,
        axis: Option<Argument<[f64; 3]>>,
        start: Option<Argument<Vec<f64>>>,
        armature: Option<Argument<Vec<f64>>>,
        limits: Option<Argument<BTreeMap<String, [f64; 4]>>>,
        hold: Option<Argument<BTreeMap<String, f64>>>,
        point_mass: Option<Argument<BTreeSet<String>>>,
    ) -> PyResult<Self> {
        let path = path.named("path")?;
        let said = Said {
            tip: Argument::optional(tip, "tip")?,
            base: Argument::optional(base, "base")?,
            bus: Argument::optional(bus, "bus")?,
            mount: Argument::optional(mount, "mount")?,
            boresight: Argument::optional(boresight, "boresight")?,
            axis: Argument::optional(axis, "axis")?,
            start: Argument::optional(start, "start")?,
            armature: Argument::optional(armature, "armature")?,
            limits: Argument::optional(limits, "limits")?,
            hold: Argument::optional(hold, "hold")?,
            point_mass: Argument::optional(point_mass, "point_mass")?,
        };
        waited(py, move |_| {
            let file = urdf::mission_file(&path, said)?;
            Ok(Self::new(file, &path)?)
        })
    }

    /// The mission of a dict with the keys of a mission file.
    ///
    /// Parameters
    /// ----------
    /// values : the dict; numpy's arrays are taken, and keys that it leaves out keep their defaults.
    ///
    /// Returns
    /// -------
    /// The mission.
    ///
    /// Raises
    /// ------
    /// ValueError : the key and the reason.
    #[staticmethod]
    fn from_dict(values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let module = values.py().import("remora.mission")?;
        Self::_of_json(&module.call_method1("to_json", (values,))?.extract::<String>()?)
    }

    /// All values, as a dict with the keys of the mission file.
    ///
    /// Returns
    /// -------
    /// A dict of its own: `from_dict` makes the same mission of it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::plain(py, &*self.file)
    }

    /// The mission with other values.
    ///
    /// Parameters
    /// ----------
    /// sections : by section, a dict of the keys to change, such as `target={"mass_kg": 60.0}`. Other keys stay.
    ///
    /// Returns
    /// -------
    /// Another mission.
    ///
    /// Raises
    /// ------
    /// ValueError : the key and the reason.
    #[pyo3(signature = (**sections))]
    fn replace(slf: &Bound<'_, Self>, sections: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let module = slf.py().import("remora.mission")?;
        let merged = module.call_method1("merged", (slf.get().to_dict(slf.py())?, sections))?;
        Self::from_dict(&merged)
    }

    fn __getattr__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let module = py.import("remora.mission")?;
        module.call_method1("section", (slf.get().to_dict(py)?, name))
    }

    fn __dir__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let module = py.import("remora.mission")?;
        module.call_method1("names", (slf.get_type(), slf.get().to_dict(py)?))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("remora.notebook")?.call_method1("mission", (slf,))
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
    fn torque_limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let servicer = &self.judged.servicer;
        let joints = &servicer.joint_torque_limit_n_m.as_slice()[..self.joints()];
        arrays::vector(py, &[servicer.bus_torque_limit_n_m.as_slice(), joints].concat())
    }

    /// The mission as a file's text.
    ///
    /// Parameters
    /// ----------
    /// path : file that is written as well.
    ///
    /// Returns
    /// -------
    /// The text.
    ///
    /// Raises
    /// ------
    /// OSError : a file that cannot be written.
    #[pyo3(signature = (path=None))]
    fn to_toml(&self, path: Option<Argument<PathBuf>>) -> PyResult<String> {
        let path = Argument::optional(path, "path")?;
        let text = toml_text::to_text(&*self.file)
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

    /// The mission of a document in JSON, with the keys of a mission file.
    #[staticmethod]
    fn _of_json(text: &str) -> PyResult<Self> {
        let values: serde_json::Value = json::parse_value(text.as_bytes())
            .map_err(|error| argument("mission", error.reason))?;
        let text = toml_text::to_text(&values).map_err(|error| argument("mission", error))?;
        let file = MissionFile::parse(&text).map_err(|error| {
            // The text is not shown to users.
            let reason = error.reason.split(" at line ").next().unwrap_or_default();
            wrong("mission", &FieldError::new(error.field.as_str(), reason))
        })?;
        Self::new(file, Path::new("mission")).map_err(raised)
    }

    /// The mission of a file's text.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Self> {
        let file = MissionFile::parse(text).map_err(|error| wrong("mission", &error))?;
        Self::new(file, Path::new("mission")).map_err(raised)
    }
}
