// What the colours mean; what can be hidden is a button.

import { make } from "./elements.js";

const ENTRIES = [
  ["bus", "a", "", null],
  ["arm", "c", "", null],
  ["target", "g", "", null],
  ["port", "b", "", null],
  ["keep-out", "d", "open", "shell"],
  ["field of view", "f", "open", "cone"],
  ["paths", "a", "line", "path"],
  ["earlier and later", "g", "open", "stops"],
  ["rings a metre apart", "g", "line", "rings"],
];

/** Fills the legend; `hidden` holds the names of what is not shown. */
export function fillLegend(element, { hasFlight, hidden, toggle }) {
  const entries = hasFlight ? [...ENTRIES, ["planned", "g", "", "ghost"]] : ENTRIES;
  element.replaceChildren(
    ...entries.map(([words, tone, kind, name]) => {
      const attributes = name ? { "data-name": name, "aria-pressed": String(!hidden.has(name)) } : { tabindex: -1 };
      const button = make(
        "button",
        { type: "button", ...attributes },
        make("i", { class: `${tone} ${kind}` }),
        words,
      );
      if (name) {
        button.addEventListener("click", () => {
          const isShown = button.getAttribute("aria-pressed") === "false";
          button.setAttribute("aria-pressed", String(isShown));
          toggle(name, isShown);
        });
      }
      return button;
    }),
  );
}
