use super::{Momenta, Multibody, Pose, Rates};
use crate::rotation::turned;
use nalgebra::{Matrix3, Vector3};

/// The mass matrix of rotation and joints about the system's centre of mass, translation eliminated,
/// in blocks: `[[system, coupling], [coupling^T, joints]]`. Composite bodies, inertial axes.
#[derive(Clone, Copy, Debug)]
pub struct MassMatrix<const NL: usize> {
    /// Inertia of all bodies about the centre of mass [kg m^2].
    pub system: Matrix3<f64>,
    /// Angular momentum of each joint's unit rate [kg m^2].
    pub coupling: [Vector3<f64>; NL],
    /// Joints against joints, rotors included [kg m^2].
    pub joints: [[f64; NL]; NL],
    /// Inertia of the bus about its own centre of mass, inertial axes.
    pub bus: Matrix3<f64>,
    /// Inertias of the links about their own centres of mass, inertial axes.
    pub links: [Matrix3<f64>; NL],
}

/// Inertia of a point mass at a place.
#[inline]
fn point(mass: f64, s: &Vector3<f64>) -> Matrix3<f64> {
    let m = s * mass;
    let (xx, yy, zz) = (m.x * s.x, m.y * s.y, m.z * s.z);
    let (xy, xz, yz) = (-m.x * s.y, -m.x * s.z, -m.y * s.z);
    Matrix3::new(yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy)
}

impl<const NL: usize> Multibody<NL> {
    /// The mass matrix of a pose.
    #[inline]
    pub fn mass_matrix(&self, pose: &Pose<NL>) -> MassMatrix<NL> {
        let (vehicle, zero) = (&self.vehicle, Vector3::zeros());
        let (mut composite, mut first) = (Matrix3::zeros(), zero);
        let (mut links, mut coupling) = ([Matrix3::zeros(); NL], [zero; NL]);
        let (mut joints, mut linear) = ([[0.0; NL]; NL], [zero; NL]);
        for k in (0..NL).rev() {
            let (link, center) = (&vehicle.joints[k].link, &pose.centers[k]);
            links[k] = turned(&link.inertia, &pose.rotations[k]);
            composite += links[k] + point(link.mass, center);
            first += center * link.mass;
            let (axis, pivot) = (&pose.axes[k], &pose.pivots[k]);
            // Momentum and angular momentum about the centre of mass, of a unit rate about the axis.
            linear[k] = axis.cross(&(first - pivot * self.outer[k]));
            coupling[k] = composite * axis - first.cross(&axis.cross(pivot));
        }
        for k in 0..NL {
            for j in 0..=k {
                let about_pivot = coupling[k] - pose.pivots[j].cross(&linear[k]);
                let element =
                    pose.axes[j].dot(&about_pivot) - linear[j].dot(&linear[k]) / self.mass;
                (joints[j][k], joints[k][j]) = (element, element);
            }
            joints[k][k] += vehicle.joints[k].armature;
        }
        let bus = turned(&vehicle.bus.inertia, &pose.bus_rotation);
        let system = composite + bus + point(vehicle.bus.mass, &pose.bus_center);
        MassMatrix { system, coupling, joints, bus, links }
    }
}

impl<const NL: usize> MassMatrix<NL> {
    /// Momenta of rates.
    pub fn momenta(&self, rates: &Rates<NL>) -> Momenta<NL> {
        let mut system = self.system * rates.bus;
        let mut joints = [0.0; NL];
        for j in 0..NL {
            system += self.coupling[j] * rates.joints[j];
            joints[j] = self.coupling[j].dot(&rates.bus);
            for k in 0..NL {
                joints[j] += self.joints[j][k] * rates.joints[k];
            }
        }
        Momenta { system, joints }
    }

    /// Rates of momenta, the rates of locked joints being zero.
    #[inline]
    pub fn rates(&self, momenta: &Momenta<NL>, locked: &[bool; NL]) -> Rates<NL> {
        let inverse = inverse(&self.system);
        let bare = inverse * momenta.system;
        let turned = self.coupling.map(|column| inverse * column);
        let mut right = [0.0; NL];
        let mut left = self.reduced(&turned);
        for j in 0..NL {
            right[j] = momenta.joints[j] - self.coupling[j].dot(&bare);
            if locked[j] {
                for k in 0..NL {
                    (left[j][k], left[k][j]) = (0.0, 0.0);
                }
                (left[j][j], right[j]) = (1.0, 0.0);
            }
        }
        solve(&mut left, &mut right);
        let mut bus = bare;
        for j in 0..NL {
            bus -= turned[j] * right[j];
        }
        Rates { bus, joints: right }
    }

    /// Inertia [kg m^2] that each joint moves while the others are held and the bus floats.
    pub fn felt(&self) -> [f64; NL] {
        let inverse = inverse(&self.system);
        let reduced = self.reduced(&self.coupling.map(|column| inverse * column));
        core::array::from_fn(|j| reduced[j][j])
    }

    /// Joints against joints with the bus floating: the Schur complement.
    #[inline]
    fn reduced(&self, turned: &[Vector3<f64>; NL]) -> [[f64; NL]; NL] {
        let mut reduced = self.joints;
        for j in 0..NL {
            for k in 0..NL {
                reduced[j][k] -= self.coupling[j].dot(&turned[k]);
            }
        }
        reduced
    }
}

/// Inverse of a symmetric positive definite matrix, by cofactors.
#[inline]
fn inverse(m: &Matrix3<f64>) -> Matrix3<f64> {
    let (a, b, c) = (m[(0, 0)], m[(0, 1)], m[(0, 2)]);
    let (d, e, f) = (m[(1, 1)], m[(1, 2)], m[(2, 2)]);
    let (aa, ab, ac) = (d * f - e * e, c * e - b * f, b * e - c * d);
    let (bb, bc, cc) = (a * f - c * c, b * c - a * e, a * d - b * b);
    let per = 1.0 / (a * aa + b * ab + c * ac);
    Matrix3::new(aa, ab, ac, ab, bb, bc, ac, bc, cc) * per
}

/// Solves a symmetric positive definite system in place, `L D L^T`; the matrix is used up.
#[inline]
fn solve<const N: usize>(m: &mut [[f64; N]; N], x: &mut [f64; N]) {
    for j in 0..N {
        let per = 1.0 / m[j][j];
        for i in j + 1..N {
            let factor = m[i][j] * per;
            for k in j + 1..=i {
                m[i][k] -= factor * m[k][j];
            }
            x[i] -= factor * x[j];
        }
        // The column is needed unscaled above; below it is what back substitution divides.
        for i in j + 1..N {
            m[i][j] *= per;
        }
        x[j] *= per;
    }
    for j in (0..N).rev() {
        for i in j + 1..N {
            x[j] -= m[i][j] * x[i];
        }
    }
}
