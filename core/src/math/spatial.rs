//! Vectors and matrices of three over any [`Scalar`].

use super::Scalar;
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};
use nalgebra::{Matrix3, Vector3};

/// A vector of three scalars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<T>(pub [T; 3]);

impl<T: Scalar> Vec3<T> {
    /// The zero vector.
    pub const ZERO: Self = Self([T::ZERO; 3]);

    /// A constant vector: no derivatives.
    #[inline]
    pub fn constant(v: &Vector3<f64>) -> Self {
        Self([T::constant(v.x), T::constant(v.y), T::constant(v.z)])
    }

    /// Scalar product.
    #[inline]
    pub fn dot(self, other: Self) -> T {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    /// Vector product.
    #[inline]
    pub fn cross(self, other: Self) -> Self {
        let ([a0, a1, a2], [b0, b1, b2]) = (self.0, other.0);
        Self([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])
    }

    /// Product with a constant.
    #[inline]
    pub fn scaled(self, factor: f64) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }
}

impl Vec3<f64> {
    /// As an nalgebra vector.
    #[inline]
    pub fn to_vector(self) -> Vector3<f64> {
        Vector3::from(self.0)
    }

    /// This vector over another scalar.
    #[inline]
    pub fn lift<T: Scalar>(self) -> Vec3<T> {
        Vec3(self.0.map(T::constant))
    }
}

impl<T: Scalar> Add for Vec3<T> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<T: Scalar> Sub for Vec3<T> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<T: Scalar> Neg for Vec3<T> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1], -self.0[2]])
    }
}

impl<T: Scalar> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: T) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }
}

impl<T: Scalar> AddAssign for Vec3<T> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<T: Scalar> SubAssign for Vec3<T> {
    #[inline]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

/// A 3 x 3 matrix of scalars, by columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T>(pub [Vec3<T>; 3]);

impl<T: Scalar> Mat3<T> {
    /// A constant matrix: no derivatives.
    #[inline]
    pub fn constant(m: &Matrix3<f64>) -> Self {
        Self([0, 1, 2].map(|j| Vec3([0, 1, 2].map(|i| T::constant(m[(i, j)])))))
    }

    /// Rotation about a constant unit `axis` by the angle whose sine and cosine are given
    /// (Rodrigues' formula).
    #[inline]
    pub fn rotation(axis: &Vector3<f64>, (sin, cos): (T, T)) -> Self {
        let versine = T::constant(1.0) - cos;
        let outer = |a: f64, b: f64| versine * (a * b);
        let (x, y, z) = (axis.x, axis.y, axis.z);
        Self([
            Vec3([outer(x, x) + cos, outer(x, y) + sin * z, outer(x, z) - sin * y]),
            Vec3([outer(x, y) - sin * z, outer(y, y) + cos, outer(y, z) + sin * x]),
            Vec3([outer(x, z) + sin * y, outer(y, z) - sin * x, outer(z, z) + cos]),
        ])
    }

    /// `[a x]`: the matrix of a vector product.
    #[inline]
    pub fn cross_matrix(a: Vec3<T>) -> Self {
        let ([x, y, z], zero) = (a.0, T::ZERO);
        Self([Vec3([zero, z, -y]), Vec3([-z, zero, x]), Vec3([y, -x, zero])])
    }

    /// `[b x] [a x]`: the matrix of two vector products in a row.
    #[inline]
    pub fn double_cross(b: Vec3<T>, a: Vec3<T>) -> Self {
        let ([a0, a1, a2], [b0, b1, b2]) = (a.0, b.0);
        let (p0, p1, p2) = (a0 * b0, a1 * b1, a2 * b2);
        Self([
            Vec3([-p1 - p2, a1 * b0, a2 * b0]),
            Vec3([a0 * b1, -p2 - p0, a2 * b1]),
            Vec3([a0 * b2, a1 * b2, -p0 - p1]),
        ])
    }

    /// The outer product `a b^T`.
    #[inline]
    pub fn outer(a: Vec3<T>, b: Vec3<T>) -> Self {
        Self(b.0.map(|factor| a * factor))
    }

