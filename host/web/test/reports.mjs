// Reports in Chromium, on a phone, a laptop and a wide screen, light and dark: flights, campaign, audit.

import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { Browser } from "./browser.mjs";
import { unreadable } from "./looks.mjs";
import { Bench } from "./program.mjs";

const WIDTHS = [400, 1300, 1900];
let bench;
let browser;

/** A campaign of which one scenario is refused and one has no plan, for it starts far away. */
function campaign() {
  bench.run("draw --count 8 --seed 3 --out s.scenarios.json --quiet");
  const set = bench.json("s.scenarios.json");
  set.scenarios[1].servicer.position = [0.3, 0.4, 0.2];
  set.scenarios[2].servicer.position = set.scenarios[2].servicer.position.map((x) => 40 * x);
  writeFileSync(bench.path("some.scenarios.json"), JSON.stringify(set));
  assert.throws(
    () => bench.run("campaign --scenarios some.scenarios.json --integrator euler --write report --quiet --out runs"),
    ({ status }) => status === 1,
  );
}

before(() => {
  bench = new Bench();
  campaign();
  bench.run("fly --errors typical --runs 4 --keep worst=1 --quiet --out flown");
  browser = Browser.start();
});

after(async () => {
  await browser.close();
  bench.clear();
});

async function opened(file, width, dark) {
  const tab = await browser.open(`file://${file}`, { width, height: 900, dark });
  await tab.until("document.readyState === 'complete'");
  return tab;
}

const reports = { campaign: "runs/report.html", flights: "flown/flights.html", audit: process.env.REMORA_AUDIT };
for (const [name, file] of Object.entries(reports)) {
  test(`${name}: nothing overflows, breaks or is faint`, { skip: !file && "REMORA_AUDIT names no page" }, async () => {
    for (const width of WIDTHS) {
      for (const dark of [false, true]) {
        const tab = await opened(file.startsWith("/") ? file : bench.path(file), width, dark);
        assert.deepEqual([...(await unreadable(tab)), ...tab.faults], [], `${width} px, ${dark ? "dark" : "light"}`);
        const [back] = await tab.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/)");
        assert.equal(Number(back) < 128, dark);
      }
    }
  });
}

test("the campaign's failures have a map, reasons and links that lead somewhere", async () => {
  const tab = await opened(bench.path("runs/report.html"), 1300, false);
  const text = await tab.evaluate("document.body.textContent");
  const parts = ["6 of 8 plans are verified, 6 of them optimal", "not flyable: 1", "refused before planning: 1"];
  for (const part of [...parts, "keep_out"]) {
    assert.ok(text.includes(part), part);
  }
  const links = await tab.evaluate("[...document.querySelectorAll('a')].map((link) => link.getAttribute('href'))");
  assert.ok(links.includes("pages/s3-002.html"), links.join(" "));
  for (const link of links) {
    assert.ok(bench.has(`runs/${link}`), link);
  }
});
