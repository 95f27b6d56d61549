//! Single-precision arithmetic with the same bits everywhere: sums run in a fixed number of lanes,
//! nothing is fused, no platform function is called.

use super::model::{Floats, Norm};

/// Lanes of a sum: two AVX registers.
const LANES: usize = 16;

/// 1.5 * 2^23: added to a number below 2^22 it rounds to the nearest integer, ties to even, in the low
/// bits.
const ROUNDER: f32 = 12_582_912.0;

/// Bits of the least magnitude that has a scale, 1e-30.
const LEAST: u32 = 1e-30f32.to_bits();

/// Added to the variance in the layer norm, as in training.
const EPSILON: f32 = 1e-5;

#[inline(always)]
fn total(lanes: [f32; LANES]) -> f32 {
    let mut half = LANES / 2;
    let mut sums = lanes;
    // Bound: constant, of LANES halved.
    while half > 0 {
        for i in 0..half {
            sums[i] += sums[i + half];
        }
        half /= 2;
    }
    sums[0]
}

/// Sum over `term(a, b)`.
#[inline(always)]
fn sum_of<A: Copy, B: Copy>(a: &[A], b: &[B], term: impl Fn(A, B) -> f32) -> f32 {
    let mut lanes = [0.0; LANES];
    let (a, a_tail) = a.as_chunks::<LANES>();
    let (b, b_tail) = b.as_chunks::<LANES>();
    for (a, b) in a.iter().zip(b) {
        for (lane, (a, b)) in lanes.iter_mut().zip(a.iter().zip(b)) {
            *lane += term(*a, *b);
        }
    }
    for (lane, (a, b)) in lanes.iter_mut().zip(a_tail.iter().zip(b_tail)) {
        *lane += term(*a, *b);
    }
    total(lanes)
}

/// Sum of numbers.
pub(super) fn sum(x: &[f32]) -> f32 {
    sum_of(x, x, |x, _| x)
}

/// Inner product with numbers of a model file. Both must be equally long.
pub(super) fn dot(weights: Floats<'_>, x: &[f32]) -> f32 {
    sum_of(weights, x, |w, x| f32::from_le_bytes(w) * x)
}

/// Inner product.
pub(super) fn dot_plain(x: &[f32], y: &[f32]) -> f32 {
    sum_of(x, y, |x, y| x * y)
}

/// `y += factor * weights`.
pub(super) fn add_multiple(y: &mut [f32], factor: f32, weights: Floats<'_>) {
    for (y, w) in y.iter_mut().zip(weights) {
        *y += factor * f32::from_le_bytes(*w);
    }
}

/// Copies numbers of a model file.
pub(super) fn copy(y: &mut [f32], weights: Floats<'_>) {
    for (y, w) in y.iter_mut().zip(weights) {
        *y = f32::from_le_bytes(*w);
    }
}

/// Layer norm of `x` into `y`. Cost: `8 n` flops, one root, two divisions.
pub(super) fn layer_norm(x: &[f32], norm: &Norm<'_>, y: &mut [f32]) {
    let count = x.len() as f32;
    let mean = sum(x) / count;
    let variance = sum_of(x, x, |x, _| (x - mean) * (x - mean)) / count;
    // An overflowed variance must give NaN, not zeros.
    let inverse =
        if variance <= f32::MAX { 1.0 / libm::sqrtf(variance + EPSILON) } else { f32::NAN };
    let gains = norm.gain.iter().zip(norm.bias);
    for ((y, x), (gain, bias)) in y.iter_mut().zip(x).zip(gains) {
        *y = (x - mean) * inverse * f32::from_le_bytes(*gain) + f32::from_le_bytes(*bias);
    }
}

/// Rectified linear unit. The product maps negative numbers to zero and negative infinity to NaN.
pub(super) fn relu(x: &mut [f32]) {
    for x in x {
        *x = if *x < 0.0 { *x * 0.0 } else { *x };
    }
}

/// The largest number, NaN ignored.
pub(super) fn maximum(x: &[f32]) -> f32 {
    let mut lanes = [f32::NEG_INFINITY; LANES];
    let (chunks, tail) = x.as_chunks::<LANES>();
    let larger = |a: f32, b: f32| if b > a { b } else { a };
    for chunk in chunks {
        for (lane, x) in lanes.iter_mut().zip(chunk) {
            *lane = larger(*lane, *x);
        }
    }
    lanes.iter().chain(tail).fold(f32::NEG_INFINITY, |most, x| larger(most, *x))
}

/// `exp(x)` for `x <= 0`, to 2 ulp; `exp(-87)` below -87, where it would be subnormal. NaN stays NaN.
///
/// A polynomial of degree 7 after Cody and Waite's reduction, coefficients those of the Cephes
/// library: unlike `libm`'s it has no branch, and a vector unit takes several at once.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    let x = if x < -87.0 { -87.0 } else { x };
    let shifted = x * core::f32::consts::LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    // log 2 in two parts, the first so short that its product with n is exact.
    let r = (x - n * 0.693_359_4) - n * -2.121_944_4e-4;
    let mut p = 1.987_569_1e-4;
    for coefficient in [1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5] {
        p = p * r + coefficient;
    }
    let value = p * (r * r) + r + 1.0;
    // The low bits of `shifted` hold n, which becomes the exponent.
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23));
    value * power
}

