//! Where the arm is, and how its points move with the joints.

use super::Multibody;
use nalgebra::{SMatrix, SVector, Vector3};

/// The arm at one set of joint angles: bus axes, from the bus's centre of mass.
#[derive(Clone, Copy, Debug)]
pub struct ArmPose<const NL: usize> {
    /// The joints [m].
    pub joint: [Vector3<f64>; NL],
    /// Their axes.
    pub axis: [Vector3<f64>; NL],
    /// Ends of the links' capsules [m].
    pub capsule: [[Vector3<f64>; 2]; NL],
    /// The end effector [m].
    pub end: Vector3<f64>,
    /// The system's centre of mass [m].
    pub center: Vector3<f64>,
    /// Its derivative by the joint angles [m/rad].
    pub center_by_joint: SMatrix<f64, 3, NL>,
}

impl<const NL: usize> ArmPose<NL> {
    /// Far end of link `i`: the next joint, or the end effector.
    pub fn tip(&self, i: usize) -> Vector3<f64> {
        if i + 1 < NL { self.joint[i + 1] } else { self.end }
    }

    /// Derivative by the joint angles of a `point` fixed to a link, or to the bus, in bus axes
    /// from the bus's centre of mass [m/rad].
    pub fn point_by_joint(&self, link: Option<usize>, point: &Vector3<f64>) -> SMatrix<f64, 3, NL> {
        let mut out = SMatrix::zeros();
        let Some(link) = link else { return out };
        for j in 0..NL.min(link + 1) {
            out.set_column(j, &self.axis[j].cross(&(point - self.joint[j])));
        }
        out
    }
}

impl<const NL: usize> Multibody<'_, NL> {
    /// The arm at `joint_angle`. Cost: a sine and cosine and about 200 flops a link.
    pub fn arm_pose(&self, joint_angle: &SVector<f64, NL>) -> ArmPose<NL> {
        let poses = self.link_poses(&Self::angles(joint_angle));
        let mut pose = ArmPose::<NL> {
            joint: core::array::from_fn(|i| poses[i].joint.to_vector()),
            axis: core::array::from_fn(|i| poses[i].axis.to_vector()),
            capsule: [[Vector3::zeros(); 2]; NL],
            end: self.servicer.arm_base_m,
            center: self.first_moment(&poses).to_vector() / self.total_mass,
            center_by_joint: SMatrix::zeros(),
        };
        // Mass and first moment of a link and its subtree.
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for (i, (link, at)) in self.servicer.links.iter().zip(&poses).enumerate().rev() {
            if i + 1 == NL {
                pose.end = pose.joint[i] + at.rotation.apply_constant(&link.tip_m).to_vector();
            }
            let turned = |v: &Vector3<f64>| at.rotation.apply_constant(v).to_vector();
            pose.capsule[i] = link.capsule(&pose.joint[i], &pose.tip(i), turned);
            mass += link.mass_kg;
            moment += at.center.to_vector() * link.mass_kg;
            let subtree = moment - pose.joint[i] * mass;
            let drift: Vector3<f64> = pose.axis[i].cross(&subtree) / self.total_mass;
            pose.center_by_joint.set_column(i, &drift);
        }
        pose
    }
}
