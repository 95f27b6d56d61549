// Plans what a plan's file was made from again, under node, by the planner that stands in page.html, and prints the
// checksum of what comes out. Needs nothing but node. Usage: node replay.mjs PLAN

import { readFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";
import { layoutsOf } from "./source/layout.js";
import { missionOf } from "./source/mission.js";
import { Planner } from "./source/planner.js";
import { scenarioOf } from "./source/scenario.js";

const here = (file) => new URL(file, import.meta.url);
const [, packed] = readFileSync(here("page.html"), "utf8").match(/id="remora-planner">([^<]*)</);
const header = readFileSync(here("../../core/capi/include/remora.h"), "utf8");

const [plan] = process.argv.slice(2);
if (!plan) {
  console.error("usage: node replay.mjs PLAN");
  process.exit(2);
}
const { inputs, mode, integrator, warm_start: start } = JSON.parse(readFileSync(plan, "utf8"));
const model =
  start === "heuristic" ? null : readFileSync(here(`../../fixtures/models/${integrator.split(":")[0]}.model`));
const code = await WebAssembly.compile(gunzipSync(Buffer.from(packed, "base64")));
const planner = await Planner.load(code, layoutsOf(header));
const found = planner.plan(missionOf(inputs.mission), scenarioOf(inputs.scenario), { mode, integrator, model });
console.log(found.checksum ?? found.refusal);
