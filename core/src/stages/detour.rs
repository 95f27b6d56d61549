//! The sides on which Stage 1's initial guess can pass a target that stands in its way.

use crate::math::quaternion;
use crate::model::TargetState;
use nalgebra::{Matrix3, Vector3};

/// A face of the target's box, and the nodes at which a path is beyond its plane.
///
/// A path straight through the box is a saddle: keep-out pushes back and forth along the path, and no
/// step leads aside. The initial guess takes the cheapest detour, so that symmetry decides nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Detour {
    /// First and last node of the passage through the box.
    nodes: [usize; 2],
    /// Outward normal of the face, the target's body axes.
    normal: Vector3<f64>,
    /// Distance of the face from the target's centre [m].
    depth: f64,
}

impl Detour {
    /// The detours of a path in RTN that leads through the box, none where it does not: past the faces of the
    /// two axes with the shorter passage, in the order +x, -x, +y, -y, +z, -z.
    pub(super) fn all(
        half_extents: &Vector3<f64>,
        position: &[Vector3<f64>],
        target: &[TargetState],
    ) -> [Option<Self>; 6] {
        let (mut nodes, mut way, mut before) = (None, Vector3::zeros(), None);
        for (k, (position, target)) in position.iter().zip(target).enumerate() {
            let here = body_axes(target).tr_mul(position);
            let from = before.replace(here).unwrap_or(here);
            if leads_through(half_extents, &from, &here) {
                let [first, _] = nodes.unwrap_or([k.saturating_sub(1); 2]);
                nodes = Some([first, k]);
                way += here - from;
            }
        }
        let along = way.iamax();
        core::array::from_fn(|side| {
            let (axis, sign) = (side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
            let normal = Vector3::from_fn(|i, _| if i == axis { sign } else { 0.0 });
            let detour = |nodes| Self { nodes, normal, depth: half_extents.dot(&normal.abs()) };
            nodes.filter(|_| axis != along).map(detour)
        })
    }

    /// Keep-out of node `k` at `position` (RTN) as the face's plane moved out by `distance`: the distance that
    /// is missing, and its derivative. `None` at nodes that are free.
    pub(super) fn constraint(
        &self,
        k: usize,
        distance: f64,
        position: &Vector3<f64>,
        target: &TargetState,
    ) -> Option<(f64, Vector3<f64>)> {
        let [first, last] = self.nodes;
        let normal = body_axes(target) * self.normal;
        let missing = self.depth + distance - normal.dot(position);
        (first..=last).contains(&k).then_some((missing, -normal))
    }
}

/// The target's body axes in RTN.
fn body_axes(target: &TargetState) -> Matrix3<f64> {
    quaternion::rotation_matrix(&target.attitude)
}

/// Whether the straight line between two points meets a box centred at the origin, in the box's axes.
fn leads_through(half_extents: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
    let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5);
    // No plane separates them: neither a face's nor one along the line and an edge.
    let (h, reach, across) = (half_extents, half.abs(), middle.cross(&half).abs());
    let width = Vector3::new(
        h.y * reach.z + h.z * reach.y,
        h.z * reach.x + h.x * reach.z,
        h.x * reach.y + h.y * reach.x,
    );
    let (faces, edges) = (middle.abs() - h - reach, across - width);
    faces.iter().chain(&edges).all(|gap| *gap <= 0.0)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::math::quaternion::IDENTITY;

    const HALF: Vector3<f64> = Vector3::new(0.4, 0.4, 0.2);
    const AT_REST: TargetState =
        TargetState { attitude: IDENTITY, rate: Vector3::new(0.0, 0.0, 0.0) };

    fn normals(path: &[[f64; 3]]) -> std::vec::Vec<Vector3<f64>> {
        let position: std::vec::Vec<_> = path.iter().map(|p| Vector3::from(*p)).collect();
        let target = std::vec![AT_REST; path.len()];
        let detours = Detour::all(&HALF, &position, &target).into_iter().flatten();
        detours.map(|detour| detour.normal).collect()
    }

    #[test]
    fn a_line_meets_the_box_or_passes_it() {
        let meets = |from: [f64; 3], to: [f64; 3]| leads_through(&HALF, &from.into(), &to.into());
        assert!(meets([0.0, 0.0, -5.0], [0.0, 0.0, 5.0]));
        assert!(meets([0.1, 0.1, 0.1], [0.2, 0.1, 0.1]));
        assert!(!meets([0.0, 0.0, -5.0], [0.0, 0.0, -0.3]));
        assert!(!meets([0.5, 0.0, -5.0], [0.5, 0.0, 5.0]));
        // Past an edge: the line crosses both of its faces' planes beyond it.
        assert!(!meets([0.0, 0.0, 0.7], [0.7, 0.0, 0.0]));
        assert!(meets([0.0, 0.0, 0.4], [0.7, 0.0, 0.0]));
        assert!(!meets([f64::NAN; 3], [0.0; 3]));
    }

    #[test]
    fn a_path_through_the_box_has_four_sides_across_it() {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert!(normals(&[[0.0, 0.0, 5.0], [0.0, 0.0, 1.0]]).is_empty());
        assert_eq!(normals(&[[0.0, 0.0, -5.0], [0.0, 0.0, 1.0]]), [x, -x, y, -y]);
        assert_eq!(normals(&[[5.0, 0.0, 0.0], [-5.0, 0.0, 0.0]]), [y, -y, z, -z]);
        assert_eq!(normals(&[[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]), [y, -y, z, -z]);
    }
}
