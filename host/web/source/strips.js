// Quantities over time as small charts under one time axis.

import { draw, make } from "./elements.js";
import { bracket, decimalsOf, fixed, percent, short } from "./numbers.js";

const [WIDTH, HEIGHT] = [1000, 100];
/** A limit is drawn where it is at most so many times as far as the lines. */
const FAR = 2.5;
/** Smallest range of a chart, as a share of the limits. */
const LEAST = 1e-3;

/** One chart; `set` moves its cursor. */
export class Strip {
  constructor({ title, unit, limits, planned, flown, peak }, duration, seek) {
    this.lines = flown ?? planned;
    this.duration = duration;
    const ghosts = flown ? planned : [];
    const range = rangeOf([...this.lines, ...ghosts], limits.flat().filter(Number.isFinite));
    const [ticks, decimals] = ticksOf(range);
    this.cursor = draw("line", { class: "cursor", y1: 0, y2: HEIGHT });
    this.drawing = draw(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none" },
      ...ticks.map((tick) => levelLine(tick, range, tick === 0 ? "zero" : "tick")),
      ...limitLines(range, limits, this.lines),
      ...ghosts.map((line) => this.#path(line, range, "ghost")),
      ...this.lines.map((line) => this.#path(line, range, "")),
      this.cursor,
    );
    this.decimals = decimalsOf(Math.max(...this.lines.flatMap(sizesOf)), 3);
    this.values = this.lines.map(() => make("span"));
    const legend = this.lines.map(({ name, tone }, i) =>
      make("span", { class: tone }, make("small", {}, name), this.values[i]),
    );
    const label = (tick) => make("i", { style: `top:${level(tick, range)}%` }, fixed(tick, decimals));
    const use = make("span", { class: peak.share > 1 + LEAST ? "bad tone" : "use" }, `${percent(peak.share)} used`);
    const name = [make("b", {}, title), make("span", { class: "use" }, `[${unit}]`)];
    const foot = ["0 s", wordsOf(limits), `${duration.toFixed(0)} s`].map((words) => make("span", {}, words));
    this.element = make(
      "div",
      { class: "strip" },
      make("header", {}, name, make("span", { class: "space" }), use),
      make("div", { class: "now" }, ...legend),
      make("div", { class: "plot" }, make("div", { class: "ticks" }, ...ticks.map(label)), this.drawing),
      make("footer", {}, foot),
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
    this.lines.forEach(({ points }, i) => {
      this.values[i].textContent = fixed(valueAt(points, time), this.decimals);
    });
  }
}

/** Height of a value from above, in percent. */
const level = (value, [low, high]) => HEIGHT * (1 - (value - low) / (high - low));

function levelLine(value, range, kind) {
  const y = level(value, range);
  return draw("line", { class: kind, x1: 0, x2: WIDTH, y1: y, y2: y });
}

const sizesOf = ({ points }) => points.map(([, value]) => Math.abs(value));

/** The range of a chart, from below to above, with the limits that are not far off. */
function rangeOf(lines, limits) {
  const values = lines.flatMap(({ points }) => points.map(([, value]) => value));
  let [low, high] = values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [0, 0]);
  const size = Math.max(-low, high, LEAST * Math.min(...limits.map(Math.abs)));
  for (const limit of limits.filter((limit) => Math.abs(limit) <= FAR * size)) {
    [low, high] = [Math.min(low, limit), Math.max(high, limit)];
  }
  const margin = 0.06 * Math.max(high - low, size);
  return [low - margin, high + margin];
}

/** Two to six round values within a range, and their decimals. */
function ticksOf([low, high]) {
  const least = (high - low) / 5.2;
  const decade = 10 ** Math.floor(Math.log10(least));
  const step = decade * [1, 2, 5, 10].find((factor) => factor * decade >= least);
  const first = Math.ceil(low / step);
  const ticks = Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => (first + i) * step);
  return [ticks, decimalsOf(step, 1)];
}

/** Limits within the range, in a line's colour where each has its own. */
function limitLines(range, limits, lines) {
  const isShared = new Set(limits.map(String)).size === 1;
  const isShown = (limit) => limit && limit >= range[0] && limit <= range[1];
  return (isShared ? limits.slice(0, 1) : limits).flatMap((pair, i) =>
    pair.filter(isShown).map((limit) => levelLine(limit, range, `limit ${isShared ? "e" : lines[i].tone}`)),
  );
}

function wordsOf(limits) {
  const words = ([low, high]) =>
    low === -high ? `±${short(high)}` : low === null ? short(high) : `${short(low)} to ${short(high)}`;
  return `limit ${[...new Set(limits.map(words))].join(", ")}`;
}

/** The value in force at a time: of points that are close together the line between them. */
function valueAt(points, time) {
  const [low, high, share] = bracket((i) => points[i][0], points.length, time);
  return points[low][1] + share * (points[high][1] - points[low][1]);
}
