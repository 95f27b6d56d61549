//! Arguments, whose names stand in the errors about them.

use crate::raised::argument;
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::convert::Infallible;

/// An argument as it was given. It is refused under its name, by [`Argument::named`].
pub(crate) struct Argument<T>(Result<T, Unfit>);

/// Reason why an argument is not of its type.
enum Unfit {
    Reason(String),
    /// The caller's own exception, such as an interrupt.
    Raised(PyErr),
}

impl<'a, 'py, T: FromPyObject<'a, 'py>> FromPyObject<'a, 'py> for Argument<T> {
    type Error = Infallible;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> Result<Self, Infallible> {
        Ok(Self(T::extract(given).map_err(|error| unfit(&given, error.into()))))
    }
}

fn unfit(given: &Bound<'_, PyAny>, error: PyErr) -> Unfit {
    let py = given.py();
    if error.is_instance_of::<PyOverflowError>(py) {
        return Unfit::Reason(format!("{} is out of range", shown(given)));
    }
    if error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyValueError>(py) {
        return Unfit::Reason(format!("{}, found {}", error.value(py), shown(given)));
    }
    Unfit::Raised(error)
}

/// Longest text of an argument in an error [characters].
const SHOWN: usize = 80;

/// An argument as an error shows it.
fn shown(given: &Bound<'_, PyAny>) -> String {
    let text = given.repr().map_or_else(|_| "?".into(), |text| text.to_string());
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

impl<T> Argument<T> {
    /// The argument, refused under this name.
    pub(crate) fn named(self, name: &str) -> PyResult<T> {
        self.0.map_err(|unfit| match unfit {
            Unfit::Reason(reason) => argument(name, reason),
            Unfit::Raised(error) => error,
        })
    }

    /// An argument that may be left out.
    pub(crate) fn optional(given: Option<Self>, name: &str) -> PyResult<Option<T>> {
        given.map(|given| given.named(name)).transpose()
    }

    /// An argument with a default.
    pub(crate) fn or(given: Option<Self>, name: &str, default: T) -> PyResult<T> {
        given.map_or(Ok(default), |given| given.named(name))
    }
}
