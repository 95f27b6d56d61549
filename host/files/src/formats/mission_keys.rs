//! Keys of mission files by the names of the core's fields.

use remora_core::advanced::model::Mission;

/// The core's fields whose key in the file is another.
const KEYS: [(&str, &str); 55] = [
    ("servicer.bus_half_extents", "servicer.bus_half_extents_m"),
    ("servicer.links.radius", "servicer.links.radius_m"),
    ("tolerances.clearance", "tolerances.clearance_m"),
    ("margins.joint_angle", "margins.joint_angle_rad"),
    ("margins.keep_out", "margins.keep_out_m"),
    ("margins.field_of_view", "margins.field_of_view_deg"),
    ("margins.clearance", "margins.clearance_m"),
    ("corridor.half_angle", "corridor.half_angle_deg"),
    ("corridor.mouth_radius", "corridor.mouth_radius_m"),
    ("corridor.end_effector_length", "corridor.end_effector_length_m"),
    ("scenarios.standoff", "scenarios.standoff_m"),
    ("scenarios.offset", "scenarios.offset_m"),
    ("scenarios.rate", "scenarios.rate_rad_s"),
    ("scenarios.rate_norm", "scenarios.rate_norm_deg_s"),
    ("scenarios.velocity", "scenarios.velocity_m_s"),
    ("typical.length", "typical.length_m"),
    ("typical.velocity", "typical.velocity_m_s"),
    ("typical.force", "typical.force_n"),
    ("typical.angle", "typical.angle_rad"),
    ("typical.rate", "typical.rate_rad_s"),
    ("typical.joint_rate", "typical.joint_rate_rad_s"),
    ("typical.bus_torque", "typical.bus_torque_n_m"),
    ("typical.joint_torque", "typical.joint_torque_n_m"),
    ("orbit.gravitational_parameter", "orbit.gravitational_parameter_m3_s2"),
    ("orbit.semi_major_axis", "orbit.semi_major_axis_m"),
    ("orbit.body_radius", "orbit.body_radius_m"),
    ("orbit.inclination", "orbit.inclination_deg"),
    ("target.half_extents", "target.half_extents_m"),
    ("target.inertia", "target.inertia_kg_m2"),
    ("target.mass", "target.mass_kg"),
    ("target.port_position", "target.port_position_m"),
    ("servicer.bus_mass", "servicer.bus_mass_kg"),
    ("servicer.bus_inertia", "servicer.bus_inertia_kg_m2"),
    ("servicer.arm_base", "servicer.arm_base_m"),
    ("servicer.links.tip", "servicer.links.tip_m"),
    ("servicer.links.center_of_mass", "servicer.links.center_of_mass_m"),
    ("servicer.links.mass", "servicer.links.mass_kg"),
    ("servicer.links.inertia", "servicer.links.inertia_kg_m2"),
    ("servicer.links.armature", "servicer.links.armature_kg_m2"),
    ("servicer.max_joint_angle", "servicer.joint_angle_limit_rad"),
    ("servicer.initial_joint_angle", "servicer.initial_joint_angle_rad"),
    ("servicer.capture_joint_angle", "servicer.capture_joint_angle_rad"),
    ("servicer.max_joint_rate", "servicer.joint_rate_limit_rad_s"),
    ("servicer.max_force", "servicer.force_limit_n"),
    ("servicer.max_bus_torque", "servicer.bus_torque_limit_n_m"),
    ("servicer.max_joint_torque", "servicer.joint_torque_limit_n_m"),
    ("approach.duration", "horizon.duration_s"),
    ("approach.keep_out_far", "approach.keep_out_far_m"),
    ("approach.keep_out_near", "approach.keep_out_near_m"),
    ("approach.field_of_view_half_angle", "approach.field_of_view_half_angle_deg"),
    ("approach.keep_out_near_time", "approach.keep_out_near_s"),
    ("approach.preset_time", "approach.preset_s"),
    ("approach.recovery_time", "approach.recovery_s"),
    ("tolerances.end_effector_position", "tolerances.ee_position_m"),
    ("tolerances.end_effector_angle", "tolerances.ee_angle_rad"),
];

/// The first joint, from 0, whose angle is beyond its stops, where that is what is wrong.
fn joint_of<const NL: usize>(field: &str, mission: &Mission<NL>) -> Option<usize> {
    let s = &mission.servicer;
    let angle = match field {
        "servicer.initial_joint_angle" => &s.initial_joint_angle,
        "servicer.capture_joint_angle" => &s.capture_joint_angle,
        _ => return None,
    };
    let within = |i: usize| (s.min_joint_angle[i]..=s.max_joint_angle[i]).contains(&angle[i]);
    (0..NL).find(|i| !within(*i))
}

/// The file's key for a field that the core found wrong in `mission`.
pub(super) fn key_of<const NL: usize>(field: &str, mission: &Mission<NL>) -> String {
    let key = match field {
        "tolerances.joint" => "tolerances.joint_rad",
        "tolerances.keep_out" => "tolerances.keep_out_m",
        _ => KEYS.iter().find(|(core, _)| *core == field).map_or(field, |(_, key)| key),
    };
    if let Some(i) = joint_of(field, mission) {
        return format!("{key}[{i}]");
    }
    let Some(in_link) = key.strip_prefix("servicer.links.") else { return key.to_string() };
    // The core does not say which link: the first that is wrong on its own.
    let wrong = (0..NL).find(|i| {
        let mut alone = Mission::default();
        alone.servicer.links[0] = mission.servicer.links[*i];
        alone.validate().is_err_and(|error| error.field == field)
    });
    wrong.map_or(key.to_string(), |i| format!("servicer.links[{i}].{in_link}"))
}
