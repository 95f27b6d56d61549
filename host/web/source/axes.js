// The axes of RTN in a corner, as one looks at them.

import { draw } from "./elements.js";

const AXES = [
  ["R", [1, 0, 0], "var(--blue)"],
  ["T", [0, 1, 0], "var(--orange)"],
  ["N", [0, 0, 1], "var(--green)"],
];

/** Draws the axes as a camera sees them. */
export function showAxes(drawing, camera) {
  const e = camera.matrixWorldInverse.elements;
  const seen = AXES.map(([name, [x, y, z], colour]) => ({
    name,
    colour,
    x: e[0] * x + e[4] * y + e[8] * z,
    y: -(e[1] * x + e[5] * y + e[9] * z),
    depth: e[2] * x + e[6] * y + e[10] * z,
  }));
  seen.sort((a, b) => a.depth - b.depth);
  drawing.replaceChildren(
    ...seen.flatMap(({ name, colour, x, y, depth }) => {
      const opacity = 0.6 + 0.4 * Math.max(depth, -1);
      return [
        draw("line", { x1: 0, y1: 0, x2: 30 * x, y2: 30 * y, stroke: colour, opacity }),
        draw("text", { x: 41 * x, y: 41 * y, fill: `color-mix(in srgb, ${colour} 60%, var(--text))` }, name),
      ];
    }),
  );
}
