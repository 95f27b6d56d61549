// What the keys do.

import { make } from "./elements.js";

export const KEYS = [
  ["space", "play, pause"],
  ["← →", "back and forth by a node; with shift by ten"],
  ["home end", "start, capture"],
  ["+ −", "faster, slower"],
  ["1 2 3 4", "overview, beside the servicer, from the port, from the camera"],
  ["[ ]", "plan before, plan after"],
  ["p", "plan what the sliders say"],
  ["l", "light, dark"],
  ["?", "this"],
];

export function fillHelp(dialog) {
  const caps = (keys) => keys.split(" ").flatMap((key) => [make("kbd", {}, key), " "]);
  const row = ([keys, what]) => make("tr", {}, make("td", {}, caps(keys)), make("td", {}, what));
  dialog.replaceChildren(
    make("h2", {}, "Keys"),
    make("table", {}, ...KEYS.map(row)),
    make(
      "p",
      { class: "note" },
      "Drag turns the picture, the wheel or two fingers bring it nearer. Drag over a strip to go to a moment. " +
        "Entries of the legend show and hide. R points away from the Earth, T along the orbit, N along its normal.",
    ),
    make("form", { method: "dialog" }, make("button", {}, "Close")),
  );
}
