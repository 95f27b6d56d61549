// A plan as the page has it: what its file says, the motion between its nodes, and what the page computes itself.

import { checksumOf } from "./checksum.js";
import { distanceToBox, endEffector, miss, offBoresight, port, posture } from "./kinematics.js";
import { meanMotion, missionOf } from "./mission.js";
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
    const hasGradient = file.inputs.in_force.gravity_gradient;
    this.targetStep = this.step / FINER;
    this.target = tumble(
      this.mission,
      meanMotion(this.mission),
      hasGradient,
      this.scenario,
      this.targetStep,
      FINER * (this.nodes - 1) + 1,
    );
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

  /** The interval that holds a time, and the share of it that has passed. */
  #interval(time, step, last) {
    const at = Math.min(Math.max(time / step, 0), last);
    const k = Math.min(Math.floor(at), last - 1);
    return [k, at - k];
  }

  /** State of the servicer at a time [s]: cubics through positions and velocities, the shortest turn between
   * attitudes. */
  at(time) {
    const [k, share] = this.#interval(time, this.step, this.nodes - 1);
    const [from, to] = [this.node(k), this.node(k + 1)];
    return {
      position: cubic(from.position, from.velocity, to.position, to.velocity, this.step, share),
      attitude: slerp(from.attitude, to.attitude, share),
      jointAngle: cubic(from.jointAngle, from.jointRate, to.jointAngle, to.jointRate, this.step, share),
    };
  }

  /** The target's attitude at a time [s]. */
  targetAt(time) {
    const [k, share] = this.#interval(time, this.targetStep, this.target.length - 1);
    return slerp(this.target[k], this.target[k + 1], share);
  }

  /** The keep-out distance in force at a time [s], in metres. */
  keepOut(time) {
    const isFar = time <= this.duration - this.mission.keep_out_near_time_s;
    return isFar ? this.mission.keep_out_far_m : this.mission.keep_out_near_m;
  }

  /** What is read off beside the picture at a time [s]. */
  readings(time) {
    return readingsOf(this.mission, this.at(time), this.targetAt(time));
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
export function replanned(plan, name, scenario, { mode, integrator }, result) {
  const { inputs } = plan.file;
  return {
    ...plan.file,
    scenario: name,
    status: result.status,
    verdict: result.verdict,
    mode,
    integrator,
    warm_start: result.start,
    inputs: { ...inputs, scenario, scenario_checksum: null },
    stage1: result.stage1,
    stage2: result.stage2,
    residuals: result.residuals,
    clearances: result.clearances,
    time_s: result.seconds,
  };
}
