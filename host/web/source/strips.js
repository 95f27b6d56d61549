// Quantities over time as small drawings under one time axis.

import { draw, make } from "./elements.js";
import { short } from "./numbers.js";

const [WIDTH, HEIGHT] = [1000, 100];
/** A limit is drawn where it is at most so many times as far as what is shown. */
const FAR = 2.5;

/** One strip; `set` moves its cursor. */
export class Strip {
  constructor({ title, unit, limits, planned, flown }, duration, seek) {
    this.lines = flown ?? planned;
    this.duration = duration;
    const ghosts = flown ? planned : [];
    const range = rangeOf([...this.lines, ...ghosts], limits.flat());
    this.cursor = draw("line", { class: "cursor", y1: -4, y2: HEIGHT + 4 });
    this.drawing = draw(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none" },
      ...levels(range, limits, this.lines),
      ...ghosts.map((line) => this.#path(line, range, "ghost")),
      ...this.lines.map((line) => this.#path(line, range, "")),
      this.cursor,
    );
    this.now = make("span", { class: "now" });
    this.values = this.lines.map((line) => this.now.appendChild(make("span", { class: line.tone })));
    this.element = make(
      "div",
      { class: "strip" },
      make("header", {}, make("b", {}, title), make("span", { class: "space" }), this.now),
      this.drawing,
      make("footer", {}, make("span", {}, unit), make("span", {}, use(this.lines, limits))),
    );
    this.#seeks(seek);
  }

  #path({ points, tone }, range, kind) {
    const at = ([time, value]) => `${short((time / this.duration) * WIDTH, 6)} ${short(level(value, range), 5)}`;
    return draw("path", { class: `${tone} ${kind}`, d: `M${points.map(at).join("L")}` });
  }

  #seeks(seek) {
    const to = (event) => {
      const { left, width } = this.drawing.getBoundingClientRect();
      seek((Math.min(Math.max(event.clientX - left, 0), width) / width) * this.duration);
    };
    this.element.addEventListener("pointerdown", to);
    this.element.addEventListener("pointermove", (event) => event.buttons && to(event));
  }

  set(time) {
    const x = (time / this.duration) * WIDTH;
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.lines.forEach(({ name, points }, i) => {
      this.values[i].textContent = `${name} ${short(valueAt(points, time), this.lines.length > 3 ? 2 : 3)}`;
    });
  }
}

const level = (value, [low, high]) => HEIGHT * (1 - (value - low) / (high - low));

/** What is shown, from below to above, with the limits that are not far off. */
function rangeOf(lines, limits) {
  let [low, high] = [Infinity, -Infinity];
  for (const { points } of lines) {
    for (const [, value] of points) {
      [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  const size = Math.max(Math.abs(low), Math.abs(high), 1e-9);
  for (const limit of limits.filter((limit) => Math.abs(limit) <= FAR * size)) {
    [low, high] = [Math.min(low, limit), Math.max(high, limit)];
  }
  const margin = 0.06 * (high - low || size);
  return [low - margin, high + margin];
}

/** Lines of zero and of the limits within the range, in a line's colour where each has its own. */
function levels(range, limits, lines) {
  const line = (value, kind) =>
    draw("line", { class: kind, x1: 0, x2: WIDTH, y1: level(value, range), y2: level(value, range) });
  const within = (value) => value >= range[0] && value <= range[1];
  const isShared = limits.every((pair) => String(pair) === String(limits[0]));
  const shown = isShared ? limits.slice(0, 1) : limits;
  const kind = (i) => `limit ${isShared ? "e" : lines[i].tone}`;
  return [
    ...[0].filter(within).map((zero) => line(zero, "zero")),
    ...shown.flatMap((pair, i) =>
      pair.filter((limit) => limit !== 0 && within(limit)).map((limit) => line(limit, kind(i))),
    ),
  ];
}

/** How much of its limits is used at the most. */
function use(lines, limits) {
  const share = ([low, high], value) => (value >= 0 ? value / high : low < 0 ? value / low : 0);
  const shares = lines.flatMap(({ points }, i) => points.map(([, value]) => share(limits[i], value)));
  const words = ([low, high]) =>
    low === -high ? `±${short(high)}` : low === 0 ? short(high) : `${short(low)} to ${short(high)}`;
  const named = [...new Set(limits.map(words))].join(", ");
  return `limit ${named} · ${(100 * Math.max(...shares)).toFixed(0)} % used`;
}

/** The value in force at a time: of points that are close together the line between them. */
function valueAt(points, time) {
  let [low, high] = [0, points.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    [low, high] = points[middle][0] <= time ? [middle, high] : [low, middle];
  }
  const [[t0, a], [t1, b]] = [points[low], points[high]];
  return t1 > t0 ? a + (b - a) * Math.min(Math.max((time - t0) / (t1 - t0), 0), 1) : b;
}
