//! The servicer of a mission file from an arm on a bus.

use super::bus::ArmOnBus;
use crate::error::Error;
use crate::formats::{Limits, MissionCapture, MissionFile, MissionServicer, Radius, Stops};
use nalgebra::Vector3;
use remora_core::advanced::model::Link;
use remora_urdf::Joint;

/// Weight of joint rates where the bus's mission has none: joints that are strong and fast would turn for nothing.
/// A fifth of it leaves some such turns, five times as much leaves some plans without an end.
const JOINT_MOTION: f64 = 0.2;

/// The mission file: the arm starts straight, as far as its stops let it, and finds its joint angles at
/// capture. What follows from an arm follows from this one.
pub(super) fn mission_file(settled: &ArmOnBus, axis: &Vector3<f64>) -> MissionFile {
    let ArmOnBus { arm, body, half_extents, boresight, mission, .. } = settled;
    let mut file = mission.clone();
    file.typical = None;
    file.roll = None;
    if file.weights.joint_motion == 0.0 {
        file.weights.joint_motion = JOINT_MOTION;
    }
    file.approach.keep_out_far_m = Radius::Auto;
    file.approach.keep_out_near_m = Radius::Auto;
    let joints = &arm.joints;
    file.servicer = MissionServicer {
        bus_mass_kg: body.mass,
        bus_inertia_kg_m2: body.inertia,
        bus_half_extents_m: (*half_extents).into(),
        boresight: (*boresight).into(),
        arm_base_m: (arm.arm_base - body.center_of_mass).into(),
        arm_base_rotation: None,
        joint_angle_limit_rad: joints.iter().map(stops).collect(),
        joint_rate_limit_rad_s: limits(joints.iter().map(|joint| joint.limits.rate)),
        joint_torque_limit_n_m: limits(joints.iter().map(|joint| joint.limits.torque)),
        initial_joint_angle_rad: joints.iter().map(straight).collect(),
        capture: MissionCapture::Pose,
        capture_joint_angle_rad: None,
        end_effector_axis: Some((*axis).into()),
        links: joints.iter().map(link).collect(),
        ..file.servicer
    };
    file
}

/// Gives the joints rotors of these inertias [kg m^2], all of them the same where there is one.
///
/// # Errors
/// Neither one nor one for each joint, or one that is negative.
pub(super) fn give_rotors(file: &mut MissionFile, armature: &[f64]) -> Result<(), Error> {
    let refuse = |reason: String| Err(Error::argument("--armature", reason));
    let links = &mut file.servicer.links;
    if armature.len() != 1 && armature.len() != links.len() {
        let (joints, given) = (links.len(), armature.len());
        return refuse(format!("one number, or one for each of {joints} joints, not {given}"));
    }
    if let Some(wrong) = armature.iter().find(|inertia| !(**inertia >= 0.0)) {
        return refuse(format!("{wrong} must not be negative"));
    }
    for (link, inertia) in links.iter_mut().zip(armature.iter().cycle()) {
        link.armature_kg_m2 = *inertia;
    }
    Ok(())
}

fn link(joint: &Joint) -> Link {
    Link {
        tip_m: joint.tip,
        center_of_mass_m: joint.body.center_of_mass,
        mass_kg: joint.body.mass,
        inertia_kg_m2: joint.body.inertia,
        axis: joint.axis,
        armature_kg_m2: joint.armature,
        radius_m: joint.capsule.radius,
        capsule_start_m: joint.capsule.start,
        capsule_end_m: joint.capsule.end - joint.tip,
    }
}

fn straight(joint: &Joint) -> f64 {
    0f64.clamp(joint.limits.lower, joint.limits.upper)
}

fn stops(joint: &Joint) -> Stops {
    Stops::between(joint.limits.lower, joint.limits.upper)
}

fn limits(of: impl Iterator<Item = f64>) -> Limits {
    Limits::of(&of.collect::<Vec<f64>>())
}
