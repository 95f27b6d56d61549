// The mission of a plan's file as plain numbers, by the names of remora.h: what is drawn, what the page computes
// with, and what the planner is told.

const radians = (degrees) => (degrees * Math.PI) / 180;

/** A limit that holds for each of so many joints or axes, or one for each. */
const each = (limit, count) => (Array.isArray(limit) ? limit : Array(count).fill(limit));

/** An inertia as rows: three principal moments, or xx, yy, zz, xy, xz, yz. */
function tensor([xx, yy, zz, xy = 0, xz = 0, yz = 0]) {
  return [
    [xx, xy, xz],
    [xy, yy, yz],
    [xz, yz, zz],
  ];
}

/** The code of a part that may be left to the integrator. */
const switchCode = (name) => ["auto", "on", "none"].indexOf(name);

function link(l) {
  return {
    tip_from_joint_link_m: l.tip_m,
    com_from_joint_link_m: l.center_of_mass_m,
    mass_kg: l.mass_kg,
    inertia_about_com_link_kg_m2: tensor(l.inertia_kg_m2),
    axis_link: l.axis,
    armature_kg_m2: l.armature_kg_m2 ?? 0,
    radius_m: l.radius_m,
  };
}

function servicer(s) {
  const joints = s.links.length;
  const stops = s.joint_angle_limit_rad.map((stop) => (Array.isArray(stop) ? stop : [-stop, stop]));
  return {
    bus_mass_kg: s.bus_mass_kg,
    bus_inertia_body_kg_m2: tensor(s.bus_inertia_kg_m2),
    bus_half_extents_body_m: s.bus_half_extents_m,
    boresight_bus: s.boresight,
    arm_base_bus_m: s.arm_base_m,
    links: s.links.map(link),
    min_joint_angle_rad: stops.map(([lower]) => lower),
    max_joint_angle_rad: stops.map(([, upper]) => upper),
    max_joint_rate_rad_s: each(s.joint_rate_limit_rad_s, joints),
    initial_joint_angle_rad: s.initial_joint_angle_rad,
    capture_joint_angle_rad: s.capture_joint_angle_rad,
    max_bus_force_rtn_n: each(s.force_limit_n, 3),
    max_bus_torque_body_n_m: each(s.bus_torque_limit_n_m, 3),
    max_joint_torque_n_m: each(s.joint_torque_limit_n_m, joints),
  };
}

function approach(a, horizon) {
  return {
    duration_s: horizon.duration_s,
    nodes: horizon.nodes,
    clearance: switchCode(a.clearance),
    between_nodes: switchCode(a.between_nodes),
    keep_out_far_m: a.keep_out_far_m,
    keep_out_near_m: a.keep_out_near_m,
    keep_out_near_time_s: a.keep_out_near_s,
    field_of_view_half_angle_rad: radians(a.field_of_view_half_angle_deg),
    preset_time_s: a.preset_s,
    recovery_time_s: a.recovery_s,
  };
}

function tolerances(t) {
  return {
    tolerance_dynamics: t.dynamics,
    tolerance_control: t.control,
    tolerance_joint_rad: t.joint_rad,
    tolerance_joint_rate: t.joint_rate,
    tolerance_pointing: t.pointing,
    tolerance_preset: t.preset,
    tolerance_terminal_rate: t.terminal_rate,
    tolerance_keep_out_m: t.keep_out_m,
    tolerance_ee_position_m: t.ee_position_m,
    tolerance_ee_angle_rad: t.ee_angle_rad,
    tolerance_clearance_m: t.clearance_m,
  };
}

function typical(t) {
  return {
    has_typical: t ? 1 : 0,
    typical_length_m: t?.length_m ?? 0,
    typical_velocity_m_s: t?.velocity_m_s ?? 0,
    typical_force_n: t?.force_n ?? 0,
    typical_angle_rad: t?.angle_rad ?? 0,
    typical_rate_rad_s: t?.rate_rad_s ?? 0,
    typical_joint_rate_rad_s: t?.joint_rate_rad_s ?? 0,
    typical_bus_torque_n_m: t?.bus_torque_n_m ?? 0,
    typical_joint_torque_n_m: t?.joint_torque_n_m ?? 0,
  };
}

/** The mission that stands in a plan, where every number is given. */
export function missionOf(file) {
  const { orbit, target, weights, margins, corridor, roll } = file;
  return {
    gravity_gradient: switchCode(target.gravity_gradient),
    gravitational_parameter_m3_s2: orbit.gravitational_parameter_m3_s2,
    semi_major_axis_m: orbit.semi_major_axis_m,
    eccentricity: orbit.eccentricity,
    inclination_rad: radians(orbit.inclination_deg),
    target_half_extents_body_m: target.half_extents_m,
    target_inertia_body_kg_m2: target.inertia_kg_m2,
    target_mass_kg: target.mass_kg,
    port_position_target_m: target.port_position_m,
    port_normal_target: target.port_normal,
    ...servicer(file.servicer),
    ...approach(file.approach, file.horizon),
    weight_force: weights.force,
    weight_force_change: weights.force_change,
    weight_bus_torque: weights.bus_torque,
    weight_joint_torque: weights.joint_torque,
    ...tolerances(file.tolerances),
    margin_joint_angle_rad: margins.joint_angle_rad,
    margin_joint_rate: margins.joint_rate,
    margin_keep_out_m: margins.keep_out_m,
    margin_field_of_view_rad: radians(margins.field_of_view_deg),
    margin_clearance_m: margins.clearance_m,
    corridor_half_angle_rad: radians(corridor.half_angle_deg),
    corridor_mouth_radius_m: corridor.mouth_radius_m,
    ee_length_m: corridor.end_effector_length_m,
    ...typical(file.typical),
    has_roll: roll ? 1 : 0,
    roll_ee_link: roll?.end_effector ?? [0, 0, 0],
    roll_port_target: roll?.port ?? [0, 0, 0],
  };
}

/** Mean motion of the target's orbit [rad/s]. */
export const meanMotion = (mission) => Math.sqrt(mission.gravitational_parameter_m3_s2 / mission.semi_major_axis_m ** 3);
