//! Errors as exceptions.

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use remora_core::advanced::model::Refusal;
use remora_host::error::{Error, FieldError};
use remora_host::formats::NamedScenario;

pyo3::create_exception!(
    remora,
    Refused,
    PyValueError,
    "A scenario that no plan can end well; `constraint` names why."
);

/// Why there is no result.
pub(crate) enum Failure {
    /// Bad input, or a file that cannot be written.
    Error(Error),
    /// No plan of the scenario can end well.
    Refused(String, Refusal),
    /// Exception that the caller's own function raised.
    Raised(PyErr),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Raised(error)
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Error(error) => raised(error),
            Failure::Refused(id, refusal) => refused(&id, &refusal),
            Failure::Raised(error) => error,
        }
    }
}

/// The exception for an error of the library, with its message.
pub(crate) fn raised(error: Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Output { .. } => PyOSError::new_err(message),
        Error::Thread { .. } => PyRuntimeError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

/// The exception for a field of what the caller gave.
pub(crate) fn wrong(what: &str, error: &FieldError) -> PyErr {
    PyValueError::new_err(format!("{what}: {}: {}", error.field, error.reason))
}

/// The exception for an argument.
pub(crate) fn argument(name: &str, reason: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("{name}: {reason}"))
}

/// Refuses a scenario before planning.
pub(crate) fn look(
    found: Result<Option<Refusal>, Error>,
    scenario: &NamedScenario,
) -> Result<(), Failure> {
    match found? {
        Some(refusal) => Err(Failure::Refused(scenario.id.clone(), refusal)),
        None => Ok(()),
    }
}

fn refused(id: &str, refusal: &Refusal) -> PyErr {
    let error = Refused::new_err(format!("scenario {id}: {refusal}"));
    Python::attach(|py| {
        // An exception has room for attributes.
        let _ = error.value(py).setattr("constraint", refusal.name());
    });
    error
}
