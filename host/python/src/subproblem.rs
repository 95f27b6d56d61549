//! The convex subproblems of a plan, for other solvers.

use crate::argument::Argument;
use crate::arrays;
use crate::bench::{Bench, with_planner};
use crate::plan::Plan;
use crate::raised::{Failure, argument, raised};
use crate::request::PlanRequest;
use crate::start::Start;
use crate::waiting::waited;
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use remora_core::advanced::stages::LINKS;
use remora_host::formats::NamedScenario;
use remora_host::planning::Subproblem as Solved;
use remora_host::qp_file::{Bounds, QpFile, QpInterval, QpNode, QpPlace, Rows};
use remora_host::request::Guess;
use std::path::PathBuf;

/// A subproblem with its solver's answer, by nodes and intervals: `docs/reference/plan-file.md` says what it means.
#[pyclass(frozen, module = "remora")]
pub(crate) struct Subproblem {
    file: QpFile,
}

impl Subproblem {
    fn nodes<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&QpNode) -> &Rows,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        arrays::stack(py, &self.file.nodes.iter().map(|node| of(node).clone()).collect::<Vec<_>>())
    }

    fn intervals<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&QpInterval) -> &Rows,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let intervals = self.file.intervals.iter();
        arrays::stack(py, &intervals.map(|interval| of(interval).clone()).collect::<Vec<_>>())
    }
}

/// Bounds as numbers.
fn bounds(bounds: &Bounds, none: f64) -> Vec<f64> {
    bounds.iter().map(|bound| bound.unwrap_or(none)).collect()
}

#[pymethods]
impl Subproblem {
    /// 1 or 2.
    #[getter]
    fn stage(&self) -> u64 {
        self.file.stage
    }

    /// Number of the stage's iteration, from 1.
    #[getter]
    fn iteration(&self) -> u64 {
        self.file.iteration
    }

    /// Number of nodes.
    #[getter(nodes)]
    fn count(&self) -> usize {
        self.file.size.nodes
    }

    /// Constant part of the objective.
    #[getter]
    fn constant(&self) -> f64 {
        self.file.constant
    }

    /// Weight of the L1 norm of the dynamics' slack; infinite where they are hard.
    #[getter]
    fn defect_weight(&self) -> f64 {
        self.file.defect_weight.unwrap_or(f64::INFINITY)
    }

    /// Weight of the soft rows' violation.
    #[getter]
    fn row_weight(&self) -> f64 {
        self.file.row_weight
    }

    /// Hessian blocks of the states.
    #[getter]
    fn hessian_xx<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.nodes(py, |node| &node.hessian_xx)
    }

    /// Cross blocks, a row a control.
    #[getter]
    fn hessian_ux<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.intervals(py, |interval| &interval.hessian_ux)
    }

    /// Hessian blocks of the controls.
    #[getter]
    fn hessian_uu<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.intervals(py, |interval| &interval.hessian_uu)
    }

    /// Linear cost of the states.
    #[getter]
    fn gradient_x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> = self.file.nodes.iter().map(|node| &node.gradient_x).collect();
        arrays::matrix(py, &rows)
    }

    /// Linear cost of the controls.
    #[getter]
    fn gradient_u<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> = self.file.intervals.iter().map(|at| &at.gradient_u).collect();
        arrays::matrix(py, &rows)
    }

    /// Least states; minus infinity: no bound.
    #[getter]
    fn lower_x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.file.nodes.iter().map(|node| bounds(&node.lower_x, f64::NEG_INFINITY));
        arrays::matrix(py, &rows.collect::<Vec<_>>())
    }

    /// Largest states; infinity: no bound.
    #[getter]
    fn upper_x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.file.nodes.iter().map(|node| bounds(&node.upper_x, f64::INFINITY));
        arrays::matrix(py, &rows.collect::<Vec<_>>())
    }

    /// Least controls.
    #[getter]
    fn lower_u<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.file.intervals.iter().map(|at| bounds(&at.lower_u, f64::NEG_INFINITY));
        arrays::matrix(py, &rows.collect::<Vec<_>>())
    }

    /// Largest controls.
    #[getter]
    fn upper_u<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.file.intervals.iter().map(|at| bounds(&at.upper_u, f64::INFINITY));
        arrays::matrix(py, &rows.collect::<Vec<_>>())
    }

    /// Dynamics: `x+ = a x + b u + c + slack`.
    #[getter]
    fn a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.intervals(py, |interval| &interval.a)
    }

    /// Dynamics, by control.
    #[getter]
    fn b<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.intervals(py, |interval| &interval.b)
    }

    /// Dynamics, constant.
    #[getter]
    fn c<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> = self.file.intervals.iter().map(|interval| &interval.c).collect();
        arrays::matrix(py, &rows)
    }

    /// Soft rows: `row_x x + row_offset <= slack`.
    #[getter]
    fn row_x<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        self.nodes(py, |node| &node.row_x)
    }

    /// Soft rows, constant.
    #[getter]
    fn row_offset<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows: Vec<_> = self.file.nodes.iter().map(|node| &node.row_offset).collect();
        arrays::matrix(py, &rows)
    }

    /// The embedded solver's status.
    #[getter]
    fn status(&self) -> String {
        serde_json::to_value(self.file.solution.status)
            .ok()
            .and_then(|name| name.as_str().map(String::from))
            .unwrap_or_default()
    }

    /// Its iterations.
    #[getter]
    fn iterations(&self) -> u64 {
        self.file.solution.iterations
    }

    /// The solution with its multipliers by the names of the file format; None where there is none.
    #[getter]
    fn solution<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(point) = &self.file.solution.point else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("objective", point.objective)?;
        for (name, rows) in [
            ("x", &point.x),
            ("u", &point.u),
            ("defect_multiplier", &point.defect_multiplier),
            ("bound_multiplier_x", &point.bound_multiplier_x),
            ("bound_multiplier_u", &point.bound_multiplier_u),
            ("row_multiplier", &point.row_multiplier),
        ] {
            dict.set_item(name, arrays::matrix(py, rows)?)?;
        }
        Ok(Some(dict))
    }

    /// Writes it as a file.
    ///
    /// Parameters
    /// ----------
    /// path : the file (`*.qp.json`).
    ///
    /// Raises
    /// ------
    /// OSError : a file that cannot be written.
    fn save(&self, path: Argument<PathBuf>) -> PyResult<()> {
        self.file.write(&path.named("path")?).map_err(raised)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (Py<PyBytes>,))> {
        let read = py.get_type::<Self>().getattr("_of_bytes")?.unbind();
        let bytes = postcard::to_extend(&self.file, Vec::new())
            .map_err(|error| argument("subproblem", error))?;
        Ok((read, (PyBytes::new(py, &bytes).unbind(),)))
    }

    /// The subproblem of a pickle.
    #[staticmethod]
    fn _of_bytes(bytes: &[u8]) -> PyResult<Self> {
        let file = postcard::from_bytes(bytes).map_err(|error| argument("subproblem", error))?;
        Ok(Self { file })
    }

    fn __repr__(&self) -> String {
        let QpFile { stage, iteration, .. } = self.file;
        format!("<remora.Subproblem stage {stage}, iteration {iteration}>")
    }
}

