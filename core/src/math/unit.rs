//! Vectors and quaternions that are nearly of unit length: numbers written with a few decimals.

use nalgebra::SVector;
use remora_qp::dense::{divisor, is_usable};

/// Largest distance of a norm from one at which its vector is normalised.
pub const NEARLY_UNIT: f64 = 1e-3;

/// Normalises `v` if its norm differs from one by more than `exact` and at most [`NEARLY_UNIT`]. Any other
/// vector stays as it is, bit for bit.
#[inline(never)]
pub fn nearly_unit<const N: usize>(v: &SVector<f64, N>, exact: f64) -> SVector<f64, N> {
    let norm = if v.iter().all(|x| is_usable(*x)) { libm::sqrt(v.dot(v)) } else { 0.0 };
    let off = (norm - 1.0).abs();
    if off > exact && off <= NEARLY_UNIT { v / divisor(norm) } else { *v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn four_decimals_are_made_a_unit_vector_and_exact_ones_keep_their_bits() {
        let rounded = Vector3::new(0.5774, 0.5774, 0.5773);
        let unit = nearly_unit(&rounded, 1e-6);
        assert!((unit.norm() - 1.0).abs() < 1e-15 && (unit - rounded).norm() < 1e-3);
        let exact = Vector3::new(0.6, 0.8 + 1e-7, 0.0);
        assert_eq!(nearly_unit(&exact, 1e-6), exact);
        for wrong in [Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 0.0, 1.0011), Vector3::zeros()]
        {
            assert_eq!(nearly_unit(&wrong, 1e-6), wrong);
        }
        assert!(nearly_unit(&Vector3::repeat(f64::NAN), 1e-6).x.is_nan());
    }
}
