// What is shown over time: each a title, lines of points [s, value], and limits.

import { offBoresight } from "./kinematics.js";
import { degrees } from "./numbers.js";

const TONES = ["a", "b", "c", "d", "e", "f", "g"];
const AXES = ["x", "y", "z"];
const RTN = ["R", "T", "N"];

/** Limits of either sign, one pair for each line. */
const both = (limits, scale = 1) => limits.map((limit) => [-scale * limit, scale * limit]);

/** A control of a plan, held from node to node. */
function held(plan, rows, names, scale = 1) {
  return names.map((name, i) => ({
    name,
    tone: TONES[i],
    points: rows.flatMap((row, k) => [
      [k * plan.step, scale * row[i]],
      [(k + 1) * plan.step, scale * row[i]],
    ]),
  }));
}

/** A state of a plan at its nodes. */
function states(plan, rows, names, scale = 1) {
  return names.map((name, i) => ({
    name,
    tone: TONES[i],
    points: rows.map((row, k) => [k * plan.step, scale * row[i]]),
  }));
}

/** A column of a flight. */
function flown(flight, rows, names, scale = 1) {
  return names.map((name, i) => ({
    name,
    tone: TONES[i],
    points: rows.map((row, k) => [flight.times[k], scale * row[i]]),
  }));
}

/** All that has limits, planned and, where there is a flight, flown. */
export function seriesOf(plan, flight) {
  const {
    mission,
    file: { stage1, stage2 },
  } = plan;
  const joints = mission.links.map((_, i) => String(i + 1));
  const stops = mission.min_joint_angle_rad.map((lower, i) => [lower, mission.max_joint_angle_rad[i]].map(degrees));
  const strip = (title, unit, limits, planned, [column, scale]) => ({
    title,
    unit,
    limits,
    planned,
    flown:
      flight &&
      flown(
        flight,
        flight.rows[column],
        planned.map((line) => line.name),
        scale,
      ),
  });
  return [
    strip("Force", "N, RTN", both(mission.max_bus_force_rtn_n), held(plan, stage1.force_rtn_n, RTN), ["force_n", 1]),
    strip(
      "Bus torque",
      "mN m",
      both(mission.max_bus_torque_body_n_m, 1e3),
      held(plan, stage2.bus_torque_body_n_m, AXES, 1e3),
      ["bus_torque_n_m", 1e3],
    ),
    strip(
      "Joint torques",
      "mN m",
      both(mission.max_joint_torque_n_m, 1e3),
      held(plan, stage2.joint_torque_n_m, joints, 1e3),
      ["joint_torque", 1e3],
    ),
    strip("Joint angles", "deg", stops, states(plan, stage2.joint_angle_rad, joints, degrees(1)), [
      "joint_angle",
      degrees(1),
    ]),
    strip(
      "Joint rates",
      "mrad/s",
      both(mission.max_joint_rate_rad_s, 1e3),
      states(plan, stage2.joint_rate_rad_s, joints, 1e3),
      ["joint_rate", 1e3],
    ),
    sight(plan, flight),
  ];
}

/** By how much the port is off the boresight. */
function sight(plan, flight) {
  const { mission } = plan;
  const line = (motion, times) => [
    {
      name: "port",
      tone: "f",
      points: times.map((time) => [time, degrees(offBoresight(mission, motion.at(time), motion.targetAt(time)))]),
    },
  ];
  const count = 2 * plan.nodes - 1;
  const times = Array.from({ length: count }, (_, i) => (i * plan.duration) / (count - 1));
  return {
    title: "Off the boresight",
    unit: "deg",
    limits: [[0, degrees(mission.field_of_view_half_angle_rad)]],
    planned: line(plan, times),
    flown: flight && line(flight, flight.times),
  };
}
