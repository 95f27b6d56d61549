//! Where an arm is mounted on a bus that is not its own, unless that is said.

use nalgebra::{Rotation3, Vector3};
use remora_urdf::Pose;
use std::f64::consts::PI;

/// Shifts on the face as shares of the way to its edge, after none: arms whose joints are offset cannot
/// have their end effector on the axis of their first joint.
const SHIFTS: [f64; 3] = [0.2, 0.4, 0.6];

/// The poses that are tried, one after the other: +z along the boresight, where it leaves the box, and
/// shifted from there along the bus axes across it.
pub(super) fn candidates(half_extents: &Vector3<f64>, boresight: &Vector3<f64>) -> Vec<Pose> {
    let ways = half_extents.zip_map(boresight, |half, along| half / along.abs());
    let middle = boresight * ways.min();
    let rotation = Rotation3::rotation_between(&Vector3::z(), boresight)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), PI))
        .into_inner();
    let face = ways.imin();
    let across = [(face + 1) % 3, (face + 2) % 3];
    let mut out = vec![Pose { position: middle, rotation }];
    for share in SHIFTS {
        for axis in across {
            for sign in [1.0, -1.0] {
                let mut position = middle;
                position[axis] += sign * share * (half_extents[axis] - middle[axis].abs());
                out.push(Pose { position, rotation });
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arm_stands_on_the_face_that_the_boresight_leaves() {
        let half = Vector3::new(0.5, 0.6, 0.7);
        for boresight in [Vector3::z(), -Vector3::z(), Vector3::x(), Vector3::new(0.0, 0.6, 0.8)] {
            let poses = candidates(&half, &boresight);
            assert_eq!(poses.len(), 13);
            for pose in poses {
                assert!((pose.rotation * Vector3::z() - boresight).norm() < 1e-15);
                let beyond = (pose.position.abs() - half).max();
                assert!(beyond.abs() < 1e-15, "{pose:?}");
            }
        }
    }
}
