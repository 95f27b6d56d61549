//! The numbers mechanics is written over: plain `f64`, or several side by side.

use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A real number, or several in step.
///
/// Mechanics written over `T: Scalar` runs on `f64` for one state and on [`super::Lanes`] for several
/// directions or states at once: one source, so that the two can't disagree.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Mul<f64, Output = Self>
{
    /// Additive identity.
    const ZERO: Self;

    /// A constant: its derivatives are zero.
    fn constant(value: f64) -> Self;

    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;

    #[inline]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
}
