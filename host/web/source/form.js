// The form that asks for another plan: the target's tumble and where the servicer starts.

import { byId, make } from "./elements.js";
import { degrees, radians } from "./numbers.js";
import { exponential, product, unit } from "./vectors.js";

const AXES = ["x", "y", "z"];
const RTN = ["R", "T", "N"];

/** Largest rate [deg/s] and distance [m] that a slider reaches, where the plan's own are smaller. */
const LEAST_RATE = 0.15;
const LEAST_DISTANCE = 10;

export class Form {
  /** `plan` is called with a scenario as files have it; `draft` while it is being changed. */
  constructor({ plan, draft }) {
    this.element = byId("form");
    this.ask = plan;
    this.draft = draft;
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.submit();
    });
  }

  /** Takes the scenario of a plan; what is not touched keeps its bits. */
  show(plan, refusal) {
    this.scenario = plan.file.inputs.scenario;
    this.ranges = plan.file.inputs.mission.scenarios;
    this.normal = plan.mission.port_normal_target;
    if (refusal) {
      this.element.replaceChildren(make("p", { class: "note" }, refusal));
      return;
    }
    const { target_rate_body_rad_s: rate, servicer_position_rtn_m: position } = this.scenario;
    // Label, title, unit, names, values, and the least reach of the sliders.
    const groups = {
      rate: ["Rate", "Target's rate", "deg/s, its own axes", AXES, rate.map(degrees), LEAST_RATE],
      turn: ["Turned", "Target turned further", "deg, its own axes", AXES, [0, 0, 0], 180],
      start: ["Start", "Servicer's start", "m", RTN, position, LEAST_DISTANCE],
    };
    const parts = Object.entries(groups).flatMap(([key, [label, title, unit_, names, values, least]]) => {
      this[key] = fields(label, names, values, Math.max(least, 1.5 * Math.max(...values.map(Math.abs))));
      return [make("h3", {}, `${title} `, make("small", {}, unit_)), ...this[key].rows];
    });
    this.answer = make("p", { id: "answer", role: "status" });
    this.go = make("button", { class: "go" }, "Plan");
    const button = (text, onclick) => make("button", { type: "button", onclick }, text);
    const others = [button("Draw one", () => this.#random()), button("As it was", () => this.reset(plan))];
    this.element.replaceChildren(...parts, make("div", { class: "actions" }, this.go, others), this.answer);
    this.element.oninput = () => this.draft(this.asked());
  }

  /** Takes back what was changed. */
  reset(plan) {
    this.show(plan, null);
    this.draft(null);
  }

  /** The scenario that is asked for. */
  asked() {
    const s = this.scenario;
    const turn = this.turn.values();
    const attitude = product(s.target_attitude_body_to_rtn, exponential(turn.map(radians)));
    return {
      ...s,
      target_rate_body_rad_s: this.rate.isTouched() ? this.rate.values().map(radians) : s.target_rate_body_rad_s,
      target_attitude_body_to_rtn: this.turn.isTouched() ? unit(attitude) : s.target_attitude_body_to_rtn,
      servicer_position_rtn_m: this.start.isTouched() ? this.start.values() : s.servicer_position_rtn_m,
    };
  }

  async submit() {
    this.go.disabled = true;
    this.answer.replaceChildren("planning …");
    try {
      this.answer.replaceChildren(...(await this.ask(this.asked())));
    } catch (error) {
      this.answer.replaceChildren(make("span", { class: "bad tone" }, String(error.message)));
    }
    this.go.disabled = false;
  }

  /** Draws a tumble and a start from the mission's ranges, about the place in front of the port. */
  #random() {
    const within = (half) => half * (2 * Math.random() - 1);
    const { rate_rad_s, offset_m, standoff_m } = this.ranges;
    this.rate.set([0, 1, 2].map(() => degrees(within(rate_rad_s))));
    const { servicer_position_rtn_m: position } = this.scenario;
    const away = Math.hypot(...position) || standoff_m;
    this.start.set(position.map((x, i) => (x * standoff_m) / away + within(offset_m[i])));
    this.turn.set([0, 1, 2].map(() => within(25)));
    this.draft(this.asked());
  }
}

/** Three sliders with their numbers; untouched ones keep the values that were given. */
function fields(group, names, given, most) {
  const exact = [...given];
  let isTouched = false;
  const rows = names.map((name, i) =>
    row(`${group} ${name}`, name, given[i], most, (value) => {
      exact[i] = value;
      isTouched = true;
    }),
  );
  return {
    rows: rows.map(({ element }) => element),
    values: () => exact,
    isTouched: () => isTouched,
    set: (values) => values.forEach((value, i) => rows[i].set(value)),
  };
}

function row(label, name, given, most, changed) {
  const slider = make("input", { type: "range", min: -most, max: most, step: "any", "aria-label": label });
  const number = make("input", { type: "number", step: "any", "aria-label": label });
  const show = (value) => {
    slider.value = value;
    number.value = Number(value.toFixed(4));
  };
  const set = (value) => {
    if (Number.isFinite(value)) {
      show(value);
      changed(value);
    }
  };
  slider.addEventListener("input", () => set(Number(slider.value)));
  number.addEventListener("change", () => set(Number(number.value)));
  show(given);
  return { set, element: make("div", { class: "row" }, make("label", {}, name), slider, number) };
}
