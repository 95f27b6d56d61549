// Plans again what `cargo xtask replay` hands to it, and prints the plan's checksum: the archive for C as WebAssembly, its
// structures filled number by number. Usage: node replay.mjs WASM [MODEL] <INPUT

import { readFileSync } from "node:fs";
import { hexadecimal } from "../../../../web/source/checksum.js";
import { layoutsOf } from "../../../../web/source/layout.js";
import { Memory } from "../../../../web/source/memory.js";

const [wasm, modelFile] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(wasm), {});
const remora = instance.exports;
const header = new URL("../../../../../core/capi/include/remora.h", import.meta.url);
const layouts = layoutsOf(readFileSync(header, "utf8"));
const [abi, bytes] = ["REMORA_ABI", "REMORA_WORKSPACE_BYTES"].map((name) => Number(layouts.constants[name]));
const memory = new Memory(remora.memory, layouts);
const structure = (name) => memory.reserve(layouts.structures[name].size);

/** A structure of these numbers, after its size: with a point or an exponent a double, any other an integer. */
function filled(line) {
  const numbers = line.trim().split(" ");
  const width = (number) => (/[.e]/.test(number) ? 8 : 4);
  const size = numbers.reduce((sum, number) => sum + width(number), 4);
  const at = memory.reserve(size);
  const view = new DataView(remora.memory.buffer);
  view.setUint32(at, size, true);
  let next = at + 4;
  for (const number of numbers) {
    if (width(number) === 8) view.setFloat64(next, Number(number), true);
    else view.setUint32(next, Number(number), true);
    next += width(number);
  }
  return at;
}

function done(status) {
  if (status === 0) return;
  const text = new Uint8Array(remora.memory.buffer, remora.remora_strerror(status));
  console.error(new TextDecoder().decode(text.subarray(0, text.indexOf(0))));
  process.exit(1);
}

/** A model's file in memory, as options tell of it. */
function placed(file) {
  const model = readFileSync(file);
  const at = memory.reserve(model.length);
  new Uint8Array(remora.memory.buffer).set(model, at);
  return { model: at, model_bytes: model.length };
}

const [missionLine, scenarioLine, optionsLine] = readFileSync(0, "utf8").split("\n");
const [mission, scenario] = [filled(missionLine), filled(scenarioLine)];
const [options, report] = [structure("RemoraOptions"), structure("RemoraReport")];
const workspace = memory.reserve(bytes);
done(remora.remora_defaults(abi, 0, 0, options, 0));
const [mode, integrator, substeps] = optionsLine.trim().split(" ").map(Number);
const model = modelFile === undefined ? {} : placed(modelFile);
memory.write("RemoraOptions", options, { mode, integrator, substeps, ...model });
memory.write("RemoraReport", report, {});
done(remora.remora_open(workspace, bytes, abi, mission));
done(remora.remora_plan(workspace, scenario, options, report));
console.log(hexadecimal(memory.read("RemoraReport", report).checksum));
