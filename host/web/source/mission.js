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
    tip: l.tip_m,
    center_of_mass: l.center_of_mass_m,
    mass: l.mass_kg,
    inertia: tensor(l.inertia_kg_m2),
    axis: l.axis,
    armature: l.armature_kg_m2 ?? 0,
    radius: l.radius_m,
  };
}

function servicer(s) {
  const joints = s.links.length;
  const stops = s.joint_angle_limit_rad.map((stop) => (Array.isArray(stop) ? stop : [-stop, stop]));
  return {
    bus_mass: s.bus_mass_kg,
    bus_inertia: tensor(s.bus_inertia_kg_m2),
    bus_half_extents: s.bus_half_extents_m,
    boresight: s.boresight,
    arm_base: s.arm_base_m,
    links: s.links.map(link),
    min_joint_angle: stops.map(([lower]) => lower),
    max_joint_angle: stops.map(([, upper]) => upper),
    max_joint_rate: each(s.joint_rate_limit_rad_s, joints),
    initial_joint_angle: s.initial_joint_angle_rad,
    capture_joint_angle: s.capture_joint_angle_rad,
    max_force: each(s.force_limit_n, 3),
    max_bus_torque: each(s.bus_torque_limit_n_m, 3),
    max_joint_torque: each(s.joint_torque_limit_n_m, joints),
  };
}

function approach(a, horizon) {
  return {
    duration: horizon.duration_s,
    nodes: horizon.nodes,
    clearance: switchCode(a.clearance),
    between_nodes: switchCode(a.between_nodes),
    keep_out_far: a.keep_out_far_m,
    keep_out_near: a.keep_out_near_m,
    keep_out_near_time: a.keep_out_near_s,
    field_of_view_half_angle: radians(a.field_of_view_half_angle_deg),
    preset_time: a.preset_s,
    recovery_time: a.recovery_s,
  };
}

function tolerances(t) {
  return [
    t.dynamics,
    t.control,
    t.joint_rad,
    t.joint_rate,
    t.pointing,
    t.preset,
    t.terminal_rate,
    t.keep_out_m,
    t.ee_position_m,
    t.ee_angle_rad,
    t.clearance_m,
  ];
}

function typical(t) {
  return [
    t.length_m,
    t.velocity_m_s,
    t.force_n,
    t.angle_rad,
    t.rate_rad_s,
    t.joint_rate_rad_s,
    t.bus_torque_n_m,
    t.joint_torque_n_m,
  ];
}

/** The mission that stands in a plan, where every number is given. */
export function missionOf(file) {
  const { orbit, target, weights, margins, corridor, roll } = file;
  return {
    gravity_gradient: switchCode(target.gravity_gradient),
    gravitational_parameter: orbit.gravitational_parameter_m3_s2,
    semi_major_axis: orbit.semi_major_axis_m,
    eccentricity: orbit.eccentricity,
    inclination: radians(orbit.inclination_deg),
    target_half_extents: target.half_extents_m,
    target_inertia: target.inertia_kg_m2,
    target_mass: target.mass_kg,
    port_position: target.port_position_m,
    port_normal: target.port_normal,
    ...servicer(file.servicer),
    ...approach(file.approach, file.horizon),
    weights: [weights.force, weights.force_change, weights.bus_torque, weights.joint_torque],
    tolerances: tolerances(file.tolerances),
    margins: [
      margins.joint_angle_rad,
      margins.joint_rate,
      margins.keep_out_m,
      radians(margins.field_of_view_deg),
      margins.clearance_m,
    ],
    corridor: [radians(corridor.half_angle_deg), corridor.mouth_radius_m, corridor.end_effector_length_m],
    has_typical: file.typical ? 1 : 0,
    typical: file.typical ? typical(file.typical) : Array(8).fill(0),
    has_roll: roll ? 1 : 0,
    roll_end_effector: roll?.end_effector ?? [0, 0, 0],
    roll_port: roll?.port ?? [0, 0, 0],
  };
}

/** Mean motion of the target's orbit [rad/s]. */
export const meanMotion = (mission) => Math.sqrt(mission.gravitational_parameter / mission.semi_major_axis ** 3);
