//! Distances: against sampling, alternating projections, and by hand.

use super::super::distance::{Placed, box_to_box, point_to_box, segment_to_box};
use crate::math::quaternion;
use nalgebra::{Matrix3, Vector3, Vector4};
use proptest::prelude::*;

const HALF: Vector3<f64> = Vector3::new(0.4, 0.3, 0.2);
const FAR: f64 = f64::INFINITY;

fn to_box(a: [f64; 3], b: [f64; 3]) -> f64 {
    segment_to_box(&HALF, &Vector3::from(a), &Vector3::from(b), FAR)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn segments_whose_distance_is_plain() {
    // Along a face, across an edge, past a corner, a point.
    assert!(close(to_box([-2.0, 0.0, 0.5], [2.0, 0.1, 0.5]), 0.3));
    assert!(close(to_box([1.4, 0.0, 0.0], [0.4, 0.0, 1.2]), 1.0 / 2.44_f64.sqrt()));
    assert!(close(to_box([1.4, 2.3, 2.2], [2.4, 3.3, 3.2]), 3.0));
    assert!(close(to_box([0.7, 0.7, 0.0], [0.7, 0.7, 0.0]), 0.5));
    // Through the middle, with one end inside, touching a face.
    assert!(close(to_box([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]), -0.2));
    assert!(close(to_box([0.35, 0.0, 0.0], [1.0, 0.0, 0.0]), -0.05));
    assert!(close(to_box([0.1, 0.1, 0.2], [0.1, 0.1, 1.0]), 0.0));
}

#[test]
fn what_is_not_a_number_has_no_distance() {
    for value in [f64::NAN, f64::INFINITY] {
        assert!(to_box([value, 0.0, 0.0], [1.0, 0.0, 0.0]).is_nan());
        assert!(to_box([1.0, 0.0, 0.0], [1.0, 0.0, value]).is_nan());
        let center = Vector3::new(0.0, value, 0.0);
        let placed = Placed { half: &HALF, rotation: Matrix3::identity(), center };
        assert!(box_to_box(&HALF, &placed, 0.1).is_nan());
        let rotation = Matrix3::repeat(value);
        let placed = Placed { half: &HALF, rotation, center: Vector3::x() * 1.2 };
        assert!(box_to_box(&HALF, &placed, FAR).is_nan());
    }
    let (distance, _) = point_to_box(&HALF, &Vector3::new(0.0, f64::NAN, 3.0), &Vector3::x());
    assert!(distance.is_nan());
}

#[test]
fn boxes_whose_distance_is_plain() {
    let at = |center, rotation| box_to_box(&HALF, &Placed { half: &HALF, rotation, center }, FAR);
    assert!(close(at(Vector3::new(0.0, 0.0, 1.0), Matrix3::identity()), 0.6));
    assert!(close(at(Vector3::new(0.9, 1.2, 0.0), Matrix3::identity()), 0.37_f64.sqrt()));
    // One in the other's place but for 0.1, and one within the other.
    assert!(close(at(Vector3::new(0.7, 0.0, 0.0), Matrix3::identity()), -0.1));
    let small =
        Placed { half: &(HALF * 0.1), rotation: Matrix3::identity(), center: Vector3::zeros() };
    assert!(close(box_to_box(&HALF, &small, FAR), -0.2));
    assert!(close(box_to_box(small.half, &Placed { half: &HALF, ..small }, FAR), -0.2));
    // An edge towards an edge.
    let turn = |axis: Vector3<f64>| {
        quaternion::rotation_matrix(&quaternion::exp(&(axis * core::f64::consts::FRAC_PI_4)))
    };
    let cube = Vector3::repeat(0.5);
    let edge = 0.5_f64.sqrt();
    let crossed = turn(Vector3::x()).transpose() * turn(Vector3::y());
    let center = turn(Vector3::x()).transpose() * Vector3::new(0.0, 0.0, 2.0 * edge + 0.3);
    assert!(close(box_to_box(&cube, &Placed { half: &cube, rotation: crossed, center }, FAR), 0.3));
}

/// The distance of two boxes apart by projections on the one and the other in turn.
fn by_projections(a: &Vector3<f64>, b: &Placed<'_>) -> f64 {
    let onto = |half: &Vector3<f64>, p: &Vector3<f64>| {
        Vector3::from_fn(|i, _| p[i].clamp(-half[i], half[i]))
    };
    let (mut p, mut q) = (Vector3::zeros(), b.center);
    for _ in 0..4000 {
        p = onto(a, &q);
        q = b.center + b.rotation * onto(b.half, &b.rotation.tr_mul(&(p - b.center)));
    }
    (p - q).norm()
}

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-limit..limit, -limit..limit, -limit..limit].prop_map(Vector3::from)
}

fn rotation() -> impl Strategy<Value = Matrix3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.1..1.0]
        .prop_map(|q| quaternion::rotation_matrix(&Vector4::from(q)))
}

/// Cut off, a distance is the same below the cutoff, and not below it elsewhere.
fn agrees(found: f64, cut: f64, cutoff: f64) -> bool {
    if found < cutoff { close(cut, found) } else { cut >= cutoff }
}

proptest! {
    #[test]
    fn a_segment_is_as_near_as_its_nearest_point(
        a in vector(1.0), b in vector(1.0), cutoff in -0.2..1.0,
    ) {
        let samples = 1000;
        let distance = |k: i32| {
            let p = a + (b - a) * (f64::from(k) / f64::from(samples));
            point_to_box(&HALF, &p, &p).0
        };
        let sampled = (0..=samples).map(distance).fold(f64::INFINITY, f64::min);
        let found = segment_to_box(&HALF, &a, &b, FAR);
        prop_assert!(found <= sampled + 1e-9);
        prop_assert!(found >= sampled - (b - a).norm() / f64::from(samples));
        prop_assert!((segment_to_box(&HALF, &b, &a, FAR) - found).abs() < 1e-9);
        let cut = segment_to_box(&HALF, &a, &b, cutoff);
        prop_assert!(agrees(found, cut, cutoff));
    }

    #[test]
    fn the_slope_is_that_of_the_distance(p in vector(1.0), along in vector(1.0)) {
        let (before, slope) = point_to_box(&HALF, &p, &along);
        let (after, _) = point_to_box(&HALF, &(p + along), &along);
        // A tangent of a convex function, as steep as the way is long at most.
        prop_assert!(after >= before + slope - 1e-12);
        prop_assert!(slope.abs() <= along.norm() + 1e-12);
    }

    #[test]
    fn boxes_are_as_near_as_projections_say(center in vector(2.0), rotation in rotation()) {
        let other = Vector3::new(0.5, 0.4, 0.6);
        let placed = Placed { half: &other, rotation, center };
        let found = box_to_box(&HALF, &placed, FAR);
        let back = Placed {
            half: &HALF,
            rotation: rotation.transpose(),
            center: -(rotation.transpose() * center),
        };
        prop_assert!((box_to_box(&other, &back, FAR) - found).abs() < 1e-9);
        let projected = by_projections(&HALF, &placed);
        if found > 0.0 {
            prop_assert!((projected - found).abs() < 1e-3, "{} {}", projected, found);
            prop_assert!(found <= projected + 1e-9);
        } else {
            prop_assert!(projected < 1e-3);
        }
        let cut = box_to_box(&HALF, &placed, 0.3);
        prop_assert!(agrees(found, cut, 0.3));
    }
}
