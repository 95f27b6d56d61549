//! Unit vectors and quaternions in files. People write them with four or five decimals.

use crate::error::FieldError;
use crate::notes::note;
use nalgebra::SVector;
use remora_core::advanced::math::{NEARLY_UNIT, nearly_unit};

/// Largest distance from one of the norm of a quaternion that is not normalised.
pub const QUATERNION_TOLERANCE: f64 = 1e-6;
/// Largest distance from one of the norm of a mission's direction, which the core checks.
const DIRECTION_TOLERANCE: f64 = 1e-9;

/// Reads a quaternion. One that is nearly of unit length is normalised, with a note.
///
/// # Errors
/// Its norm differs from one by more.
pub(super) fn quaternion(
    q: &[f64; 4],
    field: impl FnOnce() -> String,
) -> Result<[f64; 4], FieldError> {
    unit(q, QUATERNION_TOLERANCE, "not a unit quaternion", field)
}

/// Reads a direction, in the same way.
///
/// # Errors
/// Its norm differs from one by more.
pub(super) fn direction(
    v: &[f64; 3],
    field: impl FnOnce() -> String,
) -> Result<[f64; 3], FieldError> {
    unit(v, DIRECTION_TOLERANCE, "must be a unit vector", field)
}

fn unit<const N: usize>(
    given: &[f64; N],
    exact: f64,
    wrong: &str,
    field: impl FnOnce() -> String,
) -> Result<[f64; N], FieldError> {
    let given = SVector::from(*given);
    let norm = given.norm();
    let off = (norm - 1.0).abs();
    if off <= exact {
        return Ok(given.into());
    }
    let unit = nearly_unit(&given, exact);
    if off <= NEARLY_UNIT {
        note(&field(), &format!("its norm is {norm}; taken as {}", shown(&unit)));
        return Ok(unit.into());
    }
    let along = given / norm;
    let is_direction = along.iter().all(|x| x.is_finite());
    let hint = if is_direction { format!("; normalised {}", shown(&along)) } else { String::new() };
    Err(FieldError::new(field(), format!("{wrong}: its norm is {norm}{hint}")))
}

/// Text as in a file, with all digits.
fn shown<const N: usize>(v: &SVector<f64, N>) -> String {
    let numbers: Vec<String> = v.iter().map(f64::to_string).collect();
    format!("[{}]", numbers.join(", "))
}
