// Missions of plans' files reach the planner bit by bit: other spacecraft have the plans of the program too.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { checksumOf } from "../source/checksum.js";
import { layoutsOf } from "../source/layout.js";
import { missionOf } from "../source/mission.js";
import { Plan } from "../source/plan.js";
import { Planner } from "../source/planner.js";
import { scenarioOf } from "../source/scenario.js";
import { Bench, root } from "./program.mjs";

const header = readFileSync(`${root}/core/capi/include/remora.h`, "utf8");
const MISSIONS = ["missions/default", "missions/small", "missions/strong", "missions/tumble-1", "arms/three-spatial"];

// Verifies REM-DOR-004.
test("a plan of another mission has the same bits", async () => {
  const code = await WebAssembly.compile(readFileSync(process.env.REMORA_PLANNER));
  const planner = await Planner.load(code, layoutsOf(header));
  const bench = new Bench();
  for (const name of MISSIONS) {
    const mission = `${root}/fixtures/${name}.mission.toml`;
    bench.run(`draw --mission ${mission} --count 1 --seed 3 --out a.scenarios.json --force`);
    const plan = "plan --scenarios a.scenarios.json --warm-start heuristic --mode feasible --out a.plan.json --force";
    bench.run(`${plan} --mission ${mission}`);
    const file = bench.json("a.plan.json");
    const { mission: given, scenario } = file.inputs;
    const options = { mode: "feasible", integrator: file.integrator };
    const found = planner.plan(missionOf(given), scenarioOf(scenario), options);
    assert.equal(found.checksum, checksumOf(file), name);
    assert.equal(found.input, bench.json("a.evidence.json").input, name);
    assert.equal(found.verdict, file.verdict);
    assert.ok(Math.abs(new Plan(file).miss - file.residuals.ee_position) < 1e-6, name);
  }
  bench.clear();
});
