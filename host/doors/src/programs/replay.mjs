// Plans again what `remora replay` hands to it, and prints the plan's checksum: the archive for C as WebAssembly, its
// structures filled number by number. Usage: node replay.mjs WASM [MODEL] <INPUT
import { readFileSync } from 'node:fs';

const [wasm, modelFile] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(wasm), {});
const { memory, ...remora } = instance.exports;

// What remora.h says.
const ABI = 1, WORKSPACE_BYTES = 1058816, ALIGNMENT = 64, REPORT_BYTES = 104, CHECKSUM = 96;
const OPTIONS_BYTES = 56, MODE = 4, MODEL = 24;

/** Memory at the end of what there is. */
function room(bytes) {
  const at = memory.buffer.byteLength;
  memory.grow(Math.ceil((bytes + ALIGNMENT) / 65536));
  return at;
}

/** A structure of these numbers, after its size: with a point or an exponent a double, any other an integer. */
function structure(line) {
  const numbers = line.trim().split(' ');
  const width = (number) => (/[.e]/.test(number) ? 8 : 4);
  const bytes = numbers.reduce((sum, number) => sum + width(number), 4);
  const at = room(bytes), view = new DataView(memory.buffer);
  view.setUint32(at, bytes, true);
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
  const bytes = new Uint8Array(memory.buffer), at = remora.remora_strerror(status);
  console.error(new TextDecoder().decode(bytes.subarray(at, bytes.indexOf(0, at))));
  process.exit(1);
}

const [missionLine, scenarioLine, optionsLine] = readFileSync(0, 'utf8').split('\n');
const mission = structure(missionLine), scenario = structure(scenarioLine);
const options = room(OPTIONS_BYTES), report = room(REPORT_BYTES), workspace = room(WORKSPACE_BYTES);
done(remora.remora_defaults(ABI, 0, 0, options, 0));
const set = (at, number) => new DataView(memory.buffer).setUint32(at, number, true);
optionsLine.trim().split(' ').forEach((number, i) => set(options + MODE + 4 * i, Number(number)));
if (modelFile !== undefined) {
  const model = readFileSync(modelFile), at = room(model.length);
  new Uint8Array(memory.buffer).set(model, at);
  set(options + MODEL, at);
  set(options + MODEL + 4, model.length);
}
set(report, REPORT_BYTES);
done(remora.remora_open(workspace, WORKSPACE_BYTES, ABI, mission));
done(remora.remora_plan(workspace, scenario, options, report));
const checksum = new DataView(memory.buffer).getBigUint64(report + CHECKSUM, true);
console.log(checksum.toString(16).padStart(16, '0'));