    /// The vector `v` with `v . x` the sum of the products of this matrix's entries with those of
    /// `[x x]`: the adjoint of [`Mat3::cross_matrix`].
    #[inline]
    pub fn axial(&self) -> Vec3<T> {
        let [Vec3([_, xy, xz]), Vec3([yx, _, yz]), Vec3([zx, zy, _])] = self.0;
        Vec3([yz - zy, zx - xz, xy - yx])
    }

    /// Trace.
    #[inline]
    pub fn trace(&self) -> T {
        self.0[0].0[0] + self.0[1].0[1] + self.0[2].0[2]
    }

    /// `M [a x] - [a x] M`: the change of the matrix of a linear map when what it maps from and to
    /// turns back about `a`.
    #[inline]
    pub fn turned_back(&self, a: Vec3<T>) -> Self {
        let (Self([x, y, z]), [a0, a1, a2]) = (*self, a.0);
        let columns = [y * a2 - z * a1, z * a0 - x * a2, x * a1 - y * a0];
        Self([columns[0] + x.cross(a), columns[1] + y.cross(a), columns[2] + z.cross(a)])
    }

    /// Matrix times vector.
    #[inline]
    pub fn apply(&self, v: Vec3<T>) -> Vec3<T> {
        self.0[0] * v.0[0] + self.0[1] * v.0[1] + self.0[2] * v.0[2]
    }

    /// Matrix times a constant vector.
    #[inline]
    pub fn apply_constant(&self, v: &Vector3<f64>) -> Vec3<T> {
        let column = |j: usize| Vec3(self.0[j].0.map(|x| x * v[j]));
        column(0) + column(1) + column(2)
    }

    /// Transposed matrix times vector.
    #[inline]
    pub fn apply_transposed(&self, v: Vec3<T>) -> Vec3<T> {
        Vec3([self.0[0].dot(v), self.0[1].dot(v), self.0[2].dot(v)])
    }

    /// Matrix product.
    #[inline]
    pub fn product(&self, other: &Self) -> Self {
        Self(other.0.map(|column| self.apply(column)))
    }
}

impl Mat3<f64> {
    /// This matrix over another scalar.
    #[inline]
    pub fn lift<T: Scalar>(&self) -> Mat3<T> {
        Mat3(self.0.map(Vec3::lift))
    }
}

impl<T: Scalar> Add for Mat3<T> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<T: Scalar> AddAssign for Mat3<T> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Unit};

    #[test]
    fn matrices_of_vector_products() {
        let (a, b) = (Vec3([1.0, -2.0, 0.5]), Vec3([0.3, 0.7, -1.1]));
        let v = Vec3([-0.4, 2.0, 3.0]);
        let difference = |x: Vec3<f64>, y: Vec3<f64>| (x - y).to_vector().norm();
        assert!(difference(Mat3::cross_matrix(a).apply(v), a.cross(v)) < 1e-15);
        assert!(difference(Mat3::double_cross(b, a).apply(v), b.cross(a.cross(v))) < 1e-14);
        assert!(difference(Mat3::outer(a, b).apply(v), a * b.dot(v)) < 1e-14);
        let m = Mat3([a, b, v]);
        let turn = Mat3::cross_matrix(v);
        let product: f64 = (0..3).map(|j| m.0[j].dot(Mat3::cross_matrix(a).0[j])).sum();
        assert!((m.axial().dot(a) - product).abs() < 1e-14);
        assert!((m.trace() - (a.0[0] + b.0[1] + v.0[2])).abs() < 1e-15);
        let back = m.apply(turn.apply(b)) - turn.apply(m.apply(b));
        assert!(difference(m.turned_back(v).apply(b), back) < 1e-13);
    }

    #[test]
    fn rotation_agrees_with_nalgebra() {
        let axis = Vector3::new(0.36, -0.48, 0.8);
        let ours = Mat3::rotation(&axis, 0.7f64.sin_cos());
        let theirs = Rotation3::from_axis_angle(&Unit::new_normalize(axis), 0.7);
        for j in 0..3 {
            for i in 0..3 {
                assert!((ours.0[j].0[i] - theirs.matrix()[(i, j)]).abs() < 1e-15);
            }
        }
        let v = Vector3::new(1.0, -2.0, 3.0);
        let back = ours.apply_transposed(ours.apply_constant(&v)).to_vector();
        assert!((back - v).norm() < 1e-14);
    }
}
