//! Many plans on several threads.

use crate::argument::Argument;
use crate::arrays;
use crate::bench::Bench;
use crate::mission::Mission;
use crate::plan::Plan;
use crate::raised::{Failure, argument, raised};
use crate::request::{self, PlanRequest};
use crate::scenario::Scenario;
use crate::start::Start;
use crate::waiting::{Caller, waited};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_host::error::Error;
use remora_host::formats::{
    self, Cell, Column, Program, Row, TableOrigin, columns, json, parquet_bytes, write_atomically,
};
use remora_host::method::Method;
use remora_host::planning::{PlanOutcome, Planner};
use remora_host::pool;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Mutex;

/// Result of one scenario: its row and its plan, or its row alone where it was refused.
pub(crate) type Answer = (Row, Option<(PlanOutcome, Start)>);

/// Plans scenarios in several ways, the same scenario in all of them before the next, so that what they
/// measure is measured under the same load. Answers come by way, then by scenario.
pub(crate) fn plan_all(
    caller: &Caller,
    ways: &[PlanRequest],
    cases: &[Scenario],
    jobs: NonZeroUsize,
) -> Result<Vec<Vec<Answer>>, Failure> {
    let mut answers: Vec<Vec<Option<Answer>>> =
        ways.iter().map(|_| cases.iter().map(|_| None).collect()).collect();
    let pending: Vec<(usize, usize)> =
        (0..cases.len()).flat_map(|case| (0..ways.len()).map(move |way| (way, case))).collect();
    let failed = Mutex::new(None);
    let stop = |failure: Failure| {
        let mut first = failed.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        first.get_or_insert(failure);
        caller.stop();
        Error::Thread { reason: "stopped".into() }
    };
    let plan = |planner: &mut Planner, (way, case): (usize, usize)| {
        answer(&ways[way], &mut Bench { planner, caller }, &cases[case]).map_err(stop)
    };
    let finish = |(way, case): (usize, usize), answer: Answer| {
        answers[way][case] = Some(answer);
        Ok(())
    };
    let outcome = pool::plan_all(jobs, &pending, plan, finish);
    let first = failed.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(failure) = first {
        return Err(failure);
    }
    outcome?;
    Ok(answers.into_iter().map(|of| of.into_iter().flatten().collect()).collect())
}

fn answer(asked: &PlanRequest, bench: &mut Bench<'_>, case: &Scenario) -> Result<Answer, Failure> {
    match asked.plan(bench, &case.named) {
        Ok((planned, start)) => Ok((planned.row(), Some((planned, start)))),
        Err(Failure::Refused(_, refusal)) => Ok((Row::refused(&case.named, &refusal), None)),
        Err(failure) => Err(failure),
    }
}

/// The rows of a table, to be written.
#[pyclass(frozen, module = "remora._remora")]
pub(crate) struct Rows {
    rows: Vec<Row>,
    method: Method,
    mission_checksum: String,
}

#[pymethods]
impl Rows {
    /// Writes them as a Parquet file.
    fn to_parquet(&self, path: Argument<PathBuf>) -> PyResult<()> {
        let path = path.named("path")?;
        let origin = TableOrigin {
            method: self.method,
            seed: None,
            mission_checksum: self.mission_checksum.clone(),
            program: Program::this(),
        };
        let failed = |reason: String| Error::Output { file: path.clone(), reason };
        let bytes = parquet_bytes(&self.rows, &origin).map_err(|error| failed(error.to_string()));
        bytes.and_then(|bytes| write_atomically(&path, &bytes)).map_err(raised)
    }

    /// Writes them as a CSV file.
    fn to_csv(&self, path: Argument<PathBuf>) -> PyResult<()> {
        let text = formats::csv(&self.rows, &self.method);
        write_atomically(&path.named("path")?, text.as_bytes()).map_err(raised)
    }

    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let parse = py.get_type::<Self>().getattr("_of_text")?.unbind();
        let text = serde_json::to_string(&(&self.rows, self.method, &self.mission_checksum));
        Ok((parse, (text.map_err(|error| argument("rows", error))?,)))
    }

    /// The rows of a pickle.
    #[staticmethod]
    fn _of_text(text: &str) -> PyResult<Self> {
        let read =
            json::parse_value(text.as_bytes()).map_err(|error| argument("rows", error.reason))?;
        let (rows, method, mission_checksum) = read;
        Ok(Self { rows, method, mission_checksum })
    }
}

