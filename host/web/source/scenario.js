// A scenario as a plan's file has it, and by the names of remora.h.

/** The scenario of a plan's file, its quaternions normalised as the program does. */
export function scenarioOf(file) {
  const given = file.joint_angle_rad;
  const joints = given?.length ?? 3;
  const zeros = (count) => Array(count).fill(0);
  return {
    nodes: file.nodes ?? 0,
    target_attitude_body_to_rtn: normalised(file.target_attitude_body_to_rtn),
    target_rate_body_rad_s: file.target_rate_body_rad_s,
    com_position_rtn_m: file.servicer_position_rtn_m,
    com_velocity_rtn_m_s: file.servicer_velocity_rtn_m_s,
    duration_s: file.duration_s ?? 0,
    has_bus_attitude: file.bus_attitude_body_to_rtn ? 1 : 0,
    has_joint_angle: given ? 1 : 0,
    bus_attitude_body_to_rtn: file.bus_attitude_body_to_rtn ? normalised(file.bus_attitude_body_to_rtn) : zeros(4),
    bus_rate_rtn_rad_s: file.bus_rate_rtn_rad_s ?? zeros(3),
    joint_angle_rad: given ?? zeros(joints),
    joint_rate_rad_s: file.joint_rate_rad_s ?? zeros(joints),
  };
}

/** A scenario of a scenario set as a plan's file has it. */
export function inPlan({ target, servicer, duration_s, nodes }) {
  return {
    target_attitude_body_to_rtn: target.attitude,
    target_rate_body_rad_s: target.rate,
    servicer_position_rtn_m: servicer.position,
    servicer_velocity_rtn_m_s: servicer.velocity,
    bus_attitude_body_to_rtn: servicer.bus_attitude_body_to_rtn,
    bus_rate_rtn_rad_s: servicer.bus_rate_rtn_rad_s,
    joint_angle_rad: servicer.joint_angle_rad,
    joint_rate_rad_s: servicer.joint_rate_rad_s,
    duration_s,
    nodes,
  };
}

/** Bit by bit what the program makes of a quaternion: each part over the norm. */
function normalised(q) {
  const norm = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return q.map((x) => x / norm);
}
