//! Signed distance of a segment to a box, exact, with what moving the segment does to it.

use super::{SignedDistance, signed_distance_to_box};
use nalgebra::Vector3;
use remora_qp::dense::divisor;

/// Distance below which a segment counts as meeting the box [m].
const TOUCHING: f64 = 1e-12;

/// The nearest (or deepest) point of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentDistance {
    /// Signed distance of that point to the box [m].
    pub value: f64,
    /// Unit gradient by moving the point (where the segment passes through the box: the
    /// combination of two faces that a shift along the segment does not change).
    pub gradient: Vector3<f64>,
    /// The point, box axes [m].
    pub point: Vector3<f64>,
}

/// The least signed distance over the segment from `start` to `end` of a box centred at the
/// origin, in the box's axes. The signed distance of a point is convex, and so is its least over
/// the segment's share: the derivative changes sign once.
///
/// Cost: at most eight evaluations of a piecewise linear derivative; where the segment meets the
/// box, 17 of the depth.
pub fn segment_to_box(
    half_extents: &Vector3<f64>,
    start: &Vector3<f64>,
    end: &Vector3<f64>,
) -> SegmentDistance {
    let along = end - start;
    let share = nearest_share(half_extents, start, &along);
    let at = |share: f64| start + along * share;
    let SignedDistance { value, gradient } = signed_distance_to_box(half_extents, &at(share));
    // NaN goes this way. A segment that meets the box is found no nearer than rounding.
    if !(value <= TOUCHING) {
        return SegmentDistance { value, gradient, point: at(share) };
    }
    deepest(half_extents, start, &along)
}

/// Half the derivative, by the share, of the squared distance at `share`.
fn slope(half: &Vector3<f64>, start: &Vector3<f64>, along: &Vector3<f64>, share: f64) -> f64 {
    let mut sum = 0.0;
    for i in 0..3 {
        let p = start[i] + along[i] * share;
        let beyond = p.abs() - half[i];
        if beyond > 0.0 {
            sum += if p < 0.0 { -beyond } else { beyond } * along[i];
        }
    }
    sum
}

/// Share of the segment at which its squared distance is least; any of them where it is zero.
fn nearest_share(half: &Vector3<f64>, start: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) =
        (slope(half, start, along, low), slope(half, start, along, high));
    if at_low >= 0.0 {
        return low;
    }
    if at_high <= 0.0 {
        return high;
    }
    // Where the segment crosses the planes of the faces, the derivative has its kinks: between
    // the two nearest around its root it is linear.
    for i in 0..3 {
        for face in [-half[i], half[i]] {
            // For a segment parallel to the plane the share is huge, or zero.
            let share = (face - start[i]) / divisor(along[i]);
            if share > low && share < high {
                let at = slope(half, start, along, share);
                if at < 0.0 {
                    (low, at_low) = (share, at);
                } else {
                    (high, at_high) = (share, at);
                }
            }
        }
    }
    let root = low - at_low * (high - low) / (at_high - at_low);
    if root >= low && root <= high { root } else { high }
}

/// A face's signed distance along the segment: `at + slope * share`.
#[derive(Clone, Copy)]
struct Face {
    at: f64,
    slope: f64,
    normal: Vector3<f64>,
}

