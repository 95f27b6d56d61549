// The mission of a plan's file as plain numbers, by the names of remora.h: what is drawn, what the page computes
// with, and what the planner is told.

import { radians } from "./numbers.js";

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
    capsule_start_from_joint_link_m: l.capsule_start_m ?? [0, 0, 0],
    capsule_end_from_tip_link_m: l.capsule_end_m ?? [0, 0, 0],
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

/** A section's members by their names in remora.h: with a prefix, switches as codes, angles in radians. */
function section(prefix, members) {
  const named = ([key, value]) => {
    const name = `${prefix}${key}`;
    if (typeof value === "string") {
      return [name, switchCode(value)];
    }
    return key.endsWith("_deg") ? [name.replace(/_deg$/, "_rad"), radians(value)] : [name, value];
  };
  return Object.fromEntries(Object.entries(members).map(named));
}

/** The approach, whose times have longer names in remora.h. */
function approach(members) {
  const named = ([key, value]) => [key.replace(/_s$/, "_time_s"), value];
  return section("", Object.fromEntries(Object.entries(members).map(named)));
}

/** The mission that stands in a plan, where every number is given. */
export function missionOf(file) {
  const { orbit, target, weights, tolerances, margins, corridor, typical, roll } = file;
  return {
    gravity_gradient: switchCode(target.gravity_gradient),
    ...section("", orbit),
    target_half_extents_body_m: target.half_extents_m,
    target_inertia_body_kg_m2: target.inertia_kg_m2,
    target_mass_kg: target.mass_kg,
    port_position_target_m: target.port_position_m,
    port_normal_target: target.port_normal,
    ...servicer(file.servicer),
    ...file.horizon,
    ...approach(file.approach),
    ...section("weight_", weights),
    ...section("tolerance_", tolerances),
    ...section("margin_", margins),
    ...section("corridor_", corridor),
    has_typical: typical ? 1 : 0,
    ...section("typical_", typical ?? {}),
    has_roll: roll ? 1 : 0,
    roll_ee_link: roll?.end_effector ?? [0, 0, 0],
    roll_port_target: roll?.port ?? [0, 0, 0],
  };
}

/** Mean motion of the target's orbit [rad/s]. */
export const meanMotion = (mission) => Math.sqrt(mission.gravitational_parameter_m3_s2 / mission.semi_major_axis_m ** 3);
