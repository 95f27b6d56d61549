// The page: plans and flights in, a picture over time out, and other plans on request.

import layouts from "remora.h";
import { showAxes } from "./axes.js";
import { Clock } from "./clock.js";
import { byId, make } from "./elements.js";
import { Flight } from "./flight.js";
import { Form } from "./form.js";
import { fillHelp } from "./help.js";
import { listen } from "./keyboard.js";
import { fillLegend } from "./legend.js";
import * as panel from "./panel.js";
import { Plan, readingsOf, replanned } from "./plan.js";
import { Planning } from "./planning.js";
import { scenarioOf } from "./scenario.js";
import { VIEWS } from "./scene/camera.js";
import { Stage } from "./scene/stage.js";
import { seriesOf } from "./series.js";
import { Strip } from "./strips.js";

/** The joints that the planner in the page is built for, as what flies is. */
const JOINTS = Number(layouts.constants.REMORA_JOINTS);

export class Page {
  /** Of plans and flights; `planner` unpacks what planning needs. */
  constructor(data, planner) {
    this.planning = new Planning(planner, layouts);
    this.shown = data.plans.map(({ file, input }) => ({ plan: new Plan(file, input), flight: null }));
    for (const flight of data.flights) {
      const { plan } = this.shown[flight.plan];
      this.shown.push({ plan, flight: new Flight(flight, plan) });
    }
    this.clock = new Clock((time) => this.set(time));
    this.form = new Form({
      plan: (scenario) => this.replan(scenario),
      draft: (scenario) => this.stage?.draft(scenario),
    });
    this.stage = this.#stage();
    this.#furnish();
    this.show(data.flights.length > 0 ? data.plans.length : 0);
  }

  /** The picture; none where the browser draws none. */
  #stage() {
    const canvas = document.querySelector("#stage canvas");
    const context = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!context) {
      byId("no-webgl").hidden = false;
      return null;
    }
    const axes = byId("axes");
    return new Stage(canvas, context, (camera) => {
      showAxes(axes, camera);
      // The frame after the next one begins when the picture's own has been handed over.
      requestAnimationFrame(() => requestAnimationFrame(() => this.#pictured()));
    });
  }

  /** Once the first picture stands, the planner gets ready. */
  #pictured() {
    if (!this.hasPicture) {
      this.hasPicture = true;
      performance.mark("picture");
      setTimeout(() => this.planning.begin());
    }
  }

  #furnish() {
    fillHelp(byId("help"));
    byId("ask").addEventListener("click", () => byId("help").showModal());
    byId("theme").addEventListener("click", () => this.theme(!this.isDark));
    byId("choice").addEventListener("change", (event) => this.show(Number(event.target.value)));
    byId("views").append(
      ...VIEWS.map((view) =>
        make("button", { type: "button", "data-view": view, onclick: () => this.look(view) }, view),
      ),
    );
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.theme(dark.matches));
    this.theme(dark.matches);
    this.look("overview");
    listen(this);
  }

  theme(isDark) {
    this.isDark = isDark;
    document.documentElement.dataset.theme = isDark ? "dark" : "light";
    this.stage?.theme(isDark);
  }

  look(view) {
    for (const button of byId("views").children) {
      button.setAttribute("aria-pressed", String(button.dataset.view === view));
    }
    this.stage?.look(view);
  }

  /** Shows one of the plans or flights. */
  show(which) {
    this.which = which;
    const { plan, flight } = this.shown[which];
    this.plan = plan;
    this.flight = flight;
    const name = ({ plan: of, flight: by }) => (by ? `${of.name}, ${by.name}` : of.name);
    byId("choice").replaceChildren(...this.shown.map((of, i) => make("option", { value: i }, name(of))));
    byId("choice").value = which;
    document.title = `${name(this.shown[which])} – Remora`;
    this.series = seriesOf(plan, flight);
    panel.showPlan(plan, flight, this.series);
    this.form.show(plan, this.#whyNot(plan));
    const duration = Math.max(plan.duration, flight?.duration ?? 0);
    const seek = (time) => this.clock.seek(time);
    this.strips = this.series.map((one) => new Strip(one, duration, seek));
    byId("strips").replaceChildren(...this.strips.map((strip) => strip.element));
    if (this.stage) {
      // Last: only now its place has its size.
      this.stage.show(plan, flight);
      const toggle = (part, isShown) => this.stage.toggle(part, isShown);
      fillLegend(byId("legend"), { hasFlight: Boolean(flight), hidden: this.stage.hidden, toggle });
    }
    this.clock.show(plan, duration);
  }

  /** Why a plan cannot be made otherwise in the page; null where it can. */
  #whyNot(plan) {
    if (plan.joints !== JOINTS) {
      return (
        `The planner in this page is the one that flies: it is built for arms of ${JOINTS} joints, and this one ` +
        `has ${plan.joints}. The program plans it: remora plan --mission FILE.`
      );
    }
    return typeof WebAssembly === "undefined"
      ? "This browser has no WebAssembly: the planner does not run here."
      : null;
  }

  /** Everything at a time [s]. */
  set(time) {
    this.strips.forEach((strip) => strip.set(time));
    const motion = this.flight ?? this.plan;
    panel.showReadings(this.plan, time, readingsOf(this.plan.mission, motion.at(time), motion.targetAt(time)));
    if (this.stage && this.stage.time !== time) {
      this.stage.set(time);
    }
  }

  /** How the plan that is shown was made. */
  get options() {
    const { mode, integrator, warm_start: start } = this.plan.file;
    return { mode, integrator, guess: start === "heuristic" ? "heuristic" : "model" };
  }

  /** Plans a scenario of the plan's mission and shows what comes of it; what there is to say of it. */
  async replan(scenario) {
    const { plan, options } = this;
    const result = await this.planning.plan(plan.mission, scenarioOf(scenario), options);
    const time = `${(1e3 * result.seconds).toFixed(0)} ms`;
    if (result.refusal) {
      return [make("span", { class: "bad tone" }, `not flyable: refused for ${result.refusal}, no plan was made`)];
    }
    const isSame = result.checksum === plan.checksum;
    if (!isSame) {
      const name = `${plan.name.split(" ")[0]} otherwise ${this.shown.length}`;
      this.shown.push({ plan: new Plan(replanned(plan, name, scenario, options, result)), flight: null });
      const at = this.clock.time;
      this.show(this.shown.length - 1);
      this.clock.seek(at);
    }
    const said = isSame ? "the plan that was here, bit by bit: " : `${result.verdict.replaceAll("_", " ")}, `;
    return [`${said}in ${time}, checksum `, make("code", {}, result.checksum)];
  }
}
