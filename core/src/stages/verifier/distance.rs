//! Distances of points, segments and boxes to a box, by search.
//!
//! The signed distance to a convex body is convex along a line, so that a tangent lies below it
//! and tells on which side the least lies and how much less it can be. A search by halves ends
//! when that is nothing: what it returns is certified by the tangents.

use nalgebra::{Matrix3, Vector3};
use remora_qp::dense::divisor;

/// Most that a distance may be above the least [m].
const RESOLUTION: f64 = 1e-10;

/// Most points of a segment that are looked at: halving a metre so often leaves less than
/// [`RESOLUTION`].
pub(crate) const MAX_HALVINGS: usize = 40;

/// Signed distance [m] from `point` to the box of half extents `half` about the origin, negative
/// inside, and how it changes in the direction `along` (per length of that).
pub(super) fn point_to_box(
    half: &Vector3<f64>,
    point: &Vector3<f64>,
    along: &Vector3<f64>,
) -> (f64, f64) {
    let beyond = Vector3::from_fn(|i, _| {
        // A coordinate that is NaN stays NaN.
        let over = point[i].abs() - half[i];
        if over <= 0.0 {
            0.0
        } else if point[i] < 0.0 {
            -over
        } else {
            over
        }
    });
    let distance = libm::sqrt(beyond.dot(&beyond));
    if distance > 0.0 || distance.is_nan() {
        return (distance, beyond.dot(along) / divisor(distance));
    }
    let (mut depth, mut slope) = (f64::INFINITY, 0.0);
    for i in 0..3 {
        let below = half[i] - point[i].abs();
        if below < depth {
            depth = below;
            slope = if point[i] < 0.0 { -along[i] } else { along[i] };
        }
    }
    (-depth, slope)
}

/// Least signed distance [m] of a point between `a` and `b` to the box of half extents `half` about
/// the origin. Where it is not below `cutoff`, any number that is not.
pub(super) fn segment_to_box(
    half: &Vector3<f64>,
    a: &Vector3<f64>,
    b: &Vector3<f64>,
    cutoff: f64,
) -> f64 {
    let along = b - a;
    let (mut low, mut high, mut nearest) = (0.0, 1.0, f64::INFINITY);
    // Bound: halvings.
    for _ in 0..MAX_HALVINGS {
        let at = 0.5 * (low + high);
        let (distance, slope) = point_to_box(half, &(a + along * at), &along);
        if !distance.is_finite() {
            return f64::NAN;
        }
        if distance < nearest {
            nearest = distance;
        }
        let least = distance - slope.abs() * 0.5 * (high - low);
        if least >= cutoff || least >= nearest - RESOLUTION {
            return nearest;
        }
        if slope > 0.0 {
            high = at;
        } else {
            low = at;
        }
    }
    nearest
}

/// A box, and where it is in the axes of another.
pub(super) struct Placed<'a> {
    /// Half edge lengths [m].
    pub half: &'a Vector3<f64>,
    /// From its axes to the other's.
    pub rotation: Matrix3<f64>,
    /// Its centre in the other's axes [m].
    pub center: Vector3<f64>,
}

/// Least signed distance [m] of an edge or axis of one of two boxes to the other box, `half` about
/// the origin and `placed` where it says. Where it is not below `cutoff`, any number that is not.
///
/// Of two boxes apart, one has an edge as near as they are. The axes are for boxes that overlap with
/// edges in each other's faces, which then are at no distance below zero.
pub(super) fn box_to_box(half: &Vector3<f64>, placed: &Placed<'_>, cutoff: f64) -> f64 {
    let Placed { half: other, rotation, center } = placed;
    let (from_center, _) = point_to_box(half, center, center);
    let least = from_center - libm::sqrt(other.dot(other));
    if least >= cutoff && least.is_finite() {
        return least;
    }
    let mut nearest = f64::INFINITY;
    for index in 0..LINES {
        let limit = if nearest < cutoff { nearest } else { cutoff };
        let (a, b) = line(other, index);
        let (a, b) = (center + rotation * a, center + rotation * b);
        let outer = segment_to_box(half, &a, &b, limit);
        let (a, b) = line(half, index);
        let (a, b) = (rotation.tr_mul(&(a - center)), rotation.tr_mul(&(b - center)));
        let inner = segment_to_box(other, &a, &b, limit);
        if !(outer.is_finite() && inner.is_finite()) {
            return f64::NAN;
        }
        nearest = nearest.min(outer).min(inner);
    }
    nearest
}

/// Edges and axes of a box.
const LINES: usize = 15;

/// The ends of an edge of a box, numbered from 0 to 11, or of its axis along x, y or z, from 12.
fn line(half: &Vector3<f64>, index: usize) -> (Vector3<f64>, Vector3<f64>) {
    let (axis, corner) = (index % 3, index / 3);
    let (second, third) = match corner {
        0 => (1.0, 1.0),
        1 => (-1.0, 1.0),
        2 => (1.0, -1.0),
        3 => (-1.0, -1.0),
        _ => (0.0, 0.0),
    };
    let mut from = *half;
    from[(axis + 1) % 3] *= second;
    from[(axis + 2) % 3] *= third;
    let mut to = from;
    to[axis] *= -1.0;
    (from, to)
}
