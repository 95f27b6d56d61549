//! Plans.

use crate::argument::Argument;
use crate::arrays;
use crate::flight::Flight;
use crate::mission::Mission;
use crate::raised::{Failure, argument, raised};
use crate::scenario::Scenario;
use crate::start::Start;
use crate::waiting::waited;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use remora_core::advanced::stages::{Clearances, Residuals};
use remora_host::error::FieldError;
use remora_host::formats::{self, EvidenceFile, NamedScenario, PlanFile, PlanGrid, Verdict};
use remora_host::method::Method;
use remora_host::picture;
use remora_web::Shown;
use std::path::{Path, PathBuf};

/// A plan: motion, torques and what the independent verifier says of them.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Plan {
    pub(crate) mission: Mission,
    pub(crate) scenario: NamedScenario,
    pub(crate) file: PlanFile,
    pub(crate) grid: PlanGrid,
    pub(crate) verdict: Verdict,
    pub(crate) residuals: Residuals,
    pub(crate) clearances: Clearances,
    pub(crate) evidence: Option<EvidenceFile>,
    /// Whether the verifier judged a file; otherwise the plan's own values are taken.
    pub(crate) is_judged: bool,
    /// How it can be made again; none of a file.
    pub(crate) recipe: Option<(Method, Start)>,
}

