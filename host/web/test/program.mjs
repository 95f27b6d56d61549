// The program `remora`, run as a user runs it, in a folder of its own.

import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const root = fileURLToPath(new URL("../../..", import.meta.url));

export class Bench {
  constructor() {
    this.folder = mkdtempSync(join(tmpdir(), "remora-page-"));
  }

  path(name) {
    return join(this.folder, name);
  }

  /** Runs a command that must end well; what it prints. */
  run(line) {
    const program = process.env.REMORA_PROGRAM;
    return execFileSync(program, line.split(" "), {
      cwd: this.folder,
      encoding: "utf8",
      stdio: ["ignore", "pipe", "inherit"],
    });
  }

  json(name) {
    return JSON.parse(readFileSync(this.path(name), "utf8"));
  }

  has(name) {
    return existsSync(this.path(name));
  }

  clear() {
    rmSync(this.folder, { recursive: true, force: true });
  }
}
