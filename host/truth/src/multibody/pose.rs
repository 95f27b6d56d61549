use super::Multibody;
use crate::rotation::{Quaternion, about, matrix, times};
use nalgebra::{Matrix3, Vector3};

/// Where all bodies are, relative to the system's centre of mass, inertial axes.
#[derive(Clone, Copy, Debug)]
pub struct Pose<const NL: usize> {
    /// Bus to inertial axes.
    pub bus_rotation: Matrix3<f64>,
    /// Origin of the bus's frame [m].
    pub bus_origin: Vector3<f64>,
    /// Centre of mass of the bus [m].
    pub bus_center: Vector3<f64>,
    /// Link to inertial axes.
    pub rotations: [Matrix3<f64>; NL],
    /// Axes of the joints.
    pub axes: [Vector3<f64>; NL],
    /// Pivots of the joints [m].
    pub pivots: [Vector3<f64>; NL],
    /// Centres of mass of the links [m].
    pub centers: [Vector3<f64>; NL],
    /// End effector [m].
    pub tip: Vector3<f64>,
    /// Unit approach axis.
    pub approach: Vector3<f64>,
}

impl<const NL: usize> Multibody<NL> {
    /// The pose at an attitude of the bus and joint angles [rad].
    #[inline]
    pub fn pose(&self, attitude: &Quaternion, angles: &[f64; NL]) -> Pose<NL> {
        let vehicle = &self.vehicle;
        let zero = Vector3::zeros();
        let bus_rotation = matrix(attitude);
        let (mut rotations, mut axes) = ([bus_rotation; NL], [zero; NL]);
        let (mut pivots, mut centers) = ([zero; NL], [zero; NL]);
        // First from the bus frame's origin, then from the centre of mass.
        let (mut rotation, mut place) = (bus_rotation, zero);
        let bus_center = rotation * vehicle.bus.center;
        let mut sum = bus_center * vehicle.bus.mass;
        for j in 0..NL {
            let joint = &vehicle.joints[j];
            place += rotation * joint.pivot;
            axes[j] = rotation * joint.axis;
            rotation = times(&rotation, &about(&joint.axis, angles[j]));
            (rotations[j], pivots[j]) = (rotation, place);
            centers[j] = place + rotation * joint.link.center;
            sum += centers[j] * joint.link.mass;
        }
        let mean = sum / self.mass;
        for j in 0..NL {
            pivots[j] -= mean;
            centers[j] -= mean;
        }
        Pose {
            bus_rotation,
            bus_origin: -mean,
            bus_center: bus_center - mean,
            rotations,
            axes,
            pivots,
            centers,
            tip: place - mean + rotation * vehicle.tip,
            approach: rotation * vehicle.approach,
        }
    }
}
