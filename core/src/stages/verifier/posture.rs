//! Where the arm is, and how the bus begins: derived from section 3 and section 8 a second time.

use crate::model::Servicer;
use nalgebra::{Matrix3, SVector, Vector3, Vector4};

/// The arm at one set of joint angles, bus axes, from the bus centre of mass [m].
pub(super) struct Posture<const NL: usize> {
    /// Ends of the links' capsules.
    pub capsules: [[Vector3<f64>; 2]; NL],
    /// The end effector.
    pub tip: Vector3<f64>,
    /// The centre of mass of bus and arm.
    pub center: Vector3<f64>,
    /// The last link's axes, as columns in bus axes.
    pub last_axes: Matrix3<f64>,
}

impl<const NL: usize> Posture<NL> {
    /// By the links' rotation matrices, with Rodrigues' formula for each joint.
    pub fn new(servicer: &Servicer<NL>, angles: &SVector<f64, NL>) -> Self {
        let mut capsules = [[Vector3::zeros(); 2]; NL];
        let (mut rotation, mut tip) = (Matrix3::identity(), servicer.arm_base_m);
        let (mut mass, mut moment) = (servicer.bus_mass_kg, Vector3::zeros());
        for ((link, angle), capsule) in servicer.links.iter().zip(angles.iter()).zip(&mut capsules)
        {
            let joint = tip;
            let (sin, cos) = libm::sincos(*angle);
            let cross = link.axis.cross_matrix();
            rotation *= Matrix3::identity() + cross * sin + cross * cross * (1.0 - cos);
            moment += (tip + rotation * link.center_of_mass_m) * link.mass_kg;
            mass += link.mass_kg;
            tip += rotation * link.tip_m;
            *capsule = link.capsule(&joint, &tip, |v| rotation * v);
        }
        Self { capsules, tip, center: moment / mass, last_axes: rotation }
    }

    /// The arm at capture.
    pub fn at_capture(servicer: &Servicer<NL>) -> Self {
        Self::new(servicer, &servicer.capture_joint_angle_rad)
    }

    /// The end effector from the system's centre of mass.
    pub fn arm(&self) -> Vector3<f64> {
        self.tip - self.center
    }

    /// Distance of the end effector from the system's centre of mass [m].
    pub fn reach(&self) -> f64 {
        let arm = self.arm();
        libm::sqrt(arm.dot(&arm))
    }
}

/// The bus attitude a scenario starts with, body to RTN: +z from the system centre of mass
/// (`position`, RTN) to the target's centre, +x the projection of the along-track axis normal to it
/// (of the orbit normal where those nearly coincide).
///
/// By Euler angles: longitude and colatitude of +z, then the turn about it.
pub(super) fn initial_bus_attitude(position: &Vector3<f64>) -> Vector4<f64> {
    let z = -position / libm::sqrt(position.dot(position));
    let longitude = libm::atan2(z.y, z.x);
    let colatitude = libm::atan2(libm::sqrt(z.x * z.x + z.y * z.y), z.z);
    let ((sin, cos), (sin_c, cos_c)) = (libm::sincos(longitude), libm::sincos(colatitude));
    // Before the turn about +z, the bus's x and y axes point south and east.
    let (south, east) =
        (Vector3::new(cos_c * cos, cos_c * sin, -sin_c), Vector3::new(-sin, cos, 0.0));
    let x = if z.y.abs() > 0.99 { Vector3::z() } else { Vector3::y() };
    let turn = libm::atan2(x.dot(&east), x.dot(&south));
    let (sin_half, cos_half) = libm::sincos(0.5 * colatitude);
    let (sin_sum, cos_sum) = libm::sincos(0.5 * (longitude + turn));
    let (sin_less, cos_less) = libm::sincos(0.5 * (longitude - turn));
    Vector4::new(-sin_half * sin_less, sin_half * cos_less, cos_half * sin_sum, cos_half * cos_sum)
}
