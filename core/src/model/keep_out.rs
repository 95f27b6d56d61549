//! Keep-out geometry: signed distance to a box.

use nalgebra::Vector3;
use remora_qp::dense::divisor;

/// A signed distance and where it grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedDistance {
    /// Distance to the box's surface [m]; negative inside.
    pub value: f64,
    /// Unit gradient with respect to the point. Where the distance has a kink (on edges and
    /// corners of the surface, on the box's medial planes) it is one of its limits there.
    pub gradient: Vector3<f64>,
}

/// Signed distance from `point` to the surface of a box centred at the origin, in the box's axes
/// [m]. `half_extents` are positive.
pub fn signed_distance_to_box(half_extents: &Vector3<f64>, point: &Vector3<f64>) -> SignedDistance {
    // Beyond each pair of faces by how much, on the positive side by symmetry.
    let beyond = point.abs() - half_extents;
    let sign = |i: usize| if point[i] < 0.0 { -1.0 } else { 1.0 };

    let outside = beyond.map(|d| d.max(0.0));
    let value = libm::sqrt(outside.dot(&outside));
    if value > 0.0 {
        let length = divisor(value);
        let gradient = Vector3::new(
            sign(0) * outside.x / length,
            sign(1) * outside.y / length,
            sign(2) * outside.z / length,
        );
        return SignedDistance { value, gradient };
    }
    // Inside or on the surface: the nearest face counts.
    let mut nearest = 0;
    for i in 1..3 {
        if beyond[i] > beyond[nearest] {
            nearest = i;
        }
    }
    let mut gradient = Vector3::zeros();
    gradient[nearest] = sign(nearest);
    SignedDistance { value: beyond[nearest], gradient }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HALF: Vector3<f64> = Vector3::new(0.4, 0.3, 0.2);

    fn at(x: f64, y: f64, z: f64) -> SignedDistance {
        signed_distance_to_box(&HALF, &Vector3::new(x, y, z))
    }

    #[test]
    fn faces_edges_corners_and_inside() {
        assert!((at(1.4, 0.1, -0.1).value - 1.0).abs() < 1e-15);
        assert_eq!(at(1.4, 0.1, -0.1).gradient, Vector3::x());
        assert_eq!(at(0.1, -1.3, 0.0).gradient, -Vector3::y());
        // Edge: 3-4-5 triangle in the x-y plane.
        let edge = at(0.7, 0.7, 0.1);
        assert!((edge.value - 0.5).abs() < 1e-15);
        assert!((edge.gradient - Vector3::new(0.6, 0.8, 0.0)).norm() < 1e-14);
        // Corner: (1, 2, 2) beyond it.
        let corner = at(1.4, -2.3, 2.2);
        assert!((corner.value - 3.0).abs() < 1e-15);
        assert!((corner.gradient - Vector3::new(1.0, -2.0, 2.0) / 3.0).norm() < 1e-14);
        // Inside, nearest to the -z face; at the centre, to a z face.
        assert!((at(0.05, 0.0, -0.15).value + 0.05).abs() < 1e-15);
        assert_eq!(at(0.05, 0.0, -0.15).gradient, -Vector3::z());
        assert_eq!(at(0.0, 0.0, 0.0).value, -0.2);
    }

    #[test]
    fn on_the_surface_it_is_zero_with_a_unit_gradient() {
        for point in [(0.4, 0.1, 0.1), (0.4, 0.3, 0.0), (0.4, 0.3, 0.2), (-0.4, -0.3, -0.2)] {
            let d = at(point.0, point.1, point.2);
            assert_eq!(d.value, 0.0);
            assert_eq!(d.gradient.norm(), 1.0);
        }
    }

    proptest! {
        #[test]
        fn it_is_a_distance(p in [-1.5..1.5f64, -1.5..1.5, -1.5..1.5], q in [-1.5..1.5f64, -1.5..1.5, -1.5..1.5]) {
            let (p, q) = (Vector3::from(p), Vector3::from(q));
            let (a, b) = (signed_distance_to_box(&HALF, &p), signed_distance_to_box(&HALF, &q));
            prop_assert!((a.gradient.norm() - 1.0).abs() < 1e-14);
            // Never changes faster than the point moves.
            prop_assert!((a.value - b.value).abs() <= (p - q).norm() + 1e-14);
            // Going back along the gradient by the distance ends on the surface.
            if a.value > 0.0 {
                let foot = p - a.gradient * a.value;
                prop_assert!(signed_distance_to_box(&HALF, &foot).value.abs() < 1e-14);
                // Outside, the box is convex: the tangent plane lies below the distance.
                prop_assert!(b.value >= a.value + a.gradient.dot(&(q - p)) - 1e-13);
            }
        }
    }
}
