// The planner in a thread of its own: answers each question with a plan or a reason.

import { Planner } from "./planner.js";

let planner;

onmessage = async ({ data: { id, setup, question } }) => {
  try {
    if (setup) {
      planner = await Planner.load(await WebAssembly.compile(setup.code), setup.layouts);
      planner.check();
      postMessage({ id });
      return;
    }
    postMessage({ id, result: planner.plan(question.mission, question.scenario, question.options) });
  } catch (error) {
    postMessage({ id, reason: String(error.message ?? error) });
  }
};