/// Rounds numbers to signed bytes, stored as their bits, and returns the scale: `x = scale * q` but
/// for half a step. The largest magnitude becomes 127. Numbers too small to have a scale become
/// zero; where one is not finite the scale is NaN, and so is all that comes of it.
pub(super) fn quantise(x: &[f32], q: &mut [u8]) -> f32 {
    // The bits of magnitudes are ordered as they are, with infinity and NaN on top.
    let most = x.iter().fold(0, |most: u32, x| most.max(x.to_bits() & 0x7fff_ffff));
    let is_finite = most < f32::INFINITY.to_bits();
    // The divisor is never zero. A float comparison would let the compiler drop the `max`.
    let largest = f32::from_bits(most.max(LEAST));
    let inverse = if is_finite && most >= LEAST { 127.0 / largest } else { 0.0 };
    // NaN or infinity times zero would be an invalid operation.
    let mask = if is_finite { u32::MAX } else { 0 };
    for (q, x) in q.iter_mut().zip(x) {
        *q = (f32::from_bits(x.to_bits() & mask) * inverse + ROUNDER).to_bits() as u8;
    }
    // Kept apart from the other division: a compiler joins both in four lanes, of which two divide 0 by 0.
    if !is_finite {
        f32::NAN
    } else if most >= LEAST {
        largest / 127.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exponential_is_close(x in -86.9f32..0.0) {
            let exact = libm::exp(f64::from(x));
            prop_assert!((f64::from(exp(x)) / exact - 1.0).abs() < 2.5e-7);
        }

        #[test]
        fn quantised_numbers_are_within_half_a_step(
            x in proptest::collection::vec(-1e3f32..1e3, 1..70),
        ) {
            let mut q = [0; 70];
            let scale = quantise(&x, &mut q);
            for (x, q) in x.iter().zip(q) {
                prop_assert_ne!(q, 128);
                prop_assert!((f32::from(q as i8) * scale - x).abs() <= 0.5001 * scale);
            }
        }

        #[test]
        fn sums_are_sums(x in proptest::collection::vec(-10f32..10.0, 0..100)) {
            let exact: f64 = x.iter().map(|x| f64::from(*x)).sum();
            prop_assert!((f64::from(sum(&x)) - exact).abs() < 1e-3);
            prop_assert_eq!(maximum(&x), x.iter().copied().fold(f32::NEG_INFINITY, f32::max));
        }
    }

    #[test]
    fn ends_of_the_exponential() {
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(-1e9), exp(-87.0));
        assert_eq!(exp(f32::NEG_INFINITY), exp(-87.0));
        assert!(exp(-87.0) > 0.0 && exp(-87.0) < 2e-38);
        assert!(exp(f32::NAN).is_nan());
    }

    #[test]
    fn what_is_not_finite_or_tiny_is_marked() {
        let mut q = [7; 3];
        assert!(quantise(&[1.0, f32::NAN, 0.0], &mut q).is_nan());
        assert!(quantise(&[1.0, f32::NEG_INFINITY, 0.0], &mut q).is_nan());
        assert_eq!(quantise(&[0.0, -0.0, 1e-40], &mut q), 0.0);
        assert_eq!(q, [0; 3]);
        assert_eq!(quantise(&[0.5, -127.0, 1.5], &mut q), 1.0);
        assert_eq!(q.map(|q| q as i8), [0, -127, 2]);
        assert_eq!(quantise(&[], &mut []), 0.0);
    }

    #[test]
    fn layer_norm_and_relu() {
        let x: [f32; 4] = [1.0, 2.0, 3.0, 4.0];
        let gain = [2f32.to_le_bytes(); 4];
        let bias = [0.5f32.to_le_bytes(); 4];
        let mut y = [0.0; 4];
        layer_norm(&x, &Norm { gain: &gain, bias: &bias }, &mut y);
        for (x, y) in x.iter().zip(y) {
            assert!((y - ((x - 2.5) / 1.25001f32.sqrt() * 2.0 + 0.5)).abs() < 1e-5);
        }
        let mut x = [-1.0, 0.0, 2.0, f32::NAN, f32::NEG_INFINITY];
        relu(&mut x);
        assert_eq!(x[..3], [0.0, 0.0, 2.0]);
        assert!(x[3].is_nan() && x[4].is_nan());
        layer_norm(&[1e30, 0.0, 1.0, 2.0], &Norm { gain: &gain, bias: &bias }, &mut y);
        assert!(y.iter().all(|y| y.is_nan()));
    }
}
