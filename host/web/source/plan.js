// A plan as the page has it: what its file says, the motion between its nodes, and what the page computes itself.

import { checksumOf } from "./checksum.js";
import { distanceToBox, endEffector, miss, offBoresight, port, posture } from "./kinematics.js";
import { meanMotion, missionOf } from "./mission.js";
import { bracket } from "./numbers.js";
import { scenarioOf } from "./scenario.js";
import { tumble } from "./tumble.js";
import { norm, slerp, sub } from "./vectors.js";

/** Instants of the target's motion between two nodes: it turns by little between them. */
const FINER = 4;

export class Plan {
  /** Of a plan's file, `input` the checksum of mission and scenario that the program found. */
  constructor(file, input = null) {
    this.file = file;
    this.input = input;
    this.mission = missionOf(file.inputs.mission);
    this.scenario = scenarioOf(file.inputs.scenario);
    this.nodes = file.stage1.position_rtn_m.length;
    this.duration = this.scenario.duration_s || this.mission.duration_s;
    this.step = this.duration / (this.nodes - 1);
    this.joints = this.mission.links.length;
    this.times = this.instants(1);
    const hasGradient = file.inputs.in_force.gravity_gradient;
    this.targetStep = this.step / FINER;
    const count = FINER * (this.nodes - 1) + 1;
    this.target = tumble(this.mission, meanMotion(this.mission), hasGradient, this.scenario, this.targetStep, count);
  }

  /** Times from the first node to the last, so many to an interval [s]. */
  instants(perInterval) {
    const step = this.step / perInterval;
    return Array.from({ length: perInterval * (this.nodes - 1) + 1 }, (_, i) => i * step);
  }

  get name() {
    return this.file.scenario;
  }

  /** Checksum of the rows. */
  get checksum() {
    return (this.checksumFound ??= checksumOf(this.file));
  }

  /** What the end effector misses the port by at the end, by the page's own kinematics [m]. */
  get miss() {
    return miss(this.mission, this.node(this.nodes - 1), this.target[this.target.length - 1]);
  }

  /** The state at a node. */
  node(k) {
    const { stage1, stage2 } = this.file;
    return {
      position: stage1.position_rtn_m[k],
      velocity: stage1.velocity_rtn_m_s[k],
      attitude: stage2.attitude_body_to_rtn[k],
      jointAngle: stage2.joint_angle_rad[k],
      jointRate: stage2.joint_rate_rad_s[k],
    };
  }

  /** State of the servicer at a time [s]: cubics through positions and velocities, the shortest turn between
   * attitudes. */
  at(time) {
    const [low, high, share] = bracket((i) => this.times[i], this.nodes, time);
    const [from, to] = [this.node(low), this.node(high)];
    return {
      position: cubic(from.position, from.velocity, to.position, to.velocity, this.step, share),
      attitude: slerp(from.attitude, to.attitude, share),
      jointAngle: cubic(from.jointAngle, from.jointRate, to.jointAngle, to.jointRate, this.step, share),
    };
  }

  /** The target's attitude at a time [s]. */
  targetAt(time) {
    const [low, high, share] = bracket((i) => i * this.targetStep, this.target.length, time);
    return slerp(this.target[low], this.target[high], share);
  }

  /** The keep-out distance in force at a time [s], in metres. */
  keepOut(time) {
    const isFar = time <= this.duration - this.mission.keep_out_near_time_s;
    return isFar ? this.mission.keep_out_far_m : this.mission.keep_out_near_m;
  }

  /** Least way of the centre of mass to the far keep-out distance while that is in force, with its time. */
  keepOutMargin(motion, times) {
    const { keep_out_far_m: far } = this.mission;
    const margins = times
      .filter((time) => this.keepOut(time) === far)
      .map((time) => ({
        distance_m: distanceToBox(this.mission, motion.at(time).position, motion.targetAt(time)) - far,
        time_s: time,
      }));
    return margins.reduce((least, margin) => (margin.distance_m < least.distance_m ? margin : least));
  }

  /** Change of velocity over the whole plan [m/s]. */
  get deltaV() {
    const { mass } = posture(this.mission, this.mission.capture_joint_angle_rad);
    return this.file.stage1.force_rtn_n.reduce((sum, force) => sum + (norm(force) / mass) * this.step, 0);
  }
}

/** Distances and angles of one instant. */
export function readingsOf(mission, state, targetAttitude) {
  const tip = endEffector(mission, state);
  return {
    centre: distanceToBox(mission, state.position, targetAttitude),
    tip: norm(sub(tip, port(mission, targetAttitude))),
    sight: offBoresight(mission, state, targetAttitude),
  };
}

/** Between two points with their slopes. */
function cubic(a, da, b, db, step, s) {
  const [h00, h10] = [(1 + 2 * s) * (1 - s) ** 2, s * (1 - s) ** 2];
  const [h01, h11] = [s * s * (3 - 2 * s), s * s * (s - 1)];
  return a.map((x, i) => h00 * x + h10 * step * da[i] + h01 * b[i] + h11 * step * db[i]);
}

/** A plan's file of what the planner answered for another scenario of the same mission. */
export function replanned({ file }, name, scenario, { mode, integrator }, { start, seconds, ...found }) {
  const inputs = { ...file.inputs, scenario, scenario_checksum: null };
  return { ...file, ...found, scenario: name, mode, integrator, warm_start: start, inputs, time_s: seconds };
}
