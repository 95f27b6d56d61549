//! The arm at one set of joint angles, with the exact derivatives that the search needs.

use crate::math::quaternion;
use crate::model::Servicer;
use nalgebra::{SVector, Vector3};
use remora_qp::dense::divisor;

/// A vector and what each joint does to it [1/rad].
#[derive(Clone, Copy)]
pub(super) struct Moving<const NL: usize> {
    pub value: Vector3<f64>,
    pub by_joint: [Vector3<f64>; NL],
}

/// Where the arm is: bus axes, from the bus's centre of mass.
pub(super) struct Pose<const NL: usize> {
    /// Joint axes.
    axis: [Vector3<f64>; NL],
    /// The joints [m].
    joint: [Vector3<f64>; NL],
    /// Ends of the links' capsules [m].
    pub capsule: [[Vector3<f64>; 2]; NL],
    /// The end effector [m].
    pub tip: Moving<NL>,
    /// The end effector's axis.
    pub tool: Moving<NL>,
    /// Unit vector from the system's centre of mass to the end effector.
    pub direction: Moving<NL>,
}

impl<const NL: usize> Pose<NL> {
    /// The arm at `angles` [rad], `tool` the end effector's axis in the last link's axes.
    pub fn new(servicer: &Servicer<NL>, tool: &Vector3<f64>, angles: &SVector<f64, NL>) -> Self {
        let [mut axis, mut joint, mut moment] = [[Vector3::zeros(); NL]; 3];
        let mut capsule = [[Vector3::zeros(); 2]; NL];
        let mut tip = servicer.arm_base_m;
        let mut attitude = quaternion::IDENTITY;
        for (i, link) in servicer.links.iter().enumerate() {
            attitude = quaternion::product(&attitude, &quaternion::exp(&(link.axis * angles[i])));
            let rotation = quaternion::rotation_matrix(&attitude);
            (axis[i], joint[i]) = (rotation * link.axis, tip);
            moment[i] = (tip + rotation * link.center_of_mass_m) * link.mass_kg;
            tip += rotation * link.tip_m;
            capsule[i] = link.capsule(&joint[i], &tip, |v| rotation * v);
        }
        let tool = quaternion::rotation_matrix(&attitude) * tool;
        let turned = |i: usize, arm: &Vector3<f64>| -> Vector3<f64> { axis[i].cross(arm) };
        let tip_by_joint = core::array::from_fn(|i| turned(i, &(tip - joint[i])));
        // Mass and first moment of what a joint carries.
        let (mut mass, mut carried) = (0.0, Vector3::zeros());
        let mut center_by_joint = [Vector3::zeros(); NL];
        let total = servicer.total_mass();
        for (i, link) in servicer.links.iter().enumerate().rev() {
            mass += link.mass_kg;
            carried += moment[i];
            center_by_joint[i] = turned(i, &(carried - joint[i] * mass)) / total;
        }
        Self {
            tip: Moving { value: tip, by_joint: tip_by_joint },
            tool: Moving { value: tool, by_joint: core::array::from_fn(|i| turned(i, &tool)) },
            direction: direction(tip - carried / total, |i| tip_by_joint[i] - center_by_joint[i]),
            axis,
            joint,
            capsule,
        }
    }

    /// Derivative of a `point` fixed to link `i` by the angle of joint `j` [m/rad].
    pub fn point_by_joint(&self, i: usize, point: &Vector3<f64>, j: usize) -> Vector3<f64> {
        if j > i { Vector3::zeros() } else { self.axis[j].cross(&(point - self.joint[j])) }
    }
}

/// The unit vector along `arm`, which joint `i` moves by `by_joint(i)`.
fn direction<const NL: usize>(
    arm: Vector3<f64>,
    by_joint: impl Fn(usize) -> Vector3<f64>,
) -> Moving<NL> {
    let reach = divisor(libm::sqrt(arm.dot(&arm)));
    let value = arm / reach;
    let across = |moved: Vector3<f64>| (moved - value * value.dot(&moved)) / reach;
    Moving { value, by_joint: core::array::from_fn(|i| across(by_joint(i))) }
}
