//! Normal random numbers for the flow decoder, each a function of seed and index alone.

/// The finaliser of SplitMix64 (Steele, Lea, Flood, 2014).
const fn mix(value: u64) -> u64 {
    let value = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ value >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ value >> 31
}

/// Uniform random number in `(0, 1]`, with 53 bits.
pub(super) fn uniform(seed: u64, place: u64) -> f64 {
    let counter = place.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let bits = mix(mix(seed).wrapping_add(counter)) >> 11;
    (bits + 1) as f64 / (1u64 << 53) as f64
}

/// Two independent standard normal numbers, by Box and Muller.
pub(super) fn normal_pair(seed: u64, pair: u64) -> [f32; 2] {
    let place = pair.wrapping_mul(2);
    let radius = libm::sqrt(-2.0 * libm::log(uniform(seed, place)));
    let angle = uniform(seed, place.wrapping_add(1)) * (2.0 * core::f64::consts::PI);
    let (sin, cos) = libm::sincos(angle);
    [(radius * cos) as f32, (radius * sin) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, variance, fourth moment and correlations of 40,000 numbers within five standard
    /// errors.
    #[test]
    fn numbers_are_normal_and_independent() {
        let n = 20_000;
        let all = || (0..n).flat_map(|i| normal_pair(7, i)).map(f64::from);
        let mean = |f: &dyn Fn(f64) -> f64| all().map(f).sum::<f64>() / (2 * n) as f64;
        let error = 5.0 / libm::sqrt((2 * n) as f64);
        assert!(mean(&|x| x).abs() < error);
        assert!((mean(&|x| x * x) - 1.0).abs() < error * 1.5);
        assert!((mean(&|x| x * x * x * x) - 3.0).abs() < error * 10.0);
        let next = all().skip(1);
        assert!((all().zip(next).map(|(x, y)| x * y).sum::<f64>() / (2 * n) as f64).abs() < error);
        let other = (0..n).flat_map(|i| normal_pair(8, i)).map(f64::from);
        assert!((all().zip(other).map(|(x, y)| x * y).sum::<f64>() / (2 * n) as f64).abs() < error);
    }
}
