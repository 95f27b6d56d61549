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

/// The rotation vector [rad] of a unit quaternion, no longer than pi.
pub fn logarithm(q: &Quaternion) -> Vector3<f64> {
    let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
    let vector = Vector3::new(q[0], q[1], q[2]) * sign;
    let sine = length(&vector);
    if sine < 1e-9 { vector * 2.0 } else { vector * (2.0 * libm::atan2(sine, sign * q[3]) / sine) }
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
    let (s, c) = (libm::sin(angle), libm::cos(angle));
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

/// Something resolved in body axes, turned: `R I R^T`.
#[inline]
pub fn turned(inertia: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix3<f64> {
    rotation * inertia * rotation.transpose()
}