/// The deepest point of a segment that meets the box: the least, over the segment, of the largest
/// of six linear functions.
#[inline(never)]
fn deepest(half: &Vector3<f64>, start: &Vector3<f64>, along: &Vector3<f64>) -> SegmentDistance {
    let face = |k: usize| {
        let (i, sign) = (k / 2, if k.is_multiple_of(2) { 1.0 } else { -1.0 });
        let mut normal = Vector3::zeros();
        normal[i] = sign;
        Face { at: sign * start[i] - half[i], slope: sign * along[i], normal }
    };
    let faces: [Face; 6] = core::array::from_fn(face);
    let depth =
        |share: f64| faces.iter().map(|f| f.at + f.slope * share).fold(f64::NEG_INFINITY, f64::max);
    let mut best = (depth(0.0), 0.0);
    let mut consider = |share: f64| {
        let value = depth(share);
        if (0.0..=1.0).contains(&share) && value < best.0 {
            best = (value, share);
        }
    };
    consider(1.0);
    for j in 0..6 {
        for k in 0..j {
            consider((faces[j].at - faces[k].at) / divisor(faces[k].slope - faces[j].slope));
        }
    }
    let (value, share) = best;
    // The faces that hold the least from either side.
    let (mut falling, mut rising): (Option<Face>, Option<Face>) = (None, None);
    for f in faces {
        if f.at + f.slope * share < value - 1e-12 * (1.0 + value.abs()) {
            continue;
        }
        if f.slope <= falling.map_or(f64::INFINITY, |other| other.slope) {
            falling = Some(f);
        }
        if f.slope >= rising.map_or(f64::NEG_INFINITY, |other| other.slope) {
            rising = Some(f);
        }
    }
    let gradient = match (falling, rising) {
        (Some(a), Some(b)) if share > 0.0 && share < 1.0 && b.slope > a.slope => {
            let part = (b.slope / divisor(b.slope - a.slope)).clamp(0.0, 1.0);
            a.normal * part + b.normal * (1.0 - part)
        }
        (Some(a), _) if share >= 1.0 => a.normal,
        (_, Some(b)) => b.normal,
        _ => Vector3::x(),
    };
    SegmentDistance { value, gradient, point: start + along * share }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HALF: Vector3<f64> = Vector3::new(0.4, 0.3, 0.2);

    fn sampled(a: &Vector3<f64>, b: &Vector3<f64>, n: usize) -> f64 {
        (0..=n)
            .map(|i| signed_distance_to_box(&HALF, &(a + (b - a) * (i as f64 / n as f64))).value)
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn known_cases() {
        let at = |a: [f64; 3], b: [f64; 3]| segment_to_box(&HALF, &a.into(), &b.into());
        // Beside a face, past an edge, end on, through.
        assert!((at([-1.0, 0.0, 0.5], [1.0, 0.0, 0.5]).value - 0.3).abs() < 1e-15);
        let edge = at([0.0, 0.0, 1.2], [1.4, 0.0, -0.2]);
        assert!((edge.value - 0.6 / f64::sqrt(2.0)).abs() < 1e-15, "{edge:?}");
        assert!((at([2.0, 0.0, 0.0], [1.0, 0.0, 0.0]).value - 0.6).abs() < 1e-15);
        assert!((at([-1.0, 0.0, 0.1], [1.0, 0.0, 0.1]).value + 0.1).abs() < 1e-15);
        assert!((at([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]).value + 0.2).abs() < 1e-15);
        assert!(at([f64::NAN, 0.0, 0.0], [0.0, 0.0, 0.0]).value.is_nan());
    }

    proptest! {
        #[test]
        fn it_is_the_least_over_the_segment(
            a in prop::array::uniform3(-1.0..1.0f64),
            b in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (a, b) = (Vector3::from(a), Vector3::from(b));
            let exact = segment_to_box(&HALF, &a, &b);
            let n = 2000;
            let near = sampled(&a, &b, n);
            prop_assert!(exact.value <= near + 1e-12);
            prop_assert!(near - exact.value <= (b - a).norm() / n as f64);
            let there = signed_distance_to_box(&HALF, &exact.point).value;
            prop_assert!((there - exact.value).abs() < 1e-12);
        }

        /// Moving the whole segment changes the distance by the gradient.
        #[test]
        fn the_gradient_is_that_of_a_shift(
            a in prop::array::uniform3(-1.0..1.0f64),
            b in prop::array::uniform3(-1.0..1.0f64),
            d in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (a, b, d) = (Vector3::from(a), Vector3::from(b), Vector3::from(d) * 1e-7);
            let value = |shift: Vector3<f64>| segment_to_box(&HALF, &(a + shift), &(b + shift)).value;
            let exact = segment_to_box(&HALF, &a, &b);
            let (up, down) = (value(d) - value(Vector3::zeros()), value(Vector3::zeros()) - value(-d));
            // Kinks apart.
            prop_assume!((up - down).abs() < 1e-11);
            prop_assert!((up - exact.gradient.dot(&d)).abs() < 1e-11 + 1e-4 * d.norm());
        }
    }
}
