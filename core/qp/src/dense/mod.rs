//! Small dense kernels and factorisations, the same bits on every target.
//!
//! Everything is written so that it rounds the same everywhere: IEEE add, subtract, multiply, divide
//! and square root in a fixed order, and [`libm`] for the transcendental functions. Nothing here calls
//! a `std` or nalgebra float function, whose implementation depends on features that other crates may
//! switch on.

mod cholesky;
mod eigen;
pub mod matrix;

pub use cholesky::{NotPositiveDefinite, cholesky_in_place, cholesky_solve_in_place};
pub use eigen::{MAX_SWEEPS, project_positive};

use nalgebra::{ArrayStorage, SMatrix};

/// A zero matrix in constants.
pub const fn zeros<const R: usize, const C: usize>() -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(ArrayStorage([[0.0; R]; C]))
}

/// `value` projected onto `[least, most]`; NaN stays NaN.
///
/// `f64::clamp` panics where the limits contradict; this returns one of them.
#[inline]
pub fn clamp(value: f64, least: f64, most: f64) -> f64 {
    if value < least {
        least
    } else if value > most {
        most
    } else {
        value
    }
}

/// Magnitude below which a divisor counts as zero. Quotients of numbers in use stay finite.
const LEAST_DIVISOR: f64 = 1e-100;

/// `value` as a divisor: a small positive number instead of zero; other values keep their bits, NaN too.
///
/// A caller may let the processor trap divisions by zero. Compilers ignore that: they move a division in front of
/// the test that guards it, or divide in all lanes of a vector and select afterwards. So each division that a
/// test guards has a divisor that is never zero, whatever the test finds.
///
/// The sum hides the choice: of `1 / if small { LEAST } else { value }` the compiler makes a division by `value`
/// and a choice of its result.
#[inline(always)]
pub fn divisor(value: f64) -> f64 {
    value + if value.abs() < LEAST_DIVISOR { LEAST_DIVISOR } else { 0.0 }
}

/// Magnitude beyond which a number is unusable: its powers would not be finite.
const LARGEST: f64 = 1e30;

/// Whether a number is finite, and small enough that its powers are. Looks at its bits: a comparison with NaN may
/// be an invalid operation.
#[inline]
pub fn is_usable(value: f64) -> bool {
    value.to_bits() & !(1 << 63) <= LARGEST.to_bits()
}

/// Least number that counts as positive: the inverse of one that is usable.
const LEAST: f64 = 1.0 / LARGEST;

/// Whether `least <= value <= most`; never for NaN. Compares bits, so that zeros differ: -0.0 is less than 0.0.
///
/// A comparison of floating-point numbers is an invalid operation where one is NaN and the compiler compares
/// whole vectors.
#[inline]
pub fn is_within(value: f64, least: f64, most: f64) -> bool {
    value.total_cmp(&least).is_ge() && value.total_cmp(&most).is_le()
}

/// Whether a number is usable and its inverse is, and positive.
#[inline]
pub fn is_positive(value: f64) -> bool {
    is_within(value, LEAST, LARGEST)
}

/// Whether a number is usable and not negative.
#[inline]
pub fn is_not_negative(value: f64) -> bool {
    is_within(value, -0.0, LARGEST)
}

/// A number without its fraction, from zero to the largest of 32 bits; zero of NaN. Unlike a conversion with
/// `as`, which saturates too, it is never an invalid operation.
#[inline]
pub fn count(value: f64) -> usize {
    let value = if value > 0.0 { value } else { 0.0 };
    let most = f64::from(u32::MAX);
    (if value < most { value } else { most }) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divisor_is_never_zero_and_else_as_it_was() {
        assert!(divisor(0.0) > 0.0 && divisor(-0.0) > 0.0 && divisor(1e-200) > 0.0);
        assert_eq!([-1e-99, 2.5, f64::INFINITY].map(divisor), [-1e-99, 2.5, f64::INFINITY]);
        assert!(divisor(f64::NAN).is_nan());
    }

    #[test]
    fn what_is_no_number_or_too_large_a_one_is_not_usable() {
        assert!([0.0, -0.0, 1e-320, -3.5, 1e30].into_iter().all(is_usable));
        assert!(![f64::NAN, -f64::NAN, f64::NEG_INFINITY, -1e31].into_iter().any(is_usable));
        assert!([1e-30, 3.5, 1e30].into_iter().all(is_positive));
        assert!(![f64::NAN, -1.0, 0.0, 1e-31, 1e31].into_iter().any(is_positive));
        assert!([-0.0, 0.0, 1e-320, 1e30].into_iter().all(is_not_negative));
        assert!(![f64::NAN, -f64::NAN, -1e-320, 1e31].into_iter().any(is_not_negative));
        assert!(is_within(-2.0, -2.0, -1.0) && !is_within(-2.1, -2.0, -1.0));
    }

    #[test]
    fn counts_saturate() {
        let numbers = [f64::NAN, -1e300, -0.0, 0.9, 7.5, 1e300, f64::INFINITY];
        let most = u32::MAX as usize;
        assert_eq!(numbers.map(count), [0, 0, 0, 0, 7, most, most]);
    }

    #[test]
    fn projections_end_at_the_limits() {
        assert_eq!(
            [-2.0, -1.0, 0.5, 3.0, 4.0].map(|v| clamp(v, -1.0, 3.0)),
            [-1.0, -1.0, 0.5, 3.0, 3.0]
        );
        assert!(clamp(f64::NAN, -1.0, 3.0).is_nan());
        // Zeros keep their sign, and contradicting limits give one of them.
        assert!(clamp(-0.0, 0.0, 1.0).is_sign_negative());
        assert!([2.0, 1.0].contains(&clamp(1.5, 2.0, 1.0)));
    }

    #[test]
    fn divisors_have_a_least_magnitude() {
        assert_eq!(divisor(0.0), 1e-100);
        assert_eq!(divisor(-0.0), 1e-100);
        assert_eq!(divisor(1e-100), 1e-100);
        assert_eq!(divisor(-1e-100), -1e-100);
        assert_eq!(divisor(5e-101), 1.5e-100);
    }

    #[test]
    fn ranges_include_their_ends() {
        assert!(is_within(-1.0, -2.0, -1.0) && is_within(-2.0, -2.0, -1.0));
        assert!(!is_within(-0.9, -2.0, -1.0) && !is_within(f64::NAN, -2.0, -1.0));
        assert!(!is_within(-0.0, 0.0, 1.0) && is_within(0.0, -0.0, 1.0));
        assert!(is_usable(-1e30) && !is_usable(f64::INFINITY) && !is_usable(1.1e30));
        assert!(!is_positive(0.9e-30) && !is_positive(f64::INFINITY) && !is_positive(-1e-30));
        assert!(!is_not_negative(f64::INFINITY) && is_not_negative(5.0));
    }

    #[test]
    fn whole_numbers_are_kept_up_to_the_largest() {
        let most = f64::from(u32::MAX);
        assert_eq!([1.0, 1e-300, most - 1.0, most, most + 1.0].map(count), {
            let most = u32::MAX as usize;
            [1, 0, most - 1, most, most]
        });
        assert_eq!(zeros::<2, 3>(), SMatrix::<f64, 2, 3>::zeros());
    }
}
