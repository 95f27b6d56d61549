// What is said of a plan beside its picture: verdict, figures, residuals, distances, where it comes from.

import { byId, make } from "./elements.js";
import { degrees, metres, short } from "./numbers.js";

const VERDICTS = {
  optimal: ["optimal", "good"],
  verified_not_converged: ["verified but not converged", "fair"],
  not_flyable: ["not flyable", "bad"],
};

/** Residuals in the order of files: name, tolerance in the mission, unit. */
const RESIDUALS = [
  ["dynamics1", "tolerance_dynamics", "1 m, 1e-2 m/s"],
  ["keep_out", "tolerance_keep_out_m", "m"],
  ["dynamics2", "tolerance_dynamics", "1, 1 rad, 1e-2 rad/s"],
  ["control", "tolerance_control", "of the limit"],
  ["joint", "tolerance_joint_rad", "rad"],
  ["joint_rate", "tolerance_joint_rate", "of the limit"],
  ["pointing", "tolerance_pointing", "cosine"],
  ["preset", "tolerance_preset", "1 rad, 1e-2 rad/s"],
  ["terminal_rate", "tolerance_terminal_rate", "1e-2 rad/s"],
  ["ee_position", "tolerance_ee_position_m", "m"],
  ["ee_angle", "tolerance_ee_angle_rad", "rad"],
  ["clearance", "tolerance_clearance_m", "m"],
];
/** Decades below a tolerance that a meter shows. */
const DECADES = 12;

export function showVerdict(plan) {
  const [words, tone] = VERDICTS[plan.file.verdict] ?? ["not judged", "fair"];
  Object.assign(byId("verdict"), { textContent: words, className: `chip ${tone}` });
}

/** Figures of the plan; the miss is the page's own, beside the planner's residual. */
export function showSummary(plan, flight) {
  const { stage1, stage2, warm_start, integrator, residuals, time_s } = plan.file;
  const time = time_s === null ? "–" : `${(1e3 * time_s).toFixed(0)} ms`;
  const figures = [
    [
      flight ? "Planned: miss at the port, by this page" : "Miss at the port, by this page",
      metres(plan.miss),
      "wide",
    ],
    ["the planner's residual", metres(residuals.ee_position)],
    ["they differ by", metres(Math.abs(plan.miss - (residuals.ee_position ?? NaN)))],
    ["Iterations, stage 1 and 2", `${stage1.iterations} + ${stage2.iterations}`],
    ["Planned in", time],
    ["Change of velocity", `${short(1e3 * plan.deltaV)} mm/s`],
    ["Cost, stage 1 and 2", `${short(stage1.cost)} + ${short(stage2.cost)}`],
    ["Start of stage 2", warm_start],
    ["Integrator", integrator],
  ];
  if (flight) {
    figures.unshift(["Flown: end effector to the port at the end", metres(flight.miss), "wide"]);
  }
  byId("summary").replaceChildren(
    make("h2", {}, plan.name),
    make(
      "dl",
      { class: "figures" },
      figures.map(([name, value, kind = ""]) =>
        make("div", { class: kind }, make("dt", {}, name), make("dd", {}, value)),
      ),
    ),
    ...(flight
      ? [make("p", { class: "note" }, `Solid: what was flown, ${flight.name}. Faint and dashed: what was planned.`)]
      : []),
  );
}

export function showResiduals(plan) {
  const { residuals } = plan.file;
  const head = make(
    "tr",
    {},
    make("th", {}, "residual"),
    make("th", { class: "n" }, "value"),
    make("th", { class: "n" }, "tolerance"),
    make("th"),
  );
  const rows = RESIDUALS.map(([name, limit, unit]) => {
    const [value, tolerance] = [residuals[name] ?? Infinity, plan.mission[limit]];
    const isMet = value <= tolerance;
    const share = value > 0 ? Math.min(Math.max(1 + Math.log10(value / tolerance) / DECADES, 0), 1) : 0;
    const meter = make(
      "div",
      { class: `meter ${isMet ? "good" : "bad"}`, title: isMet ? "met" : "too large" },
      make("i", { style: `width:${(100 * share).toFixed(0)}%` }),
    );
    return make(
      "tr",
      { title: unit },
      make("td", { class: isMet ? "" : "bad tone" }, name),
      make("td", { class: "n" }, Number.isFinite(value) ? short(value, 3) : "–"),
      make("td", { class: "n" }, tolerance.toExponential(0)),
      make("td", {}, meter),
    );
  });
  byId("residuals").replaceChildren(head, ...rows);
}

export function showClearances({ file: { clearances } }) {
  const pairs = [
    ["arm to target", "arm"],
    ["bus to target", "bus"],
    ["arm to own bus", "own"],
  ];
  const rows = pairs.map(([words, name]) => {
    const { distance_m: distance = null, time_s: time = null } = clearances?.[name] ?? {};
    const isKnown = distance !== null && Number.isFinite(distance);
    return make(
      "tr",
      {},
      make("td", {}, words),
      make("td", { class: "n" }, isKnown ? `${distance.toFixed(3)} m` : "–"),
      make("td", { class: "n" }, isKnown ? `at ${time.toFixed(0)} s` : ""),
    );
  });
  byId("clearances").replaceChildren(...rows);
}

/** Where the plan comes from, by checksums. */
export function showFooter(plan) {
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
