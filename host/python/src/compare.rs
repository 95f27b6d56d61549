//! Guesses against each other, scenario by scenario.

use crate::arrays;
use crate::asked::{self, Asked};
use crate::many::{Answer, plan_all};
use crate::mission::Mission;
use crate::raised::argument;
use crate::scenario::Scenario;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use remora_host::formats::Row;
use remora_learn::reproduce::{Against, Measured};

/// Plans the same approaches from each guess: what each comes to and, against the first, what changes.
#[pyfunction]
#[pyo3(signature = (guesses, cases, mission=None, *, integrator="rk4", mode="optimal", jobs=None))]
pub(crate) fn compare_guesses<'py>(
    py: Python<'py>,
    guesses: &Bound<'py, PyDict>,
    cases: Vec<Scenario>,
    mission: Option<Mission>,
    integrator: &str,
    mode: &str,
    jobs: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    if guesses.is_empty() || cases.is_empty() {
        return Err(argument("guesses, cases", "there must be at least one of each"));
    }
    let (mut names, mut ways) = (Vec::new(), Vec::new());
    for (name, guess) in guesses.iter() {
        names.push(name.extract::<String>()?);
        ways.push(Asked::of(mission.clone(), integrator, mode, Some(&guess), None)?);
    }
    let answers = plan_all(py, &ways, &cases, asked::jobs(jobs)?)?;
    let rows: Vec<Vec<Row>> = answers.into_iter().map(rows).collect();
    let dict = PyDict::new(py);
    for (name, own) in names.iter().zip(&rows) {
        let measured = arrays::plain(py, &Measured::of(own))?;
        let fallbacks = own.iter().filter(|row| row.warm_start == "fallback").count();
        measured.set_item("fallbacks", fallbacks)?;
        measured.set_item("against", arrays::plain(py, &Against::of(&rows[0], own))?)?;
        dict.set_item(name, measured)?;
    }
    Ok(dict)
}

fn rows(answers: Vec<Answer>) -> Vec<Row> {
    answers.into_iter().map(|(row, _)| row).collect()
}
