//! Rotations: quaternions `[x, y, z, w]` (Hamilton, scalar last, body to inertial) and matrices.
//! Square roots, sines and cosines are libm's alone.

use nalgebra::{Matrix3, Vector3};

/// A rotation as `[x, y, z, w]`; its norm need not be one.
pub type Quaternion = [f64; 4];

/// No rotation.
pub const IDENTITY: Quaternion = [0.0, 0.0, 0.0, 1.0];

/// Length of a vector.
pub fn length(v: &Vector3<f64>) -> f64 {
    libm::sqrt(v.dot(v))
}

/// The vector over its length; not a number where it is zero.
pub fn unit(v: &Vector3<f64>) -> Vector3<f64> {
    v / length(v)
}

/// `a * b`: rotates by `b`, then by `a`.
pub fn product(a: &Quaternion, b: &Quaternion) -> Quaternion {
    let (u, v) = (Vector3::new(a[0], a[1], a[2]), Vector3::new(b[0], b[1], b[2]));
    let vector = v * a[3] + u * b[3] + u.cross(&v);
    [vector.x, vector.y, vector.z, a[3] * b[3] - u.dot(&v)]
}

/// The inverse of a unit quaternion.
pub fn inverse(q: &Quaternion) -> Quaternion {
    [-q[0], -q[1], -q[2], q[3]]
}

/// The quaternion at norm one.
pub fn normalized(q: &Quaternion) -> Quaternion {
    let norm = libm::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    q.map(|component| component / norm)
}

/// The quaternion of a rotation vector [rad].
pub fn exponential(vector: &Vector3<f64>) -> Quaternion {
    let angle = length(vector);
    // sin(x/2)/x: its series where the division would lose digits.
    let factor =
        if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { libm::sin(0.5 * angle) / angle };
    [factor * vector.x, factor * vector.y, factor * vector.z, libm::cos(0.5 * angle)]
}

/// The rotation matrix of a quaternion of any norm but zero.
#[inline]
pub fn matrix(q: &Quaternion) -> Matrix3<f64> {
    let [x, y, z, w] = *q;
    let s = 2.0 / (x * x + y * y + z * z + w * w);
    let (xs, ys, zs) = (x * s, y * s, z * s);
    let (xx, yy, zz) = (x * xs, y * ys, z * zs);
    let (xy, xz, yz) = (x * ys, x * zs, y * zs);
    let (wx, wy, wz) = (w * xs, w * ys, w * zs);
    Matrix3::new(
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )
}

/// The matrix of a rotation about a unit axis, by Rodrigues.
#[inline]
pub fn about(axis: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    let (s, c) = libm::sincos(angle);
    let (a, t) = (axis, 1.0 - c);
    Matrix3::new(
        t * a.x * a.x + c,
        t * a.x * a.y - s * a.z,
        t * a.x * a.z + s * a.y,
        t * a.x * a.y + s * a.z,
        t * a.y * a.y + c,
        t * a.y * a.z - s * a.x,
        t * a.x * a.z - s * a.y,
        t * a.y * a.z + s * a.x,
        t * a.z * a.z + c,
    )
}

/// `q' = 1/2 (w, 0) * q`, the rate `w` [rad/s] in inertial axes.
#[inline]
pub fn kinematics(q: &Quaternion, rate: &Vector3<f64>) -> Quaternion {
    product(&[0.5 * rate.x, 0.5 * rate.y, 0.5 * rate.z, 0.0], q)
}

/// `q' = 1/2 q * (w, 0)`, the rate `w` [rad/s] in body axes.
#[inline]
pub fn body_kinematics(q: &Quaternion, rate: &Vector3<f64>) -> Quaternion {
    product(q, &[0.5 * rate.x, 0.5 * rate.y, 0.5 * rate.z, 0.0])
}

/// `a b`, spelt out: nalgebra's general product costs several times as much.
#[inline]
pub fn times(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |j: usize| {
        let (x, y, z) = (b[(0, j)], b[(1, j)], b[(2, j)]);
        Vector3::new(
            a.m11 * x + a.m12 * y + a.m13 * z,
            a.m21 * x + a.m22 * y + a.m23 * z,
            a.m31 * x + a.m32 * y + a.m33 * z,
        )
    };
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// A symmetric tensor of body axes in the axes that the rotation leads to: `R I R^T`.
#[inline]
pub fn turned(inertia: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix3<f64> {
    let (t, r) = (times(rotation, inertia), rotation);
    let xx = t.m11 * r.m11 + t.m12 * r.m12 + t.m13 * r.m13;
    let xy = t.m11 * r.m21 + t.m12 * r.m22 + t.m13 * r.m23;
    let xz = t.m11 * r.m31 + t.m12 * r.m32 + t.m13 * r.m33;
    let yy = t.m21 * r.m21 + t.m22 * r.m22 + t.m23 * r.m23;
    let yz = t.m21 * r.m31 + t.m22 * r.m32 + t.m23 * r.m33;
    let zz = t.m31 * r.m31 + t.m32 * r.m32 + t.m33 * r.m33;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}
