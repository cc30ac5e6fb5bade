// A recording and a memory in the page, without a node and without a bus. Screenshots go to FOLDER.
// Usage: recorded.js CHROMIUM FOLDER
"use strict";
const fs = require("fs");
const path = require("path");
const puppeteer = require("puppeteer-core");
const { Program, node, play, view, until, check, main } = require("./processes.js");

const [chromium, folder] = process.argv.slice(2);

main(async () => {
  fs.mkdirSync(folder, { recursive: true });
  const recording = path.join(folder, "..", "run.mcap"), memory = path.join(folder, "..", "memory");
  fs.rmSync(memory, { recursive: true, force: true });

  // A run that is recorded, of a node with a memory.
  const recorder = new Program("pocd_record", ["--output", recording, "--overwrite"]);
  await recorder.says(/topics|waits|records/i);
  const component = node("--robot", "robot1", "--robot", "robot2", "--lossless", "--set", `node.memory.folder=${memory}`);
  await recorder.says(/recording \S*pocd\/object_events/); // what was written before is gone for it
  const player = play("config/sim/demo.yaml", "--lossless", "--fast");
  check((await player.ended) === 0, "the player ended in order");
  check((await component.end()) === 0, "the component ended in order");
  check((await recorder.end()) === 0, "the recorder ended in order");

  const browser = await puppeteer.launch({ executablePath: chromium, headless: true,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const errors = [];
  const open = async (address, width, height, more = {}) => {
    const page = await browser.newPage();
    await page.setViewport({ width, height, ...more });
    page.setDefaultTimeout(120000);
    page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
    page.on("pageerror", (error) => errors.push(String(error)));
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "dark" }]);
    await page.goto(address);
    return page;
  };
  const shot = async (name, of) => {
    await new Promise((resolve) => setTimeout(resolve, 900));
    await of.screenshot({ path: path.join(folder, `${name}.png`) });
  };

  // The recording: all of it, then from the start.
  const recorded = await view(recording, "--port", "0");
  const page = await open(recorded.address, 1280, 800);
  const holds = (what, condition, ...values) => until(() => page.evaluate(condition, ...values), what);
  await holds("it is read", () => window.pocd.health.status?.played?.read === 1);
  await holds("the map at its end", () => window.pocd.surface.tileCount > 20);
  await until(async () => (await page.$eval("#state", (chip) => chip.textContent)) === "recording run.mcap", "the page says what it shows");
  check(await page.$eval("#alarm", (alarm) => alarm.hidden), "nothing is wrong with it");
  const end = await page.evaluate(() => ({ tiles: window.pocd.surface.tileCount, objects: window.pocd.store.objects.size, events: [...window.pocd.panel.events.values()].map((e) => e.kind) }));
  check(end.events.includes("MOVED") && end.events.includes("REMOVED") && end.objects > 5, "objects and events are those of the run");
  await shot("recording_end", page);
  await page.keyboard.press(" ");
  await page.select("#time-speed", "2");
  await holds("it plays from the start", () => window.pocd.time.playing && window.pocd.time.at > window.pocd.time.range[0] + 6 && window.pocd.then()?.map);
  await page.keyboard.press(" ");
  await holds("the map grows with it", (tiles) => window.pocd.surface.tileCount > 0 && window.pocd.surface.tileCount < tiles, end.tiles);
  await holds("robots drive", () => window.pocd.robots.shown.size === 2 && [...window.pocd.robots.shown.values()].some((robot) => robot.trail.length > 3));
  await shot("recording_plays", page);
  await page.keyboard.press("n");
  await holds("the end is the end", (tiles) => window.pocd.surface.tileCount === tiles, end.tiles);
  const phone = await open(recorded.address, 390, 844, { isMobile: true, hasTouch: true, deviceScaleFactor: 2 });
  await until(() => phone.evaluate(() => window.pocd.surface.tileCount > 20), "a phone gets the recording");
  check(await phone.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing sticks out on a phone");
  await shot("recording_phone", phone);
  await phone.close();
  await page.close();
  check((await recorded.end()) === 0, "pocd_view ended in order");

  // The memory: the last map, and the log.
  const remembered = await view(memory, "--port", "0");
  const second = await open(remembered.address, 1280, 800);
  await until(() => second.evaluate(() => window.pocd.surface.tileCount > 20 && window.pocd.store.objects.size > 5), "the memory is shown");
  const known = await second.evaluate(() => ({ tiles: window.pocd.health.status.tiles, objects: window.pocd.store.objects.size, events: window.pocd.panel.events.size }));
  check(known.objects === end.objects, `the memory has ${known.objects} objects, the recording ${end.objects}`);
  check(known.events >= end.events.length, "the log has all events");
  await second.evaluate(() => window.pocd.time.goTo(window.pocd.time.range[0] + 0.4 * (window.pocd.time.range[1] - window.pocd.time.range[0])));
  await until(() => second.evaluate(() => window.pocd.then() && !window.pocd.then().map && !document.querySelector("#pale").hidden && window.pocd.panel.then.length > 0), "objects of then over the map of now, which is pale");
  // The list is made anew while it is looked at: a handle of its button may be of an old one.
  await second.$eval("#events button.MOVED", (button) => button.click());
  await until(() => second.evaluate(() => document.querySelector("#detail svg.curve path") !== null), "an object's past comes from the log");
  await shot("memory_then", second);
  await second.close();
  check((await remembered.end()) === 0, "pocd_view ended in order");

  // A node that goes on with it: what it has not looked at again is striped, and its log is the past.
  const again = node("--robot", "robot1", "--robot", "robot2", "--set", `node.memory.folder=${memory}`);
  const live = await view("--port", "0");
  const third = await open(live.address, 1280, 800);
  await until(() => third.evaluate(() => window.pocd.health.status?.regions_not_looked_at > 0 && window.pocd.surface.sectors.size > 0), "regions that nobody has looked at are told");
  await until(() => third.evaluate((events) => window.pocd.panel.events.size >= events, end.events.length), "the log of the node is the past");
  // Whether each vertex of what is drawn is that of what nobody has looked at.
  const striped = () => third.evaluate(() => [...window.pocd.surface.chunks.values()].flatMap((chunk) => [...chunk.shown.values()]).map(({ buffer, at, vertices }) => Array.from({ length: vertices }, (_, v) => buffer.words[6 * (at + v) + 5] & 0x100).every(Boolean)));
  await until(async () => { const chunks = await striped(); return chunks.length > 0 && chunks.every(Boolean); }, "all of the map is striped");
  await until(() => third.$eval("#alarm", (alarm) => !alarm.hidden && /nobody has looked at \d+ objects? and \d+ regions?/.test(alarm.textContent)), "the bar says so");
  await shot("not_looked_at", third);
  const looking = play("config/sim/demo.yaml", "--lossless", "--fast", "--max-frames", "200");
  check((await looking.ended) === 0, "the player ended in order");
  await until(async () => (await striped()).some((chunk) => !chunk), "what was looked at is not striped any more");
  await shot("partly_looked_at", third);
  check((await live.end()) === 0 && (await again.end()) === 0, "both ended in order");

  check(errors.filter((text) => !/ERR_CONNECTION_REFUSED|WebSocket connection/.test(text)).length === 0, `no error in the console: ${errors}`);
  await browser.close();
});