/// The columns of rows as arrays by name.
fn table<'py>(py: Python<'py>, rows: &[Row], method: &Method) -> PyResult<Bound<'py, PyDict>> {
    let rows: Vec<Vec<Column>> = rows.iter().map(|row| columns(row, method)).collect();
    let dict = PyDict::new(py);
    for (i, column) in rows[0].iter().enumerate() {
        let cells = rows.iter().map(|row| &row[i].cell);
        let array = match column.cell {
            Cell::Number(_) => {
                PyArray1::from_vec(py, cells.map(number).collect::<Vec<f64>>()).into_any()
            }
            Cell::Integer(_) => PyArray1::from_vec(py, cells.map(integer).collect()).into_any(),
            Cell::Flag(_) => {
                let flags = cells.map(|cell| *cell == Cell::Flag(true)).collect();
                PyArray1::<bool>::from_vec(py, flags).into_any()
            }
            Cell::Text(_) => arrays::texts(py, cells.map(text).collect())?,
        };
        dict.set_item(&column.name, array)?;
    }
    Ok(dict)
}

fn number(cell: &Cell) -> f64 {
    if let Cell::Number(number) = cell { *number } else { f64::NAN }
}

fn integer(cell: &Cell) -> i64 {
    if let Cell::Integer(integer) = cell { *integer } else { 0 }
}

fn text(cell: &Cell) -> String {
    if let Cell::Text(text) = cell { text.clone() } else { String::new() }
}

/// Plans many approaches, for `remora.plan_many`: columns, rows and, where they are kept, plans, None for
/// one that was refused.
#[pyfunction]
#[pyo3(signature = (cases, mission, *, integrator, mode, initial_guess, deadline_s, jobs, keep))]
#[expect(clippy::too_many_arguments, reason = "keywords")]
pub(crate) fn plan_many<'py>(
    py: Python<'py>,
    cases: Argument<Vec<Scenario>>,
    mission: Option<Argument<Mission>>,
    integrator: Argument<&str>,
    mode: Argument<&str>,
    initial_guess: Option<&Bound<'py, PyAny>>,
    deadline_s: Option<Argument<f64>>,
    jobs: Option<Argument<usize>>,
    keep: Argument<bool>,
) -> PyResult<(Bound<'py, PyDict>, Rows, Vec<Option<Plan>>)> {
    let (cases, keep) = (cases.named("cases")?, keep.named("keep")?);
    if cases.is_empty() {
        return Err(argument("cases", "holds no scenario"));
    }
    let asked = PlanRequest::of(mission, (integrator, mode), initial_guess, deadline_s)?;
    let (method, mission, jobs) = (asked.method, asked.mission.clone(), request::jobs(jobs)?);
    let (answers, cases) =
        waited(py, move |caller| Ok((plan_all(caller, &[asked], &cases, jobs)?.remove(0), cases)))?;
    let rows: Vec<Row> = answers.iter().map(|(row, _)| row.clone()).collect();
    let dict = table(py, &rows, &method)?;
    let sums = answers.iter().map(|(_, plan)| match plan {
        Some((planned, _)) => planned.evidence.output.clone(),
        None => String::new(),
    });
    dict.set_item("checksum", arrays::texts(py, sums.collect())?)?;
    let mut plans = Vec::new();
    for ((_, plan), case) in answers.into_iter().zip(cases).filter(|_| keep) {
        let made =
            |(planned, start)| Plan::made(mission.clone(), case.named, planned, (method, start));
        plans.push(plan.map(made).transpose()?);
    }
    let mission_checksum = mission.checksum().to_string();
    Ok((dict, Rows { rows, method, mission_checksum }, plans))
}
