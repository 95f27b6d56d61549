//! Several numbers side by side.

use super::Scalar;
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `L` numbers that go through the same arithmetic, each on its own: a processor with vector
/// registers takes several at once. Costs `L` times a number's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<const L: usize>(pub [f64; L]);

impl<const L: usize> Lanes<L> {
    #[inline]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for (a, b) in out.0.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        out
    }

    #[inline]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = self;
        for a in &mut out.0 {
            *a = f(*a);
        }
        out
    }
}

impl<const L: usize> Scalar for Lanes<L> {
    const ZERO: Self = Self([0.0; L]);

    #[inline]
    fn constant(value: f64) -> Self {
        Self([value; L])
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        let (mut sin, mut cos) = (self, self);
        for (s, c) in sin.0.iter_mut().zip(&mut cos.0) {
            (*s, *c) = libm::sincos(*s);
        }
        (sin, cos)
    }
}

impl<const L: usize> Add for Lanes<L> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const L: usize> Sub for Lanes<L> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const L: usize> Mul for Lanes<L> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const L: usize> Mul<f64> for Lanes<L> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const L: usize> AddAssign for Lanes<L> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Lanes<L> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_lane_is_a_number_of_its_own() {
        fn probe<T: Scalar>(x: T) -> T {
            let (sin, cos) = (x * 2.0 + T::constant(0.3)).sin_cos();
            let mut y = sin * cos - -x;
            y += x;
            y -= sin;
            y
        }
        let Lanes(both) = probe(Lanes([0.7, -1.9]));
        assert_eq!(both, [probe(0.7), probe(-1.9)]);
    }
}
