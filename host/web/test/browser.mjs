// Chromium without a window, driven over a pipe by its own protocol: no library in between.

import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const FLAGS = [
  "--headless",
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--hide-scrollbars",
  "--disable-dev-shm-usage",
];
const program = process.env.REMORA_CHROMIUM ?? "chromium";
const makeFolder = () => mkdtempSync(join(tmpdir(), "remora-chromium-"));
/** Removes a folder once its last process has written. */
const remove = (folder) => rmSync(folder, { recursive: true, force: true, maxRetries: 30, retryDelay: 100 });

/** A screenshot by the command line, as a PNG file's bytes: it is taken as soon as the page has loaded. */
export function shoot(url, file, width, height) {
  const folder = makeFolder();
  const flags = [`--user-data-dir=${folder}`, `--window-size=${width},${height}`, `--screenshot=${file}`];
  execFileSync(program, [...FLAGS, ...flags, url], { stdio: "ignore" });
  remove(folder);
  return readFileSync(file);
}

export class Browser {
  #next = 1;
  #waiting = new Map();
  #listeners = [];

  /** Starts the program, which `REMORA_CHROMIUM` may name. */
  static start() {
    const browser = new Browser();
    browser.folder = makeFolder();
    const stdio = ["ignore", "ignore", "ignore", "pipe", "pipe"];
    const flags = [...FLAGS, "--remote-debugging-pipe", `--user-data-dir=${browser.folder}`];
    browser.program = spawn(program, flags, { stdio });
    browser.program.on("error", (error) => browser.#fail(error));
    browser.program.on("exit", (code) => browser.#fail(new Error(`${program} ended with status ${code}`)));
    let text = "";
    browser.program.stdio[4].setEncoding("utf8").on("data", (part) => {
      const messages = (text + part).split("\0");
      text = messages.pop();
      messages.forEach((message) => browser.#heard(JSON.parse(message)));
    });
    return browser;
  }

  #fail(error) {
    this.#waiting.forEach(({ reject }) => reject(error));
    this.#waiting.clear();
  }

  #heard({ id, result, error, method, params, sessionId }) {
    const waiting = this.#waiting.get(id);
    this.#waiting.delete(id);
    if (error) {
      waiting?.reject(new Error(error.message));
    } else if (id) {
      waiting?.resolve(result);
    } else {
      this.#listeners.forEach((listener) => listener(sessionId, method, params));
    }
  }

  send(method, params = {}, sessionId = undefined) {
    const id = this.#next++;
    this.program.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.#waiting.set(id, { resolve, reject }));
  }

  /** Opens a page of some size; what goes wrong in it is gathered in `faults`, what it asks for in `requests`. */
  async open(url, { width = 1440, height = 900, scale = 1, dark = false } = {}) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const tab = new Tab(this, sessionId);
    this.#listeners.push((session, method, params) => session === sessionId && tab.heard(method, params));
    for (const domain of ["Page", "Runtime", "Log", "Network"]) {
      await tab.send(`${domain}.enable`);
    }
    await tab.resize(width, height, scale);
    await tab.prefer(dark ? "dark" : "light");
    await tab.send("Page.navigate", { url });
    return tab;
  }

  /** Ends the program; what it has written goes with it. */
  async close() {
    this.program.removeAllListeners("exit");
    const ended = new Promise((resolve) => this.program.on("exit", resolve));
    this.send("Browser.close").catch(() => {});
    await ended;
    remove(this.folder);
  }
}

class Tab {
  constructor(browser, session) {
    Object.assign(this, { browser, session, faults: [], requests: [] });
  }

  send(method, params) {
    return this.browser.send(method, params, this.session);
  }

  resize(width, height, deviceScaleFactor = 1) {
    const metrics = { width, height, deviceScaleFactor, mobile: width < 500 };
    return this.send("Emulation.setDeviceMetricsOverride", metrics);
  }

  /** Prefers a theme: light or dark. */
  prefer(theme) {
    const features = [{ name: "prefers-color-scheme", value: theme }];
    return this.send("Emulation.setEmulatedMedia", { features });
  }

  heard(method, params) {
    if (method === "Runtime.exceptionThrown") {
      this.faults.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    } else if (method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(params.type)) {
      this.faults.push(params.args.map((argument) => argument.value ?? argument.description).join(" "));
    } else if (method === "Log.entryAdded" && params.entry.level === "error") {
      this.faults.push(params.entry.text);
    } else if (method === "Network.requestWillBeSent") {
      this.requests.push(params.request.url);
    }
  }

  /** The value of an expression, awaited. */
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", {
      expression,
      awaitPromise: true,
      returnByValue: true,
    });
    if (exceptionDetails) {
      throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    }
    return result.value;
  }

  /** Waits until an expression is true. */
  async until(expression, seconds = 20) {
    const end = Date.now() + 1000 * seconds;
    while (!(await this.evaluate(`Boolean(${expression})`))) {
      if (Date.now() > end) {
        throw new Error(`never true: ${expression}; ${this.faults.join("; ")}`);
      }
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
  }

  /** The page as it looks, as a file's bytes. */
  async picture(format = "webp") {
    const quality = format === "webp" ? { quality: 88 } : {};
    const { data } = await this.send("Page.captureScreenshot", { format, ...quality });
    return Buffer.from(data, "base64");
  }
}