/// A plan in a pickle: packets of file and record, inputs that make it again, and whether it was judged.
type PlanState<'py> =
    (Bound<'py, PyBytes>, Option<Bound<'py, PyBytes>>, Option<Bound<'py, PyAny>>, bool);

#[pymethods]
impl Plan {
    /// Reads a plan file, of any arm, and has the verifier judge it.
    ///
    /// Parameters
    /// ----------
    /// path : the file (`*.plan.json`, `*.plan.postcard`); the record beside it is read too.
    ///
    /// Returns
    /// -------
    /// The plan.
    ///
    /// Raises
    /// ------
    /// ValueError : file, field and reason.
    /// KeyboardInterrupt : Ctrl-C, within a second.
    #[staticmethod]
    fn load(py: Python<'_>, path: Argument<PathBuf>) -> PyResult<Self> {
        let path = path.named("path")?;
        waited(py, move |_| Ok(Self::read(&path)?))
    }

    /// Writes the plan file, and its record beside it where there is one.
    ///
    /// Parameters
    /// ----------
    /// path : the file; a name that ends in `.postcard` asks for a packet, others for JSON.
    ///
    /// Raises
    /// ------
    /// OSError : a file that cannot be written.
    fn save(&self, path: Argument<PathBuf>) -> PyResult<()> {
        let path = path.named("path")?;
        formats::check_writable(&path).map_err(raised)?;
        let written = match &self.evidence {
            Some(evidence) => evidence.write_with(&self.file, &path),
            None => self.file.write(&path),
        };
        written.map_err(raised)
    }

    /// Mission that it was made for.
    #[getter]
    fn mission(&self) -> Mission {
        self.mission.clone()
    }

    /// Scenario that it was made for.
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

    /// End of planning.
    #[getter]
    fn status(&self) -> &'static str {
        self.file.status.name()
    }

    /// Initial guess of Stage 2: "model", "heuristic", "given", "nominal", or "fallback" where the one
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

    /// Tolerances of the residuals, by name.
    #[getter]
    fn tolerances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let named = self.residuals.against(&self.mission.judged().tolerances);
        arrays::dict(py, named.map(|(name, _, tolerance)| (name, tolerance)))
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

    /// The plan as a picture.
    ///
    /// Parameters
    /// ----------
    /// path : file that is written as well.
    ///
    /// Returns
    /// -------
    /// The text of an SVG file.
    ///
    /// Raises
    /// ------
    /// OSError : a file that cannot be written.
    #[pyo3(signature = (path=None))]
    fn svg(&self, path: Option<Argument<PathBuf>>) -> PyResult<String> {
        let path = Argument::optional(path, "path")?;
        let text = picture::svg(&self.file, self.mission.judged()).map_err(raised)?;
        if let Some(path) = path {
            formats::write_atomically(&path, text.as_bytes()).map_err(raised)?;
        }
        Ok(text)
    }

    /// The page of the plan and of flights of it.
    ///
    /// Parameters
    /// ----------
    /// path : file that is written as well.
    /// flights : flights of this plan.
    ///
    /// Returns
    /// -------
    /// The text of an HTML file that loads nothing.
    ///
    /// Raises
    /// ------
    /// ValueError : flights of another plan.
    /// OSError : a file that cannot be written.
    /// KeyboardInterrupt : Ctrl-C, within a second.
    #[pyo3(signature = (path=None, *, flights=None),
           text_signature = "($self, path=None, *, flights=())")]
    fn page(
        slf: &Bound<'_, Self>,
        path: Option<Argument<PathBuf>>,
        flights: Option<Argument<Vec<Py<Flight>>>>,
    ) -> PyResult<String> {
        let path = Argument::optional(path, "path")?;
        let flights = Argument::or(flights, "flights", Vec::new())?;
        let of = slf.get().output();
        if flights.iter().any(|flight| flight.get().of != of) {
            return Err(argument("flights", "are of another plan"));
        }
        let plan = slf.clone().unbind();
        let text = waited(slf.py(), move |caller| {
            let shown = flights.iter().map(|flight| {
                caller.go_on()?;
                Ok(flight.get().shown())
            });
            let flights = shown.collect::<Result<_, Failure>>()?;
            remora_web::page(&[Shown { plan: &plan.get().file, flights }])
                .map_err(|error| error.error.at(Path::new("plan")).into())
        })?;
        if let Some(path) = path {
            formats::write_atomically(&path, text.as_bytes()).map_err(raised)?;
        }
        Ok(text)
    }

    /// Shows that page: in a notebook below the cell, otherwise in the browser.
    ///
    /// Parameters
    /// ----------
    /// flights : flights of this plan.
    ///
    /// Raises
    /// ------
    /// ValueError : flights of another plan.
    #[pyo3(signature = (*, flights=None), text_signature = "($self, *, flights=())")]
    fn show(slf: &Bound<'_, Self>, flights: Option<Argument<Vec<Py<Flight>>>>) -> PyResult<()> {
        let text = Self::page(slf, None, flights)?;
        slf.py().import("remora.pages")?.call_method1("show", (text,))?;
        Ok(())
    }

    fn __repr__(&self) -> String {
        format!("<remora.Plan {}: {}>", self.scenario.id, self.verdict.words())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("remora.notebook")?.call_method1("plan", (slf,))
    }

    fn __eq__(&self, other: &Self) -> PyResult<bool> {
        Ok(self.packets()? == other.packets()?)
    }

    fn __hash__(&self) -> u64 {
        self.output()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, PlanState<'py>)> {
        let (py, plan) = (slf.py(), slf.get());
        let read = slf.get_type().getattr("_of_packets")?;
        let (file, evidence) = plan.packets()?;
        let evidence = evidence.map(|bytes| PyBytes::new(py, &bytes));
        let guess = plan.recipe.as_ref().map(|(_, start)| start.given(py)).transpose()?;
        Ok((read, (PyBytes::new(py, &file), evidence, guess.flatten(), plan.is_judged)))
    }

    /// The plan of a pickle; the verifier judges anew what it judged before.
    #[staticmethod]
    #[pyo3(signature = (file, evidence, guess, is_judged))]
    fn _of_packets(
        py: Python<'_>,
        file: Vec<u8>,
        evidence: Option<Vec<u8>>,
        guess: Option<&Bound<'_, PyAny>>,
        is_judged: bool,
    ) -> PyResult<Self> {
        let plan = waited(py, move |_| {
            let at = |error: FieldError| error.at(Path::new("plan"));
            let file = PlanFile::from_bytes(&file).map_err(at)?;
            let evidence = evidence.map(|bytes| EvidenceFile::from_bytes(&bytes)).transpose();
            let plan = Self::said(file, evidence.map_err(at)?, Path::new("plan"))?;
            Ok(if is_judged { plan.judged(Path::new("plan"))? } else { plan })
        })?;
        let start =
            guess.map(|guess| Start::of("guess", guess, plan.file.integrator)).transpose()?;
        let recipe = start.map(|start| (plan.method(start.warm_start()), start));
        Ok(Self { recipe, ..plan })
    }
}
