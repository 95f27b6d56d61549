// The page by keys.

import { byId } from "./elements.js";
import { VIEWS } from "./scene/camera.js";

export function listen(page) {
  const { clock } = page;
  const step = (nodes) => clock.seek(clock.time + nodes * page.plan.step);
  const choose = (by) => page.show((page.which + by + page.shown.length) % page.shown.length);
  const keys = {
    " ": () => clock.toggle(),
    ArrowLeft: ({ shiftKey }) => step(shiftKey ? -10 : -1),
    ArrowRight: ({ shiftKey }) => step(shiftKey ? 10 : 1),
    Home: () => clock.seek(0),
    End: () => clock.seek(clock.duration),
    "+": () => clock.faster(1),
    "=": () => clock.faster(1),
    "-": () => clock.faster(-1),
    "[": () => choose(-1),
    "]": () => choose(1),
    p: () => page.form.go && page.form.submit(),
    l: () => page.theme(!page.isDark),
    "?": () => byId("help").showModal(),
  };
  VIEWS.forEach((view, i) => (keys[i + 1] = () => page.look(view)));
  document.addEventListener("keydown", (event) => {
    const { target, key, ctrlKey, metaKey, altKey } = event;
    const isField = target.matches("input, select") || (target.matches("button") && key === " ");
    if (isField || ctrlKey || metaKey || altKey || byId("help").open || !keys[key]) {
      return;
    }
    event.preventDefault();
    keys[key](event);
  });
}
