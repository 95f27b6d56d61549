//! Rigid bodies: moved, merged, and whether there can be such a body.

use crate::pose::Pose;
use nalgebra::{Matrix3, Vector3};

/// Share of the largest moment by which the triangle inequality may fail: rounding.
const TRIANGLE_TOLERANCE: f64 = 1e-9;

/// Significant digits to which programs round their output.
const DIGITS: i32 = 6;

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

    /// Expresses the body in the frame in which its own has the pose `pose`.
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
        let mut moments = <[f64; 3]>::from(self.principal_axes().0);
        moments.sort_by(f64::total_cmp);
        moments
    }

    /// Principal moments of inertia [kg m^2], and their axes as columns.
    pub(crate) fn principal_axes(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let (mut matrix, mut axes) = (self.inertia, Matrix3::identity());
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                if let Some(turn) = turn(&matrix, p, q) {
                    matrix = turn.transpose() * matrix * turn;
                    axes *= turn;
                }
            }
        }
        (matrix.diagonal(), axes)
    }

    /// The nearest possible body, and the change of inertia [kg m^2], if only rounding makes this one impossible.
    /// Rounding is to six digits, or to `decimals` behind the point.
    pub(crate) fn without_rounding(&self, decimals: i32) -> Option<(Self, f64)> {
        if self.is_possible() {
            return None;
        }
        let (moments, axes) = self.principal_axes();
        // Integrals of squared distances along the principal axes are never negative.
        let squares = moments.map(|moment| 0.5 * moments.sum() - moment);
        let by = -2.0 * squares.min();
        let behind = 0.5 * 10.0_f64.powi(-decimals.clamp(DIGITS, 300));
        let leading = |x: f64| if x == 0.0 { 0.0 } else { 10.0_f64.powf(x.abs().log10().floor()) };
        let rounding =
            self.inertia.map(|x| behind.max(0.5 * leading(x) * 10.0_f64.powi(1 - DIGITS)));
        let largest_row = rounding.row_sum().max();
        if !(by <= rounding.trace() + 2.0 * largest_row) {
            return None;
        }
        let squares = squares.map(|square| square.max(0.0));
        let moments = squares.map(|square| squares.sum() - square);
        let inertia = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
        Some((Self { inertia: (inertia + inertia.transpose()) * 0.5, ..*self }, by))
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

/// The rotation of Jacobi's method that makes the entry `(p, q)` of a symmetric matrix zero; none where it is.
fn turn(matrix: &Matrix3<f64>, p: usize, q: usize) -> Option<Matrix3<f64>> {
    let off = matrix[(p, q)];
    if off == 0.0 {
        return None;
    }
    let ratio = (matrix[(q, q)] - matrix[(p, p)]) / (2.0 * off);
    let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let mut turn = Matrix3::identity();
    (turn[(p, p)], turn[(q, q)]) = (cosine, cosine);
    (turn[(p, q)], turn[(q, p)]) = (cosine * tangent, -cosine * tangent);
    Some(turn)
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
