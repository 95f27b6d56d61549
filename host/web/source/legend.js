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
  const onclick = ({ currentTarget: button }) => {
    const isShown = button.getAttribute("aria-pressed") === "false";
    button.setAttribute("aria-pressed", String(isShown));
    toggle(button.dataset.name, isShown);
  };
  const pressed = (name) => ({ "data-name": name, "aria-pressed": String(!hidden.has(name)), onclick });
  const entry = ([words, tone, kind, name]) => {
    const attributes = { type: "button", ...(name ? pressed(name) : { tabindex: -1 }) };
    return make("button", attributes, make("i", { class: `${tone} ${kind}` }), words);
  };
  const entries = hasFlight ? [...ENTRIES, ["planned", "g", "", "ghost"]] : ENTRIES;
  element.replaceChildren(...entries.map(entry));
}
