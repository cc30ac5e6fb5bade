// Opens the page in a browser that draws by the processor, several times, and says when the first picture of the map was there and
// when all of the map: from the beginning of the page's load to the end of drawing, as a fence of the graphics says. The first picture has the
// boxes of all objects and the first surfaces. Rows of a table.
// Usage: first_picture.js CHROMIUM ADDRESS PICTURE.png [TIMES]
"use strict";
const fs = require("fs");
const puppeteer = require("puppeteer-core");
const [chromium, address, picture, times = "5"] = process.argv.slice(2);
const kQuiet = 3000;  // without a new surface: all of the map is there [ms]

/** CPU of the browser's processes, which are a session of their own [s]. */
function cpu(session) {
  let ticks = 0;
  for (const pid of fs.readdirSync("/proc").filter((name) => /^[0-9]+$/.test(name))) {
    try {
      const fields = fs.readFileSync(`/proc/${pid}/stat`, "utf8").split(") ").at(-1).split(" ");
      if (Number(fields[3]) === session) ticks += Number(fields[11]) + Number(fields[12]);
    } catch { /* it has ended */ }
  }
  return ticks / 100;
}

async function open() {
  const browser = await puppeteer.launch({ executablePath: chromium, headless: true,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 800 });
  const before = cpu(browser.process().pid);
  await page.goto(address);
  await page.waitForFunction((quiet) => window.pocd?.times.whole && performance.now() - Math.max(window.pocd.times.last, window.pocd.times.whole) > quiet, { timeout: 120000 }, kQuiet);
  const spent = cpu(browser.process().pid) - before;
  const seen = await page.evaluate(() => ({ ...window.pocd.times, objects: window.pocd.store.objects.size, chunks: window.pocd.surface.chunks.size, tiles: window.pocd.surface.tileCount, triangles: window.pocd.surface.triangles, software: window.pocd.stage.software, bytes: window.pocd.connection.bytes }));
  await page.screenshot({ path: picture });
  await browser.close();
  if (!seen.software) throw new Error("a graphics card draws: this is to be measured without");
  return { ...seen, spent };
}

(async () => {
  const all = [];
  for (let i = 0; i < Number(times); ++i) all.push(await open());
  const range = (values, digits) => {
    const sorted = [...values].sort((a, b) => a - b), text = sorted.map((value) => value.toFixed(digits));
    return text[0] === text.at(-1) ? text[0] : `${sorted[Math.floor(sorted.length / 2)].toFixed(digits)} (${text[0]} to ${text.at(-1)})`;
  };
  const { objects, chunks, tiles, triangles, bytes } = all.at(-1);
  const row = (name, value) => console.log(`| ${name} | ${value} |`);
  row(`a page in Chromium that draws without a graphics card, ${all.length} times: first picture`, `${range(all.map((one) => one.first / 1000), 1)} s, with ${range(all.map((one) => one.firstTriangles), 0)} triangles of the map`);
  row("all of the map", `${range(all.map((one) => one.whole / 1000), 1)} s: ${objects} objects, ${chunks} chunks, ${tiles} fine tiles, ${triangles} triangles, ${(bytes / 1e6).toFixed(1)} MB`);
  row("CPU of the browser for that", `${range(all.map((one) => one.spent), 1)} s`);
})();
