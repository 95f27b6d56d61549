//! A mission as C has it.
#![allow(unsafe_code, reason = "says what a structure begins with")]

mod convert;

use crate::abi::REMORA_JOINTS;
use crate::codes::RemoraSwitchCode;
use crate::pointers::Sized32;
pub(crate) use convert::flag;

/// One link of the arm, in axes that are parallel to the bus's while all joints are at zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraLink {
    /// Vector from its joint to the next one, or for the last link to the end effector [m].
    pub tip_from_joint_link_m: [f64; 3],
    /// Centre of mass from its joint [m].
    pub com_from_joint_link_m: [f64; 3],
    /// Mass [kg]; 0 where the inertia is zero and the armature is not.
    pub mass_kg: f64,
    /// Inertia about the centre of mass [kg m^2]; symmetric.
    pub inertia_about_com_link_kg_m2: [[f64; 3]; 3],
    /// Unit joint axis.
    pub axis_link: [f64; 3],
    /// Inertia of the joint's rotor, times the gear ratio squared [kg m^2].
    pub armature_kg_m2: f64,
    /// Radius of the capsule that holds the link [m]; it runs from joint to tip but for the next two.
    pub radius_m: f64,
    /// The capsule's near end from the joint [m].
    pub capsule_start_from_joint_link_m: [f64; 3],
    /// The capsule's far end from the tip [m].
    pub capsule_end_from_tip_link_m: [f64; 3],
}

