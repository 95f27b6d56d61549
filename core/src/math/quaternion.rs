//! Unit quaternions as attitude: Hamilton, scalar last `(x, y, z, w)`, mapping body to RTN.
//!
//! Perturbations are on the left, in RTN axes: `q <- exp(dtheta / 2) * q`, so that a small
//! `dtheta` is the rotation vector by which the body has turned, resolved in RTN.

use nalgebra::{Matrix3, Vector3, Vector4};

/// The identity attitude.
pub const IDENTITY: Vector4<f64> = Vector4::new(0.0, 0.0, 0.0, 1.0);

/// Hamilton product `a * b`: rotate by `b`, then by `a`.
#[inline]
pub fn product(a: &Vector4<f64>, b: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )
}

/// Conjugate: the inverse of a unit quaternion.
#[inline]
pub fn conjugate(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(-q.x, -q.y, -q.z, q.w)
}

/// Euclidean norm, with a correctly rounded square root.
#[inline]
pub fn norm(q: &Vector4<f64>) -> f64 {
    libm::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
}

/// The unit quaternion along `q`; not finite where `q` is zero or not finite.
#[inline]
pub fn normalized(q: &Vector4<f64>) -> Vector4<f64> {
    q / norm(q)
}

/// Rotation matrix of `q`, which need not be of unit length: only its direction counts.
// One copy of it makes images smaller: it is called in 50 places.
#[inline(never)]
pub fn rotation_matrix(q: &Vector4<f64>) -> Matrix3<f64> {
    let s = 2.0 / (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    let (xs, ys, zs) = (q.x * s, q.y * s, q.z * s);
    let (xx, yy, zz) = (q.x * xs, q.y * ys, q.z * zs);
    let (xy, xz, yz) = (q.x * ys, q.x * zs, q.y * zs);
    let (wx, wy, wz) = (q.w * xs, q.w * ys, q.w * zs);
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

/// Unit quaternion of a rotation matrix (Shepperd's method: divides by the largest component).
pub fn from_rotation_matrix(m: &Matrix3<f64>) -> Vector4<f64> {
    let trace = m[(0, 0)] + m[(1, 1)] + m[(2, 2)];
    let q = if trace > 0.0 {
        Vector4::new(
            m[(2, 1)] - m[(1, 2)],
            m[(0, 2)] - m[(2, 0)],
            m[(1, 0)] - m[(0, 1)],
            1.0 + trace,
        )
    } else if m[(0, 0)] >= m[(1, 1)] && m[(0, 0)] >= m[(2, 2)] {
        Vector4::new(
            1.0 + m[(0, 0)] - m[(1, 1)] - m[(2, 2)],
            m[(0, 1)] + m[(1, 0)],
            m[(0, 2)] + m[(2, 0)],
            m[(2, 1)] - m[(1, 2)],
        )
    } else if m[(1, 1)] >= m[(2, 2)] {
        Vector4::new(
            m[(0, 1)] + m[(1, 0)],
            1.0 + m[(1, 1)] - m[(0, 0)] - m[(2, 2)],
            m[(1, 2)] + m[(2, 1)],
            m[(0, 2)] - m[(2, 0)],
        )
    } else {
        Vector4::new(
            m[(0, 2)] + m[(2, 0)],
            m[(1, 2)] + m[(2, 1)],
            1.0 + m[(2, 2)] - m[(0, 0)] - m[(1, 1)],
            m[(1, 0)] - m[(0, 1)],
        )
    };
    normalized(&q)
}

/// Rate of `q` for an angular velocity `omega` relative to RTN, resolved in RTN [rad/s]:
/// `1/2 (omega, 0) * q`. Linear in `q`, which need not be of unit length.
#[inline]
pub fn derivative(q: &Vector4<f64>, omega: &Vector3<f64>) -> Vector4<f64> {
    product(&Vector4::new(omega.x, omega.y, omega.z, 0.0), q) * 0.5
}

/// Unit quaternion of a rotation vector [rad].
pub fn exp(theta: &Vector3<f64>) -> Vector4<f64> {
    let angle_squared = theta.x * theta.x + theta.y * theta.y + theta.z * theta.z;
    let (sinc_half, cos_half) = if angle_squared < 1e-8 {
        // Series of sin(a/2)/a and cos(a/2): the next terms are below 1e-18.
        (0.5 - angle_squared / 48.0, 1.0 - angle_squared / 8.0)
    } else {
        let angle = libm::sqrt(angle_squared);
        let (sin, cos) = libm::sincos(0.5 * angle);
        (sin / angle, cos)
    };
    normalized(&Vector4::new(
        theta.x * sinc_half,
        theta.y * sinc_half,
        theta.z * sinc_half,
        cos_half,
    ))
}

/// The shortest rotation vector of a unit quaternion [rad], of length at most pi: inverse of
/// [`exp`].
pub fn log(q: &Vector4<f64>) -> Vector3<f64> {
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let sin = libm::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
    let factor = if sin < 1e-8 { 2.0 } else { 2.0 * libm::atan2(sin, sign * q.w) / sin };
    Vector3::new(q.x, q.y, q.z) * (sign * factor)
}

/// Twice the vector part of `to * from^-1`, on the shorter way round: the small rotation in RTN
/// axes from `from` to `to` [rad], exact to third order. It is the chart in which attitude
/// defects are measured: smooth, and linear in the quaternions.
#[inline]
pub fn difference(to: &Vector4<f64>, from: &Vector4<f64>) -> Vector3<f64> {
    let d = product(to, &conjugate(from));
    let factor = if d.w < 0.0 { -2.0 } else { 2.0 };
    Vector3::new(d.x, d.y, d.z) * factor
}

/// The quaternion of the smallest rotation that turns unit vector `from` into unit vector `to`.
/// Where they oppose each other, the rotation is half a turn about an axis normal to both.
pub fn between(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector4<f64> {
    let cross = from.cross(to);
    let w = 1.0 + from.dot(to);
    if w > 1e-12 {
        return normalized(&Vector4::new(cross.x, cross.y, cross.z, w));
    }
    let axis = any_normal(from);
    Vector4::new(axis.x, axis.y, axis.z, 0.0)
}

/// A unit vector normal to unit vector `v`.
pub fn any_normal(v: &Vector3<f64>) -> Vector3<f64> {
    let helper = if v.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let n = v.cross(&helper);
    n / libm::sqrt(n.dot(&n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
        [-limit..limit, -limit..limit, -limit..limit].prop_map(Vector3::from)
    }

    fn unit() -> impl Strategy<Value = Vector4<f64>> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0]
            .prop_map(Vector4::from)
            .prop_filter("not near zero", |q| q.norm() > 0.1)
            .prop_map(|q| normalized(&q))
    }

    proptest! {
        #[test]
        fn log_inverts_exp(theta in vector(1.7)) {
            prop_assert!((log(&exp(&theta)) - theta).norm() < 1e-12);
        }

        #[test]
        fn matrix_of_product_is_product_of_matrices(a in unit(), b in unit()) {
            let error = rotation_matrix(&product(&a, &b)) - rotation_matrix(&a) * rotation_matrix(&b);
            prop_assert!(error.norm() < 1e-14);
        }

        #[test]
        fn matrix_round_trip(q in unit()) {
            let back = from_rotation_matrix(&rotation_matrix(&q));
            prop_assert!((1.0 - back.dot(&q).abs()) < 1e-14);
        }

        #[test]
        fn difference_is_left_perturbation(q in unit(), theta in vector(1e-4)) {
            let turned = product(&exp(&theta), &q);
            prop_assert!((difference(&turned, &q) - theta).norm() < 1e-11);
            prop_assert!((difference(&-turned, &q) - theta).norm() < 1e-11);
        }

        #[test]
        fn between_turns_one_into_the_other(a in unit(), b in unit()) {
            let from = rotation_matrix(&a) * Vector3::z();
            let to = rotation_matrix(&b) * Vector3::z();
            prop_assert!((rotation_matrix(&between(&from, &to)) * from - to).norm() < 1e-9);
        }
    }

    #[test]
    fn between_handles_opposite_vectors() {
        let v = Vector3::new(0.6, 0.0, -0.8);
        let q = between(&v, &-v);
        assert!((rotation_matrix(&q) * v + v).norm() < 1e-12);
    }
}
