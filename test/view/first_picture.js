// Opens the page and says when its first picture of the map and the whole map were there.
// Usage: first_picture.js CHROMIUM ADDRESS PICTURE.png
"use strict";
const puppeteer = require("puppeteer-core");
const [chromium, address, picture] = process.argv.slice(2);

(async () => {
  const browser = await puppeteer.launch({ executablePath: chromium, headless: true,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 800 });
  page.setDefaultTimeout(120000);
  await page.goto(address);
  await page.waitForFunction(() => window.pocd?.times.first, { timeout: 120000 });
  let bytes = -1;
  for (let now; (now = await page.evaluate(() => window.pocd.connection.bytes)) !== bytes || now === 0;) {
    bytes = now;
    await new Promise((resolve) => setTimeout(resolve, 2500));
    // A status comes every second.
    if (await page.evaluate(() => performance.now() - window.pocd.times.last > 2000)) break;
  }
  const { times, tiles, chunks, triangles } = await page.evaluate(() => ({ times: window.pocd.times, tiles: window.pocd.surface.tileCount, chunks: window.pocd.surface.chunks.size, triangles: window.pocd.surface.triangles }));
  console.log(`page in Chromium, drawn by the processor: first picture after ${(times.first / 1000).toFixed(2)} s, the last surface after ${(times.last / 1000).toFixed(1)} s; ${chunks} chunks, ${tiles} fine tiles, ${triangles} triangles`);
  await page.screenshot({ path: picture });
  await browser.close();
})();
