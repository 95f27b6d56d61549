// Builds page.html: code, style and planner in one file that loads nothing. The same sources and the same planner
// make the same bytes, whatever the machine: what packs is a library of its own, not the machine's.
// Usage: node build.mjs PLANNER.wasm MAKER OUT.html, MAKER being what the planner was compiled by.

import { build } from "esbuild";
import { gzipSync } from "fflate";
import { readFileSync, writeFileSync } from "node:fs";
import { layoutsOf } from "./source/layout.js";

const here = (file) => new URL(file, import.meta.url);
const read = (file) => readFileSync(here(file), "utf8");

/** `import layouts from "remora.h"`: the header's structures, as they lie in WebAssembly's memory. */
const header = {
  name: "header",
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^remora\.h$/ }, () => ({ path: "remora.h", namespace: "header" }));
    onLoad({ filter: /.*/, namespace: "header" }, () => ({
      contents: JSON.stringify(layoutsOf(read("../../core/capi/include/remora.h"))),
      loader: "json",
    }));
  },
};

async function bundle(entry, options = {}) {
  const { outputFiles } = await build({
    entryPoints: [here(`source/${entry}`).pathname],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2022",
    charset: "utf8",
    legalComments: "none",
    plugins: [header],
    ...options,
  });
  return outputFiles[0].contents;
}

const packed = (bytes) => Buffer.from(gzipSync(bytes, { level: 9, mtime: 0 })).toString("base64");
const part = (name, bytes) => `<script type="application/gzip" id="remora-${name}">${packed(bytes)}</script>\n`;

const [planner, maker, out] = process.argv.slice(2);
if (!out) {
  console.error("usage: node build.mjs PLANNER.wasm MAKER OUT.html");
  process.exit(2);
}
const decode = (bytes) => new TextDecoder().decode(bytes);
const style = decode(await bundle("style.css")).trim();
const code = part("page", await bundle("entry.js", { globalName: "remoraPage" }));
const start = `<script>${decode(await bundle("start.js")).trim()}</script>\n`;
const planning = part("worker", await bundle("worker.js")) + part("planner", readFileSync(planner));
// Functions: text would have its dollars read as patterns.
const page = read("source/page.html")
  .replace("MAKER", () => maker)
  .replace("<!--MARK-->", () => read("../files/src/report/mark.svg").trim())
  .replace("/*STYLE*/", () => style)
  .replace("LICENCE", () => read("node_modules/three/LICENSE").trim())
  .replace("<!--START-->\n", () => code + start)
  .replace("<!--PLANNER-->\n", () => planning);
writeFileSync(out, page);
console.log(`${out}: ${page.length} bytes`);
