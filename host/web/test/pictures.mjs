// Pictures of the page for the README. Usage: node pictures.mjs FOLDER

import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { Browser } from "./browser.mjs";
import { Bench } from "./program.mjs";

/** When the arm reaches out over the target. */
const TIME = 1010;

const [folder] = process.argv.slice(2);
const bench = new Bench();
const browser = Browser.start();
bench.run("plan --out pub-000.plan.json");
bench.run("view pub-000.plan.json");
for (const theme of ["light", "dark"]) {
  const tab = await browser.open(`file://${bench.path("pub-000.html")}`, {
    width: 1280,
    height: 800,
    scale: 1.5,
    dark: theme === "dark",
  });
  await tab.until("window.remora && performance.getEntriesByName('picture')[0]");
  await tab.evaluate(`remora.page.clock.seek(${TIME})`);
  await new Promise((resolve) => setTimeout(resolve, 500));
  writeFileSync(join(folder, `page-${theme}.webp`), await tab.picture());
}
await browser.close();
bench.clear();