/// Request that makes a plan again, where that can be known.
fn request(plan: &Plan) -> PyResult<PlanRequest> {
    let mission = plan.mission.clone();
    if let Some((method, start)) = plan.recipe.clone() {
        return Ok(PlanRequest { mission, method, start });
    }
    let start = match plan.file.warm_start.as_str() {
        "heuristic" => Start::Ready(Guess::Heuristic),
        "model" | "fallback" => Start::built_in(plan.file.integrator),
        other => return Err(argument("plan", format!("its start, {other:?}, is not in its file"))),
    };
    Ok(PlanRequest { mission, method: plan.method(start.warm_start()), start })
}

/// Subproblem `k` of a stage of a plan, for `remora.subproblem`.
#[pyfunction]
#[pyo3(signature = (plan, k, *, stage))]
pub(crate) fn subproblem(
    py: Python<'_>,
    plan: Argument<Py<Plan>>,
    k: Argument<u64>,
    stage: Argument<u64>,
) -> PyResult<Subproblem> {
    let (shared, k, stage) = (plan.named("plan")?, k.named("k")?, stage.named("stage")?);
    let plan = shared.get();
    if plan.mission.joints() != LINKS {
        let reason = format!("subproblems are had for arms of {LINKS} joints");
        return Err(argument("plan", reason));
    }
    if !(1..=2).contains(&stage) {
        return Err(argument("stage", "must be 1 or 2"));
    }
    let request = request(plan)?;
    let again = shared.clone_ref(py);
    let (found, output) = waited(py, move |caller| {
        with_planner(caller, |bench| watched(bench, &request, &again.get().scenario, (stage, k)))
    })?;
    if output != plan.output() {
        return Err(argument("plan", "made again it is another: its start is not in its file"));
    }
    let count = if stage == 1 { plan.file.stage1.iterations } else { plan.file.stage2.iterations };
    let none = || argument("k", format!("{k} is none of stage {stage}'s iterations, 1 to {count}"));
    let file = found.ok_or_else(none)?.map_err(|error| argument("subproblem", error.reason))?;
    Ok(Subproblem { file })
}

/// One subproblem where it is there, and the checksum of the plan.
type Found = (Option<Result<QpFile, remora_host::error::FieldError>>, u64);

/// Makes a plan again and keeps one subproblem.
fn watched(
    bench: &mut Bench<'_>,
    asked: &PlanRequest,
    scenario: &NamedScenario,
    (stage, k): (u64, u64),
) -> Result<Found, Failure> {
    let (mut found, mut iteration) = (None, 0);
    let mut watch = |solve: Solved<'_>| {
        if solve.stage.min(2) as u64 != stage || solve.is_correction {
            return;
        }
        iteration += 1;
        if iteration == k {
            let place = QpPlace { scenario: &scenario.id, stage, iteration, correction: 0 };
            found = Some(QpFile::new(&place, &asked.method, &solve));
        }
    };
    let mut request = asked.stoppable();
    request.guess = asked.start.guess(bench, &request, scenario)?.0;
    let clock = bench.caller.clock();
    let planned = bench.planner.plan_watched(&clock, &request, scenario, &mut watch);
    let output = u64::from_str_radix(&planned.evidence.output, 16).unwrap_or(0);
    Ok((found, output))
}
