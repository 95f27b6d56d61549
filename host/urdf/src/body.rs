//! Rigid bodies: moved, merged, and whether there can be such a body.

use crate::pose::Pose;
use nalgebra::{Matrix3, Vector3};

/// Share of the largest moment by which the triangle inequality may fail: rounding.
const TRIANGLE_TOLERANCE: f64 = 1e-9;

/// Sweeps of Jacobi's method: a symmetric 3x3 matrix is diagonal to rounding after five.
const SWEEPS: usize = 12;

/// Mass, centre of mass and inertia of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass, from the frame's origin [m].
    pub center_of_mass: Vector3<f64>,
    /// Inertia about the centre of mass, along the frame's axes [kg m^2].
    pub inertia: Matrix3<f64>,
}

impl Body {
    /// Nothing.
    pub(crate) fn none() -> Self {
        Self { mass: 0.0, center_of_mass: Vector3::zeros(), inertia: Matrix3::zeros() }
    }

    /// The same body in the frame in which its own has the pose `pose`.
    pub(crate) fn seen_from(&self, pose: &Pose) -> Self {
        let inertia = pose.rotation * self.inertia * pose.rotation.transpose();
        Self {
            mass: self.mass,
            center_of_mass: pose.point(&self.center_of_mass),
            // Rounding must not leave a product of inertia with two values.
            inertia: (inertia + inertia.transpose()) * 0.5,
        }
    }

    /// Both bodies as one, by the parallel-axis theorem.
    pub fn merged(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if !(mass > 0.0) {
            return Self { mass: 0.0, ..*self };
        }
        let center_of_mass =
            (self.center_of_mass * self.mass + other.center_of_mass * other.mass) / mass;
        let about = |body: &Self| {
            let offset = body.center_of_mass - center_of_mass;
            body.inertia
                + (Matrix3::identity() * offset.dot(&offset) - offset * offset.transpose())
                    * body.mass
        };
        Self { mass, center_of_mass, inertia: about(self) + about(other) }
    }

    /// Principal moments of inertia, the least first [kg m^2].
    pub fn principal_moments(&self) -> [f64; 3] {
        let mut matrix = self.inertia;
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                matrix = rotated(&matrix, p, q);
            }
        }
        let mut moments = [matrix[(0, 0)], matrix[(1, 1)], matrix[(2, 2)]];
        moments.sort_by(f64::total_cmp);
        moments
    }

    /// Radii of gyration about the principal axes, the least first [m]; zero for a body without mass.
    pub fn radii_of_gyration(&self) -> [f64; 3] {
        let mass = self.mass;
        self.principal_moments().map(|m| if mass > 0.0 { (m.max(0.0) / mass).sqrt() } else { 0.0 })
    }

    /// Whether some body has this inertia: no moment is negative or more than the sum of the others.
    pub(crate) fn is_possible(&self) -> bool {
        let [a, b, c] = self.principal_moments();
        let slack = TRIANGLE_TOLERANCE * c.abs();
        a >= -slack && a + b >= c - slack
    }

    /// Whether the inertia is positive definite.
    pub(crate) fn has_extent(&self) -> bool {
        let [a, _, c] = self.principal_moments();
        a > TRIANGLE_TOLERANCE * c
    }
}

/// One rotation of Jacobi's method: makes the entry `(p, q)` of a symmetric matrix zero.
fn rotated(matrix: &Matrix3<f64>, p: usize, q: usize) -> Matrix3<f64> {
    let off = matrix[(p, q)];
    if off == 0.0 {
        return *matrix;
    }
    let ratio = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
    let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let mut turn = Matrix3::identity();
    (turn[(p, p)], turn[(q, q)]) = (cosine, cosine);
    (turn[(p, q)], turn[(q, p)]) = (cosine * tangent, -cosine * tangent);
    turn.transpose() * matrix * turn
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(moments: [f64; 3]) -> Body {
        let inertia = Matrix3::from_diagonal(&Vector3::from(moments));
        Body { mass: 2.0, center_of_mass: Vector3::zeros(), inertia }
    }

    #[test]
    fn principal_moments_do_not_depend_on_the_axes() {
        let turned =
            body([3.0, 1.0, 2.5]).seen_from(&Pose::from_xyz_rpy([0.0; 3], [0.3, -1.1, 2.0]));
        for (found, expected) in turned.principal_moments().iter().zip([1.0, 2.5, 3.0]) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
    }

    #[test]
    fn a_rod_is_its_two_halves() {
        let rod = |mass: f64, length: f64| {
            let across = mass * length * length / 12.0;
            Body { mass, ..body([across, across, 0.0]) }
        };
        let half = |z: f64| rod(3.0, 0.5).seen_from(&Pose::shift(Vector3::new(0.0, 0.0, z)));
        let whole = half(0.25).merged(&half(0.75));
        let expected = rod(6.0, 1.0).seen_from(&Pose::shift(Vector3::new(0.0, 0.0, 0.5)));
        assert!((whole.inertia - expected.inertia).norm() < 1e-15);
        assert_eq!(whole.center_of_mass, expected.center_of_mass);
    }

    #[test]
    fn an_inertia_is_possible_or_not() {
        assert!(body([1.0, 1.0, 2.0]).is_possible());
        assert!(!body([1.0, 1.0, 2.1]).is_possible());
        assert!(!body([-0.1, 1.0, 1.0]).is_possible());
        assert!(body([0.0; 3]).is_possible() && !body([0.0; 3]).has_extent());
    }
}
