// Time: the slider, playing, and the moments that matter.

import { byId, make } from "./elements.js";

const SPEEDS = [1, 5, 20, 60, 120, 300];
const USUAL = 60;

export class Clock {
  constructor(changed) {
    this.changed = changed;
    this.time = 0;
    this.duration = 1;
    this.speed = USUAL;
    this.slider = byId("slider");
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    byId("play").addEventListener("click", () => this.toggle());
    const speeds = byId("speed");
    speeds.append(...SPEEDS.map((speed) => make("option", { value: speed }, `${speed}×`)));
    speeds.value = USUAL;
    speeds.addEventListener("change", () => (this.speed = Number(speeds.value)));
  }

  /** Takes the times of a plan. */
  show(plan, duration) {
    this.duration = duration;
    this.slider.max = duration;
    const near = plan.duration - plan.mission.keep_out_near_time_s;
    const set = Math.floor((plan.duration - plan.mission.preset_time_s) / plan.step + 1e-9) * plan.step;
    const marks = [
      [near, "near keep-out"],
      [set, "arm set"],
      [plan.duration, ""],
    ];
    const span = ([time, name]) => make("span", { style: `left:${(100 * time) / duration}%` }, name);
    byId("marks").replaceChildren(...marks.filter(([time]) => time > 0).map(span));
    this.seek(Math.min(this.time, duration));
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.slider.value = this.time;
    const left = this.duration - this.time;
    byId("clock").replaceChildren(`${this.time.toFixed(1)} s`, make("small", {}, `${left.toFixed(1)} s to go`));
    this.changed(this.time);
  }

  faster(steps) {
    const at = SPEEDS.indexOf(this.speed) + steps;
    this.speed = SPEEDS[Math.min(Math.max(at, 0), SPEEDS.length - 1)];
    byId("speed").value = this.speed;
  }

  get isPlaying() {
    return this.last !== undefined;
  }

  toggle() {
    this.isPlaying ? this.pause() : this.play();
  }

  play() {
    if (this.time >= this.duration) {
      this.seek(0);
    }
    this.last = performance.now();
    this.#show();
    const frame = (now) => {
      if (!this.isPlaying) {
        return;
      }
      const passed = (now - this.last) / 1000;
      this.last = now;
      this.seek(this.time + Math.max(passed, 0) * this.speed);
      this.time >= this.duration ? this.pause() : requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    this.last = undefined;
    this.#show();
  }

  #show() {
    byId("play").textContent = this.isPlaying ? "❚❚" : "▶";
  }
}
