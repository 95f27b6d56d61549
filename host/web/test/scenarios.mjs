// The public scenarios and the checksums that their plans have behind every door.

import { readFileSync } from "node:fs";
import { inPlan } from "../source/scenario.js";

const fixture = (file) => new URL(`../../../fixtures/${file}`, import.meta.url);

/** Scenarios as plans' files have them, by id. */
export function scenarios() {
  const set = JSON.parse(readFileSync(fixture("scenarios/public.scenarios.json"), "utf8"));
  return new Map(set.scenarios.map((scenario) => [scenario.id, inPlan(scenario)]));
}

/** What is planned: id, options, and the checksum that it has in fixtures/golden/public.csv. */
export function golden() {
  const [head, ...lines] = readFileSync(fixture("golden/public.csv"), "utf8").trim().split("\n");
  const columns = head
    .split(",")
    .slice(1)
    .map((column) => {
      const [integrator, mode, guess] = column.split(" ");
      return { integrator, mode, guess };
    });
  return lines.flatMap((line) => {
    const [id, ...checksums] = line.split(",");
    return checksums.map((checksum, i) => ({ id, ...columns[i], checksum }));
  });
}

/** A model's file by the name of its integrator. */
export const model = (integrator) => readFileSync(fixture(`models/${integrator.split(":")[0]}.model`));
