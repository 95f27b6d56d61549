// Figures of a plan beside its picture: verdict, headline, residuals, distances, how and where it was made.

import { byId, make } from "./elements.js";
import { degrees, metres, percent, short } from "./numbers.js";
import { RESIDUALS } from "./residuals.js";

const VERDICTS = {
  optimal: ["optimal", "good"],
  verified_not_converged: ["verified but not converged", "fair"],
  not_flyable: ["not flyable", "bad"],
};

/** Decades below a tolerance that a meter shows. */
const DECADES = 12;
/** Share of a limit that counts as rounding. */
const ROUNDING = 1e-3;

function showVerdict(plan) {
  const [words, tone] = VERDICTS[plan.file.verdict] ?? ["not judged", "fair"];
  Object.assign(byId("verdict"), { textContent: words, className: `chip ${tone}` });
}

const numeric = (text) => make("td", { class: "n" }, text);
const row = (name, ...cells) => make("tr", {}, make("td", {}, name), ...cells);

/** A share as a bar. */
const meter = (share, tone, title) =>
  make("div", { class: `meter ${tone}`, title }, make("i", { style: `width:${(100 * share).toFixed(1)}%` }));

/** Figures as a list; those of the kind `big` are the headline. */
function figures(list) {
  const figure = ([name, value, kind = ""]) =>
    make("div", { class: kind }, make("dt", {}, name), make("dd", {}, value));
  return make("dl", { class: "figures" }, list.map(figure));
}

/** The headline: delta-v, the smallest margin, and the peak use of each limit. */
function showSummary(plan, flight, series) {
  const peaks = series.map(({ title, peak }) => ({ ...peak, title }));
  const closest = peaks.reduce((most, peak) => (peak.share > most.share ? peak : most));
  const place = ({ title, name, time }) =>
    `${title.startsWith("Joint") ? `joint ${name}, ` : name === "port" ? "" : `${name}, `}${time.toFixed(0)} s`;
  const rows = peaks.map((peak) =>
    row(
      peak.title,
      make("td", {}, meter(Math.min(peak.share, 1), peak.share > 1 + ROUNDING ? "bad" : "even", "")),
      numeric(percent(peak.share)),
      numeric(place(peak)),
    ),
  );
  byId("summary").replaceChildren(
    make("h2", {}, plan.name),
    figures([
      [flight ? "Delta-v, planned" : "Delta-v", `${short(1e3 * plan.deltaV)} mm/s`, "big"],
      ["Smallest margin", [percent(1 - closest.share), make("small", {}, closest.title.toLowerCase())], "big"],
      ...(flight ? [["Miss at the port, flown", metres(flight.miss)]] : []),
    ]),
    make("table", { class: "limits" }, make("caption", {}, "Peak use of limits"), ...rows),
    ...(flight
      ? [make("p", { class: "note" }, `Solid: what was flown, ${flight.name}. Faint and dashed: what was planned.`)]
      : []),
  );
}

/** How the plan was made, and by how much it captures: the page's own miss beside the planner's residual. */
function showMaking(plan) {
  const { stage1, stage2, warm_start, integrator, mode, residuals, time_s } = plan.file;
  byId("making").replaceChildren(
    make("h2", {}, "Captured and planned"),
    figures([
      ["Captured: miss", metres(plan.miss)],
      ["Planner's residual", metres(residuals.ee_position)],
      ["They differ by", metres(Math.abs(plan.miss - (residuals.ee_position ?? NaN)))],
      ["Planned in", time_s === null ? "–" : `${(1e3 * time_s).toFixed(0)} ms`],
      ["Iterations, stages 1, 2", `${stage1.iterations} + ${stage2.iterations}`],
      ["Cost, stages 1, 2", `${short(stage1.cost)} + ${short(stage2.cost)}`],
      ["Start of stage 2", warm_start],
      ["Integrator, mode", `${integrator}, ${mode}`],
    ]),
  );
}

function showResiduals(plan) {
  const heads = [["residual"], ["value", "n"], ["tolerance", "n"], [""]];
  const rows = RESIDUALS.map(([name, member, unit]) => {
    const value = plan.file.residuals[name] ?? Infinity;
    const tolerance = plan.mission[`tolerance_${member.replace(/\d$/, "")}`];
    const [tone, words] = value <= tolerance ? ["good", "met"] : ["bad", "too large"];
    const share = value > 0 ? Math.min(Math.max(1 + Math.log10(value / tolerance) / DECADES, 0), 1) : 0;
    const bar = make("td", {}, meter(share, tone, words));
    const of = row(name, numeric(short(value)), numeric(tolerance.toExponential(0)), bar);
    of.title = unit;
    of.className = tone === "bad" ? "bad tone" : "";
    return of;
  });
  const head = make("tr", {}, ...heads.map(([text, kind = ""]) => make("th", { class: kind }, text)));
  byId("residuals").replaceChildren(head, ...rows);
}

function showClearances(plan, flight) {
  const { arm, bus, own } = plan.file.clearances ?? {};
  const distances = [
    ["centre of mass to far keep-out", plan.keepOutMargin(flight ?? plan, flight?.times ?? plan.instants(2))],
    ["arm to target", arm],
    ["bus to target", bus],
    ["arm to own bus", own],
  ];
  const rows = distances.map(([words, { distance_m: distance = null, time_s: time = null } = {}]) => {
    const isKnown = Number.isFinite(distance);
    const [length, at] = isKnown ? [`${distance.toFixed(3)} m`, `${time.toFixed(0)} s`] : ["–", ""];
    return row(words, numeric(length), numeric(at));
  });
  byId("clearances").replaceChildren(...rows);
}

/** Where the plan comes from, by checksums. */
function showFooter(plan) {
  const { program, inputs } = plan.file;
  const parts = [
    ["planned by remora", program ? `${program.version}, ${program.commit}` : "–"],
    ["mission", inputs.mission_checksum],
    ["scenario", plan.file.inputs.scenario_checksum ?? "changed here"],
    ["plan", plan.checksum],
  ];
  byId("footer").replaceChildren(
    ...parts.map(([name, value]) => make("span", {}, `${name} `, make("code", {}, value))),
  );
}

/** All figures of a plan and, where there is one, of a flight of it. */
export function showPlan(plan, flight, series) {
  showVerdict(plan);
  showSummary(plan, flight, series);
  showClearances(plan, flight);
  showResiduals(plan);
  showMaking(plan);
  showFooter(plan);
}

/** Distances and angles of the moment. */
export function showReadings(plan, time, { centre, tip, sight }) {
  const rows = [
    ["centre of mass to the box", `${centre.toFixed(2)} m`],
    ["keep-out in force", `${plan.keepOut(time).toFixed(2)} m`],
    ["end effector to the port", metres(tip)],
    ["port off the boresight", `${degrees(sight).toFixed(1)}°`],
  ];
  byId("readings").replaceChildren(...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
}
