//! The servicer of mission files.

use super::quantities::{Limits, Stops, rotation};
use super::{JointVector, MAX_JOINTS, Mission, unit};
use crate::error::FieldError;
use nalgebra::{Matrix3, Vector3};
use remora_core::advanced::model::forms::inertia;
use remora_core::advanced::model::{self, Link};
use serde::{Deserialize, Serialize};

/// Choice of what sets the arm's configuration at capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Capture {
    /// Its joint angles, which are given.
    #[default]
    Joints,
    /// The end effector's axis, which has to point into the port: joint angles are found.
    Pose,
}

/// `[servicer]` and `[[servicer.links]]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Servicer {
    /// Bus mass [kg].
    pub bus_mass_kg: f64,
    /// Bus inertia about its centre of mass, bus axes [kg m^2].
    #[serde(with = "inertia")]
    pub bus_inertia_kg_m2: Matrix3<f64>,
    /// Half edge lengths of the box that holds the bus [m].
    pub bus_half_extents_m: [f64; 3],
    /// Unit boresight, bus axes.
    pub boresight: [f64; 3],
    /// First joint from the bus centre of mass, bus axes [m].
    pub arm_base_m: [f64; 3],
    /// The rotation from the axes that the links are given in, at zero joint angles, to bus axes, where
    /// they are not the bus axes themselves: a unit quaternion `[x, y, z, w]`. Written missions have their
    /// links in bus axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm_base_rotation: Option<[f64; 4]>,
    /// Joint stops, plus and minus or lower and upper [rad].
    pub joint_angle_limit_rad: Vec<Stops>,
    /// Joint rate limits [rad/s].
    pub joint_rate_limit_rad_s: Limits,
    /// Joint angles at the start [rad].
    pub initial_joint_angle_rad: Vec<f64>,
    /// Choice of what sets the arm's configuration at capture.
    pub capture: Capture,
    /// Joint angles at capture [rad], with [`Capture::Joints`]; left out, the problem definition's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capture_joint_angle_rad: Option<Vec<f64>>,
    /// Unit axis of the end effector, last link's axes, with [`Capture::Pose`]; left out, its +z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_effector_axis: Option<[f64; 3]>,
    /// Force limits, RTN components [N].
    pub force_limit_n: Limits,
    /// Bus torque limits, body components [N m].
    pub bus_torque_limit_n_m: Limits,
    /// Joint torque limits [N m].
    pub joint_torque_limit_n_m: Limits,
    /// The links, from the bus outwards, one to seven; all of them where any is given.
    pub links: Vec<Link>,
}

impl Servicer {
    /// The servicer; joint angles at capture that are to be found are those of the start.
    pub(super) fn convert(&self) -> Result<model::Servicer<MAX_JOINTS>, FieldError> {
        let joints = self.links.len();
        let mount = match self.arm_base_rotation {
            Some(q) => Some(rotation(q, "servicer.arm_base_rotation")?),
            None => None,
        };
        let convert = |(i, link): (usize, &Link)| -> Result<Link, FieldError> {
            let axis = unit::direction(&link.axis.into(), || format!("servicer.links[{i}].axis"))?;
            let link = Link { axis: axis.into(), ..*link };
            Ok(mount.map_or(link, |mount| turned(&link, &mount)))
        };
        let mut links = [Link::default(); MAX_JOINTS];
        for (place, link) in links.iter_mut().zip(self.links.iter().enumerate().map(convert)) {
            *place = link?;
        }
        let key = "servicer.joint_angle_limit_rad";
        let [min_joint_angle, max_joint_angle] =
            Stops::all(&self.joint_angle_limit_rad, joints, key)?;
        Ok(model::Servicer {
            bus_mass_kg: self.bus_mass_kg,
            bus_inertia_kg_m2: self.bus_inertia_kg_m2,
            bus_half_extents_m: Vector3::from(self.bus_half_extents_m),
            boresight: unit::direction(&self.boresight, || "servicer.boresight".into())?.into(),
            arm_base_m: Vector3::from(self.arm_base_m),
            links,
            min_joint_angle_rad: min_joint_angle,
            max_joint_angle_rad: max_joint_angle,
            joint_rate_limit_rad_s: self
                .joint_rate_limit_rad_s
                .each(joints, "servicer.joint_rate_limit_rad_s")?,
            initial_joint_angle_rad: each(&self.initial_joint_angle_rad, joints, "initial")?,
            capture_joint_angle_rad: self.capture_angles()?,
            force_limit_n: self.force_limit_n.each(3, "servicer.force_limit_n")?,
            bus_torque_limit_n_m: self
                .bus_torque_limit_n_m
                .each(3, "servicer.bus_torque_limit_n_m")?,
            joint_torque_limit_n_m: self
                .joint_torque_limit_n_m
                .each(joints, "servicer.joint_torque_limit_n_m")?,
        })
    }