/// Everything that is the same for every approach: orbit, target, servicer, limits, tolerances.
/// docs/concepts/problem.md explains each number; remora_defaults fills in the mission of that page. Masses, inertias,
/// extents, limits, weights and tolerances are above zero; margins and keep-out distances at least zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RemoraMission {
    /// Size of this structure in bytes.
    pub size: u32,
    /// Whether the gravity gradient turns the target.
    pub gravity_gradient: RemoraSwitchCode,
    /// Half edge lengths of the box about the target's centre of mass, target axes [m].
    pub target_half_extents_body_m: [f64; 3],
    /// Principal moments of inertia of the target, about its axes [kg m^2].
    pub target_inertia_body_kg_m2: [f64; 3],
    /// Mass of the target [kg].
    pub target_mass_kg: f64,
    /// Docking port from the target's centre of mass, target axes [m].
    pub port_position_target_m: [f64; 3],
    /// Outward unit normal of the port, target axes.
    pub port_normal_target: [f64; 3],

    /// The body's gravitational parameter [m^3/s^2].
    pub gravitational_parameter_m3_s2: f64,
    /// Semi-major axis of the target's orbit [m].
    pub semi_major_axis_m: f64,
    /// Eccentricity of the orbit.
    pub eccentricity: f64,
    /// Inclination of the orbit [rad].
    pub inclination_rad: f64,

    /// Mass of the bus [kg].
    pub bus_mass_kg: f64,
    /// Inertia of the bus about its centre of mass, bus axes [kg m^2]; symmetric.
    pub bus_inertia_body_kg_m2: [[f64; 3]; 3],
    /// Half edge lengths of the box about the bus's centre of mass, bus axes [m].
    pub bus_half_extents_body_m: [f64; 3],
    /// Unit boresight of the camera, bus axes.
    pub boresight_bus: [f64; 3],
    /// First joint from the bus's centre of mass, bus axes [m].
    pub arm_base_bus_m: [f64; 3],
    /// The arm, from the bus outwards.
    pub links: [RemoraLink; REMORA_JOINTS],
    /// Lower stops [rad].
    pub min_joint_angle_rad: [f64; REMORA_JOINTS],
    /// Upper stops [rad].
    pub max_joint_angle_rad: [f64; REMORA_JOINTS],
    /// Limits of the joint rates [rad/s].
    pub max_joint_rate_rad_s: [f64; REMORA_JOINTS],
    /// Joint angles at the start, unless a scenario gives others [rad].
    pub initial_joint_angle_rad: [f64; REMORA_JOINTS],
    /// Joint angles at capture [rad].
    pub capture_joint_angle_rad: [f64; REMORA_JOINTS],
    /// Largest force along each axis, RTN [N].
    pub max_bus_force_rtn_n: [f64; 3],
    /// Largest bus torque about each axis, bus axes [N m].
    pub max_bus_torque_body_n_m: [f64; 3],
    /// Largest joint torques [N m].
    pub max_joint_torque_n_m: [f64; REMORA_JOINTS],

    /// Typical length, by which steps are divided [m].
    pub typical_length_m: f64,
    /// Typical velocity [m/s].
    pub typical_velocity_m_s: f64,
    /// Typical force [N].
    pub typical_force_n: f64,
    /// Typical angle [rad].
    pub typical_angle_rad: f64,
    /// Typical angular rate [rad/s].
    pub typical_rate_rad_s: f64,
    /// Typical joint rate [rad/s].
    pub typical_joint_rate_rad_s: f64,
    /// Typical bus torque [N m].
    pub typical_bus_torque_n_m: f64,
    /// Typical joint torque [N m].
    pub typical_joint_torque_n_m: f64,
    /// Whether the members `typical_...` are given; otherwise they are not read, and follow from the rest.
    pub has_typical: u32,
    /// Nodes of a plan, 4 to REMORA_NODES.
    pub nodes: u32,
    /// Whether bodies must stay clear of each other.
    pub clearance: RemoraSwitchCode,
    /// Whether limits hold between nodes too.
    pub between_nodes: RemoraSwitchCode,
    /// Time from the first node to the last [s].
    pub duration_s: f64,
    /// Keep-out distance of the system's centre of mass from the target's box before the switch [m].
    pub keep_out_far_m: f64,
    /// Keep-out distance after the switch [m].
    pub keep_out_near_m: f64,
    /// Time before the end from which the near distance holds [s].
    pub keep_out_near_time_s: f64,
    /// Half angle of the camera's cone [rad].
    pub field_of_view_half_angle_rad: f64,
    /// Time before the end from which the arm has its capture angles [s].
    pub preset_time_s: f64,
    /// Time within which a start beyond a limit is led back [s].
    pub recovery_time_s: f64,

    /// Weight of the force in the cost.
    pub weight_force: f64,
    /// Weight of the force's change from interval to interval.
    pub weight_force_change: f64,
    /// Weight of the bus torque.
    pub weight_bus_torque: f64,
    /// Weight of the joint torques.
    pub weight_joint_torque: f64,
    /// Weight of the joint rates, over typical ones.
    pub weight_joint_motion: f64,
    /// Tolerance of the dynamics of both stages, over the units of RemoraVerification.
    pub tolerance_dynamics: f64,
    /// Tolerance of controls, over their limits.
    pub tolerance_control: f64,
    /// Tolerance of joint stops [rad].
    pub tolerance_joint_rad: f64,
    /// Tolerance of joint rates, over their limits.
    pub tolerance_joint_rate: f64,
    /// Tolerance of the field of view, in cosine.
    pub tolerance_pointing: f64,
    /// Tolerance of the arm's capture angles, over 1 rad and 1e-2 rad/s.
    pub tolerance_preset: f64,
    /// Tolerance of the bus's rate at capture, over 1e-2 rad/s.
    pub tolerance_terminal_rate: f64,
    /// Tolerance of the keep-out distance [m].
    pub tolerance_keep_out_m: f64,
    /// Tolerance of the end effector's position at capture [m].
    pub tolerance_ee_position_m: f64,
    /// Tolerance of the end effector's direction at capture [rad].
    pub tolerance_ee_angle_rad: f64,
    /// Tolerance of the clearance of bodies [m].
    pub tolerance_clearance_m: f64,
    /// Margin to the joint stops [rad].
    pub margin_joint_angle_rad: f64,
    /// Margin to the joint rate limits, over these limits.
    pub margin_joint_rate: f64,
    /// Margin to the keep-out distance [m].
    pub margin_keep_out_m: f64,
    /// Margin to the field of view [rad].
    pub margin_field_of_view_rad: f64,
    /// Margin of the clearance [m].
    pub margin_clearance_m: f64,
    /// Half angle of the end effector's corridor [rad].
    pub corridor_half_angle_rad: f64,
    /// Radius of the corridor at the port [m].
    pub corridor_mouth_radius_m: f64,
    /// Length of the end effector, which only the corridor concerns [m].
    pub corridor_end_effector_length_m: f64,
    /// Unit vector in the last link's axes; at capture it is parallel to `roll_port_target`.
    pub roll_ee_link: [f64; 3],
    /// Unit vector in the target's axes.
    pub roll_port_target: [f64; 3],
    /// Whether the roll at capture is given by the two directions above; otherwise they are not read.
    pub has_roll: u32,
    /// Not read.
    pub reserved: u32,
}

// SAFETY: begins with its size, and holds numbers only.
unsafe impl Sized32 for RemoraMission {}
