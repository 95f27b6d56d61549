//! Guesses against each other, scenario by scenario.

use crate::argument::Argument;
use crate::arrays;
use crate::many::{Answer, plan_all};
use crate::mission::Mission;
use crate::raised::argument;
use crate::request::{self, PlanRequest};
use crate::scenario::Scenario;
use crate::waiting::waited;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_host::formats::Row;
use remora_learn::reproduce::{Against, Measured};

/// Plans the same approaches from each guess, for `remora.compare_guesses`. Returns the results of each guess,
/// and its differences from the first.
#[pyfunction]
#[pyo3(signature = (guesses, cases, mission, *, integrator, mode, jobs))]
pub(crate) fn compare_guesses<'py>(
    py: Python<'py>,
    guesses: Argument<Bound<'py, PyDict>>,
    cases: Argument<Vec<Scenario>>,
    mission: Option<Argument<Mission>>,
    integrator: Argument<&str>,
    mode: Argument<&str>,
    jobs: Option<Argument<usize>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (guesses, cases) = (guesses.named("guesses")?, cases.named("cases")?);
    if guesses.is_empty() || cases.is_empty() {
        return Err(argument("guesses, cases", "there must be at least one of each"));
    }
    let (first, jobs) =
        (PlanRequest::of(mission, (integrator, mode), None, None)?, request::jobs(jobs)?);
    let (mut names, mut ways) = (Vec::new(), Vec::new());
    for (name, guess) in guesses.iter() {
        let name = name.extract::<Argument<String>>()?.named("guesses")?;
        ways.push(first.started_from(&format!("guesses[{name:?}]"), &guess)?);
        names.push(name);
    }
    let found = waited(py, move |caller| {
        let answers = plan_all(caller, &ways, &cases, jobs)?;
        let rows: Vec<Vec<Row>> = answers.into_iter().map(rows).collect();
        let first = rows.first().cloned().unwrap_or_default();
        let measured = rows.into_iter().map(|own| {
            let fallbacks = own.iter().filter(|row| row.warm_start == "fallback").count();
            (Measured::of(&own), fallbacks, Against::of(&first, &own))
        });
        Ok(measured.collect::<Vec<_>>())
    })?;
    let dict = PyDict::new(py);
    for (name, (measured, fallbacks, against)) in names.iter().zip(found) {
        let measured = arrays::plain(py, &measured)?;
        measured.set_item("fallbacks", fallbacks)?;
        measured.set_item("against", arrays::plain(py, &against)?)?;
        dict.set_item(name, measured)?;
    }
    Ok(dict)
}

fn rows(answers: Vec<Answer>) -> Vec<Row> {
    answers.into_iter().map(|(row, _)| row).collect()
}
