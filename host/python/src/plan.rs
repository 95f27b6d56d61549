//! Plans.

use crate::arrays;
use crate::flight::Flight;
use crate::mission::Mission;
use crate::raised::{argument, raised};
use crate::scenario::Scenario;
use crate::start::Start;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_core::advanced::planner::{Nominal, output_checksum};
use remora_core::advanced::stages::{Clearances, Residuals};
use remora_host::engine::verified;
use remora_host::error::Error;
use remora_host::formats::{
    self, EvidenceFile, MAX_JOINTS, MadeFor, NamedScenario, PlanFile, PlanGrid, Verdict,
    evidence_path,
};
use remora_host::guess;
use remora_host::method::Method;
use remora_host::planning::Planned;
use remora_host::{picture, with_joints};
use remora_web::Shown;
use std::path::{Path, PathBuf};

/// A plan: motion, torques and what the independent verifier says of them.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Plan {
    pub(crate) mission: Mission,
    pub(crate) scenario: NamedScenario,
    pub(crate) file: PlanFile,
    grid: PlanGrid,
    verdict: Verdict,
    residuals: Residuals,
    clearances: Clearances,
    evidence: Option<EvidenceFile>,
    /// How it can be made again; none of a file.
    pub(crate) recipe: Option<(Method, Start)>,
}

impl Plan {
    /// A plan that was just made.
    pub(crate) fn made(
        mission: Mission,
        scenario: NamedScenario,
        planned: Planned,
        recipe: (Method, Start),
    ) -> PyResult<Self> {
        let Planned { file, evidence, .. } = planned;
        let grid = file.grid.ok_or_else(|| argument("plan", "has no grid"))?;
        Ok(Self {
            mission,
            scenario,
            grid,
            verdict: file.verdict.unwrap_or_default(),
            residuals: file.residuals,
            clearances: file.clearances.unwrap_or(Clearances::NONE),
            file,
            evidence: Some(evidence),
            recipe: Some(recipe),
        })
    }

    /// The plan of a file, judged anew by the verifier.
    fn read(path: &Path) -> Result<Self, Error> {
        let file = PlanFile::read(path)?;
        let missing = |field: &str| {
            Error::input(path, field, "is missing: the plan is of the first format; plan again")
        };
        let inputs = file.inputs.as_ref().ok_or_else(|| missing("inputs"))?;
        let grid = file.grid.ok_or_else(|| missing("grid"))?;
        let mission = Mission::new(inputs.mission.clone(), path)?;
        let (residuals, clearances, is_verified) = with_joints!(mission.joints(), NL => {
            let made = inputs.read::<NL>(&file.scenario).map_err(|error| error.at(path))?;
            let (translation, motion) = (file.stage1.trajectory(), file.stage2.trajectory());
            let MadeFor { mission, scenario } = &made;
            let found = verified(mission, scenario, file.integrator, &translation, &motion);
            let is_verified = found.residuals.are_within(&mission.tolerances);
            (found.residuals, found.clearances, is_verified)
        } else { return Err(missing("inputs")) });
        let evidence = evidence_path(path);
        let evidence = evidence.is_file().then(|| EvidenceFile::read(&evidence)).transpose()?;
        Ok(Self {
            mission,
            scenario: inputs.scenario.named(&file.scenario),
            grid,
            verdict: Verdict::of(is_verified, file.status),
            residuals,
            clearances,
            evidence,
            recipe: None,
            file,
        })
    }

    /// The plan in force as the guess of another, with room for any arm.
    pub(crate) fn nominal(&self) -> Nominal<MAX_JOINTS> {
        let reorientation = with_joints!(self.mission.joints(), NL => {
            guess::resized(&self.file.stage2.trajectory::<NL>())
        } else { self.file.stage2.trajectory() });
        let PlanGrid { nodes, dt_s, .. } = self.grid;
        let duration = self.scenario.duration_s.unwrap_or(dt_s * (nodes - 1) as f64);
        Nominal { reorientation, nodes, duration }
    }

    /// Checksum of its numbers.
    pub(crate) fn output(&self) -> u64 {
        let translation = self.file.stage1.trajectory();
        with_joints!(self.mission.joints(), NL => {
            let motion = self.file.stage2.trajectory::<NL>();
            output_checksum(self.grid.nodes, &translation, &motion)
        } else { 0 })
    }
}

