// A flight as the page has it: rows over time, by column.

import { endEffector, miss, posture } from "./kinematics.js";
import { bracket } from "./numbers.js";
import { add, mix, slerp, turned } from "./vectors.js";

export class Flight {
  /** Of the rows of a history, for the plan that was flown. */
  constructor(data, plan) {
    this.name = data.name;
    this.rows = data.rows;
    this.mission = plan.mission;
    this.times = data.rows.time_s;
    this.duration = this.times[this.times.length - 1];
  }

  /** What the end effector misses the port by at the last row [m]. */
  get miss() {
    return miss(this.mission, this.at(this.duration), this.targetAt(this.duration));
  }

  /** The rows about a time, and the share of the way between them. */
  #row(time) {
    return bracket((i) => this.times[i], this.times.length, time);
  }

  /** State of the servicer at a time [s], with the centre of mass that the mission gives it. */
  at(time) {
    const [low, high, share] = this.#row(time);
    const { bus_m: bus, bus_attitude, joint_angle } = this.rows;
    const attitude = slerp(bus_attitude[low], bus_attitude[high], share);
    const jointAngle = mix(joint_angle[low], joint_angle[high], share);
    const busAt = mix(bus[low], bus[high], share);
    const position = add(busAt, turned(attitude, posture(this.mission, jointAngle).center));
    return { position, attitude, jointAngle };
  }

  /** The target's attitude at a time [s]. */
  targetAt(time) {
    const [low, high, share] = this.#row(time);
    return slerp(this.rows.target_attitude[low], this.rows.target_attitude[high], share);
  }

  /** Places of the centre of mass and the end effector at every row. */
  paths() {
    const states = this.times.map((time) => this.at(time));
    return [states.map((state) => state.position), states.map((state) => endEffector(this.mission, state))];
  }
}