    fn capture_angles(&self) -> Result<JointVector, FieldError> {
        let joints = self.links.len();
        let usual = model::Servicer::default().capture_joint_angle_rad;
        match (self.capture, &self.capture_joint_angle_rad) {
            (Capture::Pose, _) => each(&self.initial_joint_angle_rad, joints, "initial"),
            (Capture::Joints, Some(angles)) => each(angles, joints, "capture"),
            (Capture::Joints, None) => each(usual.as_slice(), joints, "capture"),
        }
    }
}

/// The joint angles of the start or of capture, one for each joint.
fn each(angles: &[f64], joints: usize, when: &str) -> Result<JointVector, FieldError> {
    match angles.len() == joints {
        true => Ok(super::each(angles)),
        false => {
            let reason = format!("one number for each of {joints} joints, not {}", angles.len());
            Err(FieldError::new(format!("servicer.{when}_joint_angle_rad"), reason))
        }
    }
}

/// A link in axes from which `rotation` leads to those it is given in now.
fn turned(link: &Link, rotation: &Matrix3<f64>) -> Link {
    let inertia = rotation * link.inertia_kg_m2 * rotation.transpose();
    Link {
        tip_m: rotation * link.tip_m,
        center_of_mass_m: rotation * link.center_of_mass_m,
        // Rounding leaves it not quite symmetric.
        inertia_kg_m2: (inertia + inertia.transpose()) * 0.5,
        axis: rotation * link.axis,
        ..*link
    }
}

impl Servicer {
    /// The section of a servicer's first `joints` joints, every number given.
    pub(super) fn of(s: &model::Servicer<MAX_JOINTS>, joints: usize) -> Self {
        let of_arm = |numbers: &JointVector| numbers.as_slice()[..joints].to_vec();
        Self {
            bus_mass_kg: s.bus_mass_kg,
            bus_inertia_kg_m2: s.bus_inertia_kg_m2,
            bus_half_extents_m: s.bus_half_extents_m.into(),
            boresight: s.boresight.into(),
            arm_base_m: s.arm_base_m.into(),
            arm_base_rotation: None,
            joint_angle_limit_rad: Stops::of(
                &of_arm(&s.min_joint_angle_rad),
                &of_arm(&s.max_joint_angle_rad),
            ),
            joint_rate_limit_rad_s: Limits::of(&of_arm(&s.joint_rate_limit_rad_s)),
            initial_joint_angle_rad: of_arm(&s.initial_joint_angle_rad),
            capture: Capture::Joints,
            capture_joint_angle_rad: Some(of_arm(&s.capture_joint_angle_rad)),
            end_effector_axis: None,
            force_limit_n: Limits::of(s.force_limit_n.as_slice()),
            bus_torque_limit_n_m: Limits::of(s.bus_torque_limit_n_m.as_slice()),
            joint_torque_limit_n_m: Limits::of(&of_arm(&s.joint_torque_limit_n_m)),
            links: s.links[..joints].to_vec(),
        }
    }
}

impl Default for Servicer {
    /// The problem definition's; joint angles at capture stand in no file that says how to find them.
    fn default() -> Self {
        let built_in = Mission::default();
        let given = Self::of(&built_in.servicer, built_in.joints());
        Self { capture_joint_angle_rad: None, ..given }
    }
}