#[pymethods]
impl Plan {
    /// Reads a plan file (`*.plan.json`, `*.plan.postcard`), of whatever arm, and has the verifier judge it.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| Self::read(&path)).map_err(raised)
    }

    /// Writes the plan file, and its record beside it where there is one; in postcard where the name ends so.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        formats::check_writable(&path).map_err(raised)?;
        let written = match &self.evidence {
            Some(evidence) => evidence.write_with(&self.file, &path),
            None => self.file.write(&path),
        };
        written.map_err(raised)
    }

    /// What it was made for.
    #[getter]
    fn mission(&self) -> Mission {
        self.mission.clone()
    }

    /// What it was made for.
    #[getter]
    fn scenario(&self) -> Scenario {
        self.scenario.clone().into()
    }

    /// Whether the verifier found every constraint kept, at nodes and between them: it can be flown.
    #[getter]
    fn is_verified(&self) -> bool {
        self.verdict != Verdict::NotFlyable
    }

    /// "optimal", "verified_not_converged" or "not_flyable".
    #[getter]
    fn verdict(&self) -> &'static str {
        self.verdict.name()
    }

    /// How planning ended.
    #[getter]
    fn status(&self) -> &'static str {
        self.file.status.name()
    }

    /// What Stage 2 started from: "model", "heuristic", "given", "nominal", or "fallback" where what was
    /// asked for was dropped for the heuristic.
    #[getter]
    fn start(&self) -> &str {
        &self.file.warm_start
    }

    /// "euler" or "rk4" with its substeps.
    #[getter]
    fn integrator(&self) -> String {
        self.file.integrator.to_string()
    }

    /// Checksum of the plan's numbers: 16 hexadecimal digits, the same behind every door.
    #[getter]
    fn checksum(&self) -> String {
        format!("{:016x}", self.output())
    }

    /// The verifier's residuals by name.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let named = self.residuals.against(&Default::default());
        arrays::dict(py, named.map(|(name, value, _)| (name, value)))
    }

    /// What residuals are held to, by name.
    #[getter]
    fn tolerances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        with_joints!(self.mission.joints(), NL => {
            let tolerances = &self.mission.of::<NL>().map_err(raised)?.tolerances;
            let named = self.residuals.against(tolerances);
            arrays::dict(py, named.map(|(name, _, tolerance)| (name, tolerance)))
        } else { arrays::dict(py, []) })
    }

    /// Smallest distances of arm and target, bus and target, arm and own bus [m].
    #[getter]
    fn clearances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        arrays::dict(py, self.clearances.named().map(|(name, at)| (name, at.distance)))
    }

    /// The record that is filed with the plan; None where a loaded file has none beside it.
    #[getter]
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::plain(py, &self.evidence)
    }

    /// Iterations of Stage 1 and Stage 2.
    #[getter]
    fn iterations(&self) -> (u64, u64) {
        (self.file.stage1.iterations, self.file.stage2.iterations)
    }

    /// Costs of Stage 1 and Stage 2.
    #[getter]
    fn costs(&self) -> (f64, f64) {
        (self.file.stage1.cost, self.file.stage2.cost)
    }

    /// Times of Stage 1, of Stage 2 and of the whole plan, verification included [s].
    #[getter]
    fn times_s(&self) -> (f64, f64, f64) {
        let PlanFile { stage1, stage2, time_s, .. } = &self.file;
        (stage1.time_s, stage2.time_s, time_s.unwrap_or(f64::NAN))
    }

    /// Times of the nodes [s].
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let PlanGrid { nodes, dt_s, .. } = self.grid;
        let times: Vec<f64> = (0..nodes).map(|k| k as f64 * dt_s).collect();
        arrays::vector(py, &times)
    }

    /// The system's centre of mass at the nodes, RTN [m].
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage1.position)
    }

    /// Its velocity relative to RTN [m/s].
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage1.velocity)
    }

    /// Force over the intervals, RTN [N].
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage1.force)
    }

    /// The bus's attitude at the nodes, body to RTN, x y z w.
    #[getter]
    fn attitude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage2.attitude)
    }

    /// Joint angles at the nodes [rad].
    #[getter]
    fn joint_angle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage2.joint_angle)
    }

    /// The bus's rate relative to RTN, in RTN [rad/s].
    #[getter]
    fn rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage2.rate)
    }

    /// Joint rates at the nodes [rad/s].
    #[getter]
    fn joint_rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.stage2.joint_rate)
    }

    /// Torques of bus (its axes) and joints over the intervals [N m].
    #[getter]
    fn torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let two = &self.file.stage2;
        let rows = two.bus_torque.iter().zip(&two.joint_torque);
        let row = |(bus, joint): (&[f64; 3], &Vec<f64>)| [&bus[..], joint].concat();
        arrays::matrix(py, &rows.map(row).collect::<Vec<_>>())
    }

    /// The target's attitude at the nodes, body to RTN, x y z w.
    #[getter]
    fn target_attitude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.target.attitude)
    }

    /// Its rate relative to RTN, in RTN [rad/s].
    #[getter]
    fn target_rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::matrix(py, &self.file.target.rate)
    }

    /// The plan as a picture, the text of an SVG file; written to `path` where one is given.
    #[pyo3(signature = (path=None))]
    fn svg(&self, path: Option<PathBuf>) -> PyResult<String> {
        let text = with_joints!(self.mission.joints(), NL => {
            picture::svg(&self.file, self.mission.of::<NL>().map_err(raised)?).map_err(raised)?
        } else { String::new() });
        if let Some(path) = path {
            formats::write_atomically(&path, text.as_bytes()).map_err(raised)?;
        }
        Ok(text)
    }

    /// The page of the plan and of flights of it, the text of an HTML file that loads nothing; written to
    /// `path` where one is given.
    #[pyo3(signature = (path=None, *, flights=Vec::new()))]
    fn page(&self, path: Option<PathBuf>, flights: Vec<PyRef<'_, Flight>>) -> PyResult<String> {
        if flights.iter().any(|flight| flight.of != self.output()) {
            return Err(argument("flights", "are of another plan"));
        }
        let flights = flights.iter().map(|flight| flight.shown()).collect();
        let text = remora_web::page(&[Shown { plan: &self.file, flights }])
            .map_err(|error| raised(error.error.at(Path::new("plan"))))?;
        if let Some(path) = path {
            formats::write_atomically(&path, text.as_bytes()).map_err(raised)?;
        }
        Ok(text)
    }

    /// Shows that page: in a notebook below the cell, otherwise in the browser.
    #[pyo3(signature = (*, flights=Vec::new()))]
    fn show(&self, py: Python<'_>, flights: Vec<PyRef<'_, Flight>>) -> PyResult<()> {
        let text = self.page(None, flights)?;
        py.import("remora.pages")?.call_method1("show", (text,))?;
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("<remora.Plan {}: {}>", self.scenario.id, self.verdict.words())
    }
}
