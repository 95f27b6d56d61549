//! Rows as arrays, which own their memory, and back.

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::Serialize;

/// Numbers as an array.
pub(crate) fn vector<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, values)
}

/// Rows of the same length as an array.
pub(crate) fn matrix<'py, R: AsRef<[f64]>>(
    py: Python<'py>,
    rows: &[R],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.as_ref().to_vec()).collect();
    Ok(PyArray2::from_vec2(py, &rows)?)
}

/// Matrices of the same shape as an array.
pub(crate) fn stack<'py>(
    py: Python<'py>,
    matrices: &[Vec<Vec<f64>>],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    Ok(PyArray3::from_vec3(py, matrices)?)
}

/// Converts a value to Python as its JSON; numbers that are not finite become None.
pub(crate) fn plain<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value)
        .map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Names and numbers as a dict.
pub(crate) fn dict<'py, 'n>(
    py: Python<'py>,
    values: impl IntoIterator<Item = (&'n str, f64)>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    values.into_iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
    Ok(dict)
}

/// Texts as an array.
pub(crate) fn texts<'py>(py: Python<'py>, values: Vec<String>) -> PyResult<Bound<'py, PyAny>> {
    let list = PyList::new(py, values)?;
    py.import("numpy")?.call_method1("array", (list, "str"))
}

/// Values that numpy turns into an array of numbers.
pub(crate) fn array<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    value.py().import("numpy")?.call_method1("asarray", (value, "float64"))
}

/// The numbers of an array, or of anything that numpy makes one of, in single precision row by row; it
/// must have this shape and no number that is not finite.
pub(crate) fn numbers(
    name: &str,
    value: &Bound<'_, PyAny>,
    shape: (usize, usize),
) -> PyResult<Vec<f32>> {
    let array = array(value).map_err(|error| {
        crate::raised::argument(
            name,
            format!("is not an array of numbers: {}", error.value(value.py())),
        )
    })?;
    let found: Vec<usize> = array.getattr("shape")?.extract()?;
    if found != [shape.0, shape.1] {
        let shown = array.getattr("shape")?.str()?;
        let reason = format!("has shape {shown}, expected ({}, {})", shape.0, shape.1);
        return Err(crate::raised::argument(name, reason));
    }
    let values: Vec<f64> = array.call_method0("ravel")?.call_method0("tolist")?.extract()?;
    match values.iter().position(|x| !(*x as f32).is_finite()) {
        Some(at) => {
            let (row, column) = (at / shape.1, at % shape.1);
            Err(crate::raised::argument(name, format!("[{row}, {column}] is not finite")))
        }
        None => Ok(values.into_iter().map(|x| x as f32).collect()),
    }
}
