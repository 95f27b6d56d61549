// Remora's planner as WebAssembly: the functions of remora.h, called as a C program would, and plans as files have
// them.

import { hexadecimal } from "./checksum.js";
import { Memory } from "./memory.js";
import { RESIDUALS } from "./residuals.js";

const VERDICTS = ["optimal", "verified_not_converged", "not_flyable"];
const STATUSES = ["solved", "iteration_limit", "infeasible", "deadline", "numerical_failure"];
const REFUSED = "18";

/** Room for structures and the model's file behind the workspace. */
const ROOM = 16384;

export class Planner {
  /** Of the compiled module and the layouts of its header. */
  static async load(module, layouts) {
    const instance = await WebAssembly.instantiate(module, {});
    return new Planner(instance.exports, layouts);
  }

  constructor(library, layouts) {
    const { constants } = layouts;
    this.library = library;
    this.abi = Number(constants.REMORA_ABI);
    this.memory = new Memory(library.memory, layouts);
    this.bytes = Number(constants.REMORA_WORKSPACE_BYTES);
    this.workspace = this.memory.reserve(this.bytes);
    this.structures = this.memory.reserve(ROOM);
    this.models = new Map();
  }

  /** Plans what is built in: throws where this machine calculates other bits than it must. */
  check() {
    const [missionAt, checksumAt] = this.#places("RemoraMission", "RemoraReport");
    const { library, workspace } = this;
    this.#expect(library.remora_defaults(this.abi, missionAt, 0, 0, 0));
    this.#expect(library.remora_open(workspace, this.bytes, this.abi, missionAt));
    this.#expect(library.remora_self_test(workspace, 0, checksumAt));
  }

  /** Plans a scenario of a mission, both by the names of remora.h. Options: `mode` (optimal, feasible), `integrator`
   * (euler, rk4 or rk4:M) and `model`, the bytes of a model's file, or none for the heuristic. */
  plan(mission, scenario, options) {
    const [missionAt, scenarioAt, optionsAt, reportAt] = this.#places(
      "RemoraMission",
      "RemoraScenario",
      "RemoraOptions",
      "RemoraReport",
    );
    const { library, memory, workspace } = this;
    this.#expect(library.remora_defaults(this.abi, missionAt, scenarioAt, optionsAt, 0));
    memory.write("RemoraMission", missionAt, mission);
    memory.write("RemoraScenario", scenarioAt, scenario);
    memory.write("RemoraOptions", optionsAt, { ...optionsOf(options), ...this.#model(options.model) });
    memory.write("RemoraReport", reportAt, {});
    this.#expect(library.remora_open(workspace, this.bytes, this.abi, missionAt));
    const began = performance.now();
    const status = library.remora_plan(workspace, scenarioAt, optionsAt, reportAt);
    const seconds = (performance.now() - began) / 1000;
    const report = memory.read("RemoraReport", reportAt);
    if (String(status) === REFUSED) {
      return { refusal: report.refusal_name, seconds };
    }
    this.#expect(status);
    return { ...this.#results(report), seconds };
  }

  /** What was planned last: rows as in a plan's file, residuals, clearances and the record. */
  #results(report) {
    const [verificationAt, recordAt, nodeAt] = this.#places("RemoraVerification", "RemoraRecord", "RemoraNode");
    const { library, memory, workspace } = this;
    const found = this.#read("RemoraVerification", verificationAt, library.remora_verify);
    const record = this.#read("RemoraRecord", recordAt, library.remora_record);
    const nodes = Array.from({ length: report.nodes }, (_, k) => {
      memory.write("RemoraNode", nodeAt, {});
      this.#expect(library.remora_node(workspace, k, nodeAt));
      return memory.read("RemoraNode", nodeAt);
    });
    const closest = ({ distance_m, time_s, body }) => ({ distance_m, time_s, body });
    return {
      verdict: VERDICTS[report.verdict],
      status: STATUSES[report.status],
      start: report.start === 1 ? "model" : "heuristic",
      duration: report.duration_s,
      residuals: Object.fromEntries(RESIDUALS.map(([name, member]) => [name, found[member]])),
      clearances: { arm: closest(found.arm), bus: closest(found.bus), own: closest(found.own) },
      checksum: hexadecimal(report.checksum),
      input: hexadecimal(record.input),
      ...stagesOf(nodes, report, record),
    };
  }

  #read(name, at, call) {
    this.memory.write(name, at, {});
    this.#expect(call(this.workspace, at));
    return this.memory.read(name, at);
  }

  /** Places for structures, one behind the other. */
  #places(...names) {
    let at = this.structures;
    return names.map((name) => {
      const place = at;
      at += Math.ceil(this.memory.structures[name].size / 8) * 8;
      return place;
    });
  }

  /** A model's file in memory, put there once. */
  #model(bytes) {
    if (!bytes) {
      return { model: 0, model_bytes: 0 };
    }
    if (!this.models.has(bytes)) {
      const at = this.memory.reserve(bytes.length);
      new Uint8Array(this.memory.memory.buffer).set(bytes, at);
      this.models.set(bytes, at);
    }
    return { model: this.models.get(bytes), model_bytes: bytes.length };
  }

  #expect(status) {
    if (status !== 0) {
      const at = this.library.remora_strerror(status);
      const bytes = new Uint8Array(this.memory.memory.buffer, at, 200);
      throw new Error(new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0))));
    }
  }
}

/** Options by the names of remora.h. */
function optionsOf({ mode = "optimal", integrator = "rk4" }) {
  const [name, substeps = "8"] = integrator.split(":");
  return {
    mode: mode === "feasible" ? 1 : 0,
    integrator: name === "euler" ? 1 : 0,
    substeps: Number(substeps),
  };
}

/** The stages of a plan as its file has them. */
function stagesOf(nodes, report, record) {
  const states = (member) => nodes.map((node) => node[member]);
  const controls = (member) => states(member).slice(0, -1);
  return {
    stage1: {
      status: STATUSES[record.translation.status],
      iterations: report.iterations_1,
      cost: report.cost_1,
      position_rtn_m: states("com_position_rtn_m"),
      velocity_rtn_m_s: states("com_velocity_rtn_m_s"),
      force_rtn_n: controls("bus_force_rtn_n"),
    },
    stage2: {
      status: STATUSES[record.reorientation.status],
      iterations: report.iterations_2,
      cost: report.cost_2,
      attitude_body_to_rtn: states("bus_attitude_body_to_rtn"),
      joint_angle_rad: states("joint_angle_rad"),
      rate_rtn_rad_s: states("bus_rate_rtn_rad_s"),
      joint_rate_rad_s: states("joint_rate_rad_s"),
      bus_torque_body_n_m: controls("bus_torque_body_n_m"),
      joint_torque_n_m: controls("joint_torque_n_m"),
    },
  };
}
