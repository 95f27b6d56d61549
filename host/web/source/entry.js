// What the page offers to tests and to whoever opens the console: `window.remora`.

import { Page } from "./main.js";
import { Plan } from "./plan.js";
import { scenarioOf } from "./scenario.js";

/** Shows the page; what `window.remora` is. */
export function begin(data, planner) {
  const page = new Page(data, planner);
  return {
    page,
    /** Plans a scenario, as a plan's file has it, with the mission of the plan that is shown. */
    plan: (scenario, options = {}) =>
      page.planning.plan(page.plan.mission, scenarioOf(scenario), { ...page.options, ...options }),
    /** The page's own miss of a plan's file [m]. */
    miss: (file) => new Plan(file).miss,
  };
}
