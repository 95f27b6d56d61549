//! Numbers of a mission file that have a short form and a long one.

use super::{JointVector, each, unit};
use crate::error::FieldError;
use nalgebra::{Matrix3, SVector, Vector4};
use remora_core::advanced::math::quaternion;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Limits of joints or axes: one number for all of them, or one each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, or a list with one for each joint or axis")]
pub enum Limits {
    /// One number for all.
    Same(f64),
    /// One each.
    Each(Vec<f64>),
}

impl Limits {
    /// One number where it says it all, one each where it does not.
    pub fn of(limits: &[f64]) -> Self {
        match limits {
            [first, others @ ..] if others.iter().all(|limit| limit == first) => Self::Same(*first),
            each => Self::Each(each.to_vec()),
        }
    }

    /// The limit of each of `count`, at most `D`.
    ///
    /// # Errors
    /// A list of another length.
    pub(super) fn each<const D: usize>(
        &self,
        count: usize,
        key: &str,
    ) -> Result<SVector<f64, D>, FieldError> {
        match self {
            Self::Same(limit) => Ok(SVector::repeat(*limit)),
            Self::Each(limits) if limits.len() == count => Ok(each(limits)),
            Self::Each(limits) => {
                let reason = format!("one number or {count}, not {}", limits.len());
                Err(FieldError::new(key, reason))
            }
        }
    }
}

impl fmt::Display for Limits {
    /// Writes the numbers like a file, without brackets.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Same(limit) => write!(f, "{limit}"),
            Self::Each(limits) => {
                let limits: Vec<String> = limits.iter().map(f64::to_string).collect();
                f.write_str(&limits.join(", "))
            }
        }
    }
}

/// The stops of a joint [rad].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number, for plus and minus, or 2, [lower, upper]")]
pub enum Stops {
    /// At plus and minus this.
    Symmetric(f64),
    /// Lower and upper.
    Pair([f64; 2]),
}

impl Stops {
    /// Stops of joints; the short form where it says it all.
    pub(super) fn of(lower: &[f64], upper: &[f64]) -> Vec<Self> {
        lower.iter().zip(upper).map(|(lower, upper)| Self::between(*lower, *upper)).collect()
    }

    /// Stops of a joint; the short form where it says it all.
    pub fn between(lower: f64, upper: f64) -> Self {
        if lower == -upper { Self::Symmetric(upper) } else { Self::Pair([lower, upper]) }
    }

    /// Lower and upper stops of all joints.
    ///
    /// # Errors
    /// A list of another length, and stops of which the lower is not below the upper.
    pub(super) fn all(
        stops: &[Self],
        joints: usize,
        key: &str,
    ) -> Result<[JointVector; 2], FieldError> {
        if stops.len() != joints {
            let reason = format!("one entry for each of {joints} joints, not {}", stops.len());
            return Err(FieldError::new(key, reason));
        }
        let [mut lowers, mut uppers] = [SVector::zeros(); 2];
        for (i, stop) in stops.iter().enumerate() {
            let [lower, upper] = match *stop {
                Self::Symmetric(limit) => [-limit, limit],
                Self::Pair(pair) => pair,
            };
            // NaN is below nothing.
            let is_sound = lower.is_finite() && upper.is_finite() && lower < upper;
            if !is_sound {
                let reason = format!("the lower stop, {lower}, must be below the upper, {upper}");
                return Err(FieldError::new(format!("{key}[{i}]"), reason));
            }
            (lowers[i], uppers[i]) = (lower, upper);
        }
        Ok([lowers, uppers])
    }
}

/// Rotation matrix of a quaternion `[x, y, z, w]`.
///
/// # Errors
/// It is not of unit length.
pub(super) fn rotation(q: [f64; 4], key: &str) -> Result<Matrix3<f64>, FieldError> {
    let q = Vector4::from(unit::quaternion(&q, || key.into())?);
    Ok(quaternion::rotation_matrix(&(q / q.norm())))
}
