// Names of what the verifier measures.

/** Residuals in the order of files: name in a plan's file, name in remora.h, unit. */
export const RESIDUALS = [
  ["dynamics1", "dynamics1", "1 m, 1e-2 m/s"],
  ["keep_out", "keep_out_m", "m"],
  ["dynamics2", "dynamics2", "1, 1 rad, 1e-2 rad/s"],
  ["control", "control", "of the limit"],
  ["joint", "joint_rad", "rad"],
  ["joint_rate", "joint_rate", "of the limit"],
  ["pointing", "pointing", "cosine"],
  ["preset", "preset", "1 rad, 1e-2 rad/s"],
  ["terminal_rate", "terminal_rate", "1e-2 rad/s"],
  ["ee_position", "ee_position_m", "m"],
  ["ee_angle", "ee_angle_rad", "rad"],
  ["clearance", "clearance_m", "m"],
];
