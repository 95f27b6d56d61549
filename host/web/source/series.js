// Quantities over time with their limits: lines of points [s, value], and how much of the limits they use.

import { offBoresight } from "./kinematics.js";
import { degrees } from "./numbers.js";

const TONES = "abcdefg";
const [AXES, RTN] = ["xyz", "RTN"].map((names) => [...names]);

/** Limits of either sign, a pair for each line. */
const both = (limits) => limits.map((limit) => [-limit, limit]);

/** Lines of rows at their times. Rows that lack the last time are held until the next one. */
function linesOf(names, times, rows, scale, tones = TONES) {
  const isHeld = rows.length < times.length;
  const point = (i) => (row, k) => {
    const value = scale * row[i];
    return times.slice(k, isHeld ? k + 2 : k + 1).map((time) => [time, value]);
  };
  return names.map((name, i) => ({ name, tone: tones[i], points: rows.flatMap(point(i)) }));
}

/** Share of its limits that a value uses: of the half range about their middle. */
const shareOf = ([low, high], value) =>
  low === null ? value / high : Math.abs(2 * value - low - high) / (high - low);

/** The largest use of limits, with its line and time. */
function peakOf(lines, limits) {
  const uses = lines.flatMap(({ name, points }, i) =>
    points.map(([time, value]) => ({ share: shareOf(limits[i], value), name, time })),
  );
  return uses.reduce((most, use) => (use.share > most.share ? use : most));
}

/** All that has limits, planned and, where there is a flight, flown. */
export function seriesOf(plan, flight) {
  const {
    mission,
    times,
    file: { stage1, stage2 },
  } = plan;
  const joints = mission.links.map((_, i) => String(i + 1));
  const stops = mission.min_joint_angle_rad.map((lower, i) => [lower, mission.max_joint_angle_rad[i]]);
  const [torque, joint, rate] = [
    mission.max_bus_torque_body_n_m,
    mission.max_joint_torque_n_m,
    mission.max_joint_rate_rad_s,
  ].map(both);
  // Title, unit and scale, lines, limits, the plan's rows, a flight's column.
  const quantities = [
    ["Force", "N", 1, RTN, both(mission.max_bus_force_rtn_n), stage1.force_rtn_n, "force_n"],
    ["Bus torque", "mN m", 1e3, AXES, torque, stage2.bus_torque_body_n_m, "bus_torque_n_m"],
    ["Joint torque", "mN m", 1e3, joints, joint, stage2.joint_torque_n_m, "joint_torque"],
    ["Joint angle", "deg", degrees(1), joints, stops, stage2.joint_angle_rad, "joint_angle"],
    ["Joint rate", "mrad/s", 1e3, joints, rate, stage2.joint_rate_rad_s, "joint_rate"],
  ];
  const series = quantities.map(([title, unit, scale, names, limits, rows, column]) => ({
    title,
    unit,
    limits: limits.map((pair) => pair.map((limit) => scale * limit)),
    planned: linesOf(names, times, rows, scale),
    flown: flight && linesOf(names, flight.times, flight.rows[column], scale),
  }));
  return [...series, sight(plan, flight)].map((one) => ({
    ...one,
    peak: peakOf(one.flown ?? one.planned, one.limits),
  }));
}

/** By how much the port is off the boresight. */
function sight(plan, flight) {
  const { mission } = plan;
  const off = (motion) => (time) => [degrees(offBoresight(mission, motion.at(time), motion.targetAt(time)))];
  const line = (motion, times) => linesOf(["port"], times, times.map(off(motion)), 1, "f");
  return {
    title: "Off the boresight",
    unit: "deg",
    limits: [[null, degrees(mission.field_of_view_half_angle_rad)]],
    planned: line(plan, plan.instants(2)),
    flown: flight && line(flight, flight.times),
  };
}
