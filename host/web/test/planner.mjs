// The planner in WebAssembly has the bits of every other door: run by `ci/web.sh` under node.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { checksumOf } from "../source/checksum.js";
import { layoutsOf } from "../source/layout.js";
import { missionOf } from "../source/mission.js";
import { Planner } from "../source/planner.js";
import { scenarioOf } from "../source/scenario.js";
import { golden, model, scenarios } from "./scenarios.mjs";

const header = readFileSync(new URL("../../../core/capi/include/remora.h", import.meta.url), "utf8");
const code = readFileSync(process.env.REMORA_PLANNER);
const load = async () => Planner.load(await WebAssembly.compile(code), layoutsOf(header));
const models = { euler: model("euler"), rk4: model("rk4") };
const optionsOf = ({ integrator, mode, guess }) => ({
  integrator,
  mode,
  model: guess === "model" ? models[integrator.split(":")[0]] : null,
});

/** Public scenarios that are planned, in eight ways each; `REMORA_SCENARIOS=60` takes all. */
const SCENARIOS = Number(process.env.REMORA_SCENARIOS ?? 12);

// Verifies REM-DOR-004.
test("public scenarios have the golden bits", async () => {
  const planner = await load();
  const given = scenarios();
  const ids = [...given.keys()].slice(0, SCENARIOS);
  const wanted = golden().filter(({ id }) => ids.includes(id));
  assert.equal(wanted.length, 8 * SCENARIOS);
  const times = [];
  for (const { id, checksum, ...options } of wanted) {
    const found = planner.plan({}, scenarioOf(given.get(id)), optionsOf(options));
    assert.equal(found.checksum, checksum, `${id} ${JSON.stringify(options)}`);
    // The page's own checksum of what was copied out, too.
    assert.equal(checksumOf(found), checksum);
    times.push(found.seconds);
  }
  times.sort((a, b) => a - b);
  console.log(`${times.length} plans, median ${(1e3 * times[times.length >> 1]).toFixed(0)} ms`);
});
