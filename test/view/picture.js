// Takes the README's first picture, docs/images/view.png: the demonstration in its third lap. By hand, no test:
// test/view/run.sh install/bin output/picture picture.js && cp output/picture/pictures/view.png docs/images/
// Usage: picture.js CHROMIUM FOLDER
"use strict";
const fs = require("fs");
const path = require("path");
const puppeteer = require("puppeteer-core");
const { node, play, view, until, check, main } = require("./processes.js");

const [chromium, folder] = process.argv.slice(2);
const kAt = 33.5;                           // seconds of the demonstration
const kEye = [-4.6, -5.6, 5.6], kTarget = [0.4, 0.9, 0.1];

main(async () => {
  fs.mkdirSync(folder, { recursive: true });
  const server = await view("--port", "0");
  const component = node("--robot", "robot1", "--robot", "robot2", "--lossless");
  const browser = await puppeteer.launch({ executablePath: chromium, headless: true,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const page = await browser.newPage();
  await page.setViewport({ width: 1280, height: 800 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "dark" }]);
  await page.goto(server.address);
  check((await play("config/sim/demo.yaml", "--lossless", "--fast").ended) === 0, "the player ended in order");
  await until(() => page.evaluate((at) => { const { health, time } = window.pocd; return health.status?.in_step && !health.status.drawing && time.range?.[1] > at; }, kAt), "all of it is there");
  await page.evaluate(async (at, eye, target) => {
    const { stage, time, panel, select } = window.pocd;
    const moved = [...panel.events.values()].filter((event) => event.kind === "MOVED").at(-1);
    stage.renderer.setPixelRatio(2);  // smooth edges, as a graphics card draws them
    stage.renderer.setSize(stage.width, stage.height, false);
    time.goTo(at);
    select(moved.id);
    stage.touched = true;
    stage.flight = null;
    stage.camera.position.fromArray(eye);
    stage.controls.target.fromArray(target);
    stage.controls.update();
  }, kAt, kEye, kTarget);
  await until(() => page.evaluate(() => window.pocd.then()?.map && document.querySelector("#detail svg.curve path") && window.pocd.surface.tileCount > 20 && window.pocd.surface.changed.size === 0), "the third lap is shown");
  await new Promise((resolve) => setTimeout(resolve, 3000));  // the last frame
  await page.screenshot({ path: path.join(folder, "view.png") });
  await browser.close();
  check((await component.end()) === 0 && (await server.end()) === 0, "both ended in order");
});
