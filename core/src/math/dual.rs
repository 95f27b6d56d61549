//! Forward-mode dual numbers: a value and its derivatives along `L` directions at once.

use super::Scalar;
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `value + sum_i partial[i] * eps_i` with `eps_i eps_j = 0`.
///
/// Arithmetic on dual numbers gives derivatives exact to rounding. One multiplication costs `3 L`
/// flops; memory `8 (L + 1)` bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const L: usize> {
    /// The value.
    pub value: f64,
    /// Derivatives along the `L` seeded directions.
    pub partial: [f64; L],
}

impl<const L: usize> Dual<L> {
    /// An independent variable: derivative one along direction `lane`.
    ///
    /// # Panics
    /// If `lane >= L`, at compile time wherever the lane is a constant.
    #[inline]
    pub fn variable(value: f64, lane: usize) -> Self {
        let mut partial = [0.0; L];
        partial[lane] = 1.0;
        Self { value, partial }
    }

    #[inline]
    fn zip(self, other: Self, value: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut partial = [0.0; L];
        for ((out, a), b) in partial.iter_mut().zip(self.partial).zip(other.partial) {
            *out = f(a, b);
        }
        Self { value, partial }
    }

    #[inline]
    fn map(self, value: f64, f: impl Fn(f64) -> f64) -> Self {
        let mut partial = [0.0; L];
        for (out, a) in partial.iter_mut().zip(self.partial) {
            *out = f(a);
        }
        Self { value, partial }
    }
}

impl<const L: usize> Scalar for Dual<L> {
    const ZERO: Self = Self { value: 0.0, partial: [0.0; L] };

    #[inline]
    fn constant(value: f64) -> Self {
        Self { value, partial: [0.0; L] }
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.map(sin, |d| d * cos), self.map(cos, |d| -d * sin))
    }
}

impl<const L: usize> Add for Dual<L> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.zip(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Dual<L> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.value - other.value, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Dual<L> {
    type Output = Self;
    #[inline]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    fn mul(self, other: Self) -> Self {
        let (x, y) = (self.value, other.value);
        self.zip(other, x * y, |a, b| a * y + b * x)
    }
}

impl<const L: usize> Mul<f64> for Dual<L> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, |a| a * factor)
    }
}

impl<const L: usize> Neg for Dual<L> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(-self.value, |a| -a)
    }
}

impl<const L: usize> AddAssign for Dual<L> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Dual<L> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Nested use of every operation, for the value and its derivative along two directions.
    fn probe<T: Scalar>(x: T, y: T) -> T {
        let (s, c) = (x * y).sin_cos();
        let mut z = s * x - c * y + -(x * 3.0);
        z += y * y * x;
        z -= s;
        z
    }

    proptest! {
        #[test]
        fn partials_match_central_differences(x in -2.0..2.0f64, y in -2.0..2.0f64) {
            let dual = probe(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
            prop_assert_eq!(dual.value, probe(x, y));
            let h = 1e-5;
            let by_x = (probe(x + h, y) - probe(x - h, y)) / (2.0 * h);
            let by_y = (probe(x, y + h) - probe(x, y - h)) / (2.0 * h);
            prop_assert!((dual.partial[0] - by_x).abs() < 1e-7);
            prop_assert!((dual.partial[1] - by_y).abs() < 1e-7);
        }
    }
}
