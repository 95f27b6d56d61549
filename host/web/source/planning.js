// Asks the planner: in a thread of its own where the browser allows one, so that the page stays awake.

import { Planner } from "./planner.js";

export class Planning {
  #waiting = new Map();
  #next = 0;

  /** `unpack` answers the planner's code and its thread's, and models by integrator. */
  constructor(unpack, layouts) {
    this.unpack = unpack;
    this.layouts = layouts;
  }

  /** Gets ready, once: the first plan then takes no longer than others. */
  begin() {
    return (this.ready ??= this.unpack().then(async ({ worker, code, models }) => {
      const thread = await this.#thread(worker, code);
      const planner = thread ? null : await Planner.load(await WebAssembly.compile(code), this.layouts);
      return { models, thread, planner };
    }));
  }

  /** Plans: what `Planner.plan` answers. `options.guess`: model or heuristic. */
  async plan(mission, scenario, { mode, integrator, guess }) {
    const { models, thread, planner } = await this.begin();
    const model = guess === "heuristic" ? null : models[integrator.split(":")[0]];
    const options = { mode, integrator, model };
    return thread
      ? this.#ask(thread, { question: { mission, scenario, options } })
      : planner.plan(mission, scenario, options);
  }

  /** Starts the thread; null where the browser has none for such a page. */
  async #thread(source, code) {
    try {
      const thread = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
      thread.onmessage = ({ data: { id, result, reason } }) => {
        const [resolve, reject] = this.#waiting.get(id);
        this.#waiting.delete(id);
        reason ? reject(new Error(reason)) : resolve(result);
      };
      const failed = new Promise((_, reject) => (thread.onerror = () => reject(new Error("no thread"))));
      await Promise.race([this.#ask(thread, { setup: { code, layouts: this.layouts } }), failed]);
      return thread;
    } catch {
      return null;
    }
  }

  #ask(thread, message) {
    return new Promise((resolve, reject) => {
      const id = this.#next++;
      this.#waiting.set(id, [resolve, reject]);
      thread.postMessage({ id, ...message });
    });
  }
}
