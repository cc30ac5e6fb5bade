// The page in a browser, while the component runs, is killed and starts again. Screenshots go to FOLDER.
// Usage: page.js CHROMIUM FOLDER
"use strict";
const fs = require("fs");
const path = require("path");
const puppeteer = require("puppeteer-core");
const { checkBuffers } = require("./buffers.js");
const { node, play, view, until, check, main } = require("./processes.js");

const [chromium, folder] = process.argv.slice(2);

main(async () => {
  fs.mkdirSync(folder, { recursive: true });
  const server = await view("--port", "0");
  const port = new URL(server.address).port;
  const browser = await puppeteer.launch({ executablePath: chromium, headless: true,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const errors = [];
  const elsewhere = [];
  const open = async (width, height, more = {}) => {
    const page = await browser.newPage();
    await page.setViewport({ width, height, ...more });
    page.setDefaultTimeout(120000);
    page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("request", (request) => { if (!request.url().startsWith(server.address) && !/^(data|blob):/.test(request.url())) elsewhere.push(request.url()); });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "dark" }]);
    await page.evaluateOnNewDocument(() => {  // when the bars were taken away, and when they came
      new MutationObserver(() => {
        if (document.documentElement.classList.contains("starting")) window.started ??= performance.now();
        else if (window.started) window.barsAt ??= performance.now();
      }).observe(document, { attributes: true, subtree: true, attributeFilter: ["class"] });
    });
    await page.goto(server.address);
    return page;
  };
  const page = await open(1280, 800);
  const state = () => page.$eval("#state", (chip) => chip.textContent);
  const shot = async (name, of = page) => {
    await new Promise((resolve) => setTimeout(resolve, 900));  // a flight of the camera ends
    await of.screenshot({ path: path.join(folder, `${name}.png`) });
  };
  const holds = (what, condition, ...values) => until(() => page.evaluate(condition, ...values), what);
  /** The share of the picture of the map that differs between two of them: of pixels by more than a person overlooks. */
  const picture = async () => {
    await new Promise((resolve) => setTimeout(resolve, 900));
    return (await page.$("#stage")).screenshot({ encoding: "base64" });
  };
  const difference = (...pictures) => page.evaluate(async (pair) => {
    const [a, b] = await Promise.all(pair.map(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
      canvas.drawImage(image, 0, 0);
      return canvas.getImageData(0, 0, image.width, image.height).data;
    }));
    let differ = 0;
    for (let i = 0; i < a.length; i += 4) differ += [0, 1, 2].some((k) => Math.abs(a[i + k] - b[i + k]) > 24);
    return a.length === b.length ? differ / (a.length / 4) : 1;
  }, pictures);

  await until(async () => (await state()) === "no map yet", "a page without a map says so");
  await holds("without a map the bars are there, too", () => ["#bar", "#panel", "#time"].every((bar) => getComputedStyle(document.querySelector(bar)).visibility === "visible"));
  await shot("waiting");

  const buffers = await page.evaluate(checkBuffers);
  check(buffers.wrong.length === 0, `what is drawn is what was put: ${buffers.wrong}`);
  check(buffers.drawn === 1500 * 1500, `all is drawn in the end: ${buffers.drawn} triangles`);
  // 4 MB, and the buffer that goes beyond: of 32768 vertices at most, and what belongs to them.
  check(buffers.frames > 5 && buffers.most < 6 << 20, `a frame hands over a bounded piece: ${buffers.most} bytes at most, in ${buffers.frames} frames`);

  // A run: two robots, things that move, go and come.
  let component = node("--robot", "robot1", "--robot", "robot2", "--lossless");
  const player = play("config/sim/demo.yaml", "--lossless", "--fast");
  await holds("tiles appear", () => window.pocd.surface.tileCount > 20);
  await holds("objects appear", () => window.pocd.store.objects.size > 0);
  await holds("robots appear", () => window.pocd.robots.robots.size === 2);
  await until(async () => /in step/.test(await state()), "the page is in step");
  await shot("live");
  check((await player.ended) === 0, "the player ended in order");
  await holds("a MOVED event comes", () => [...window.pocd.panel.events.values()].some((e) => e.kind === "MOVED"));
  await holds("everything is drawn", () => window.pocd.health.status.in_step && !window.pocd.health.status.drawing);
  const moved = await page.evaluate(() => {
    const event = [...window.pocd.panel.events.values()].filter((e) => e.kind === "MOVED").at(-1);
    const object = window.pocd.store.find(event.id);
    return { id: event.id, stamp: event.stamp, from: event.previous, to: event.box, now: object.box };
  });
  check(Math.hypot(moved.now[0] - moved.from[0], moved.now[1] - moved.from[1]) > 0.3, "an object that moves moves");
  const counts = await page.evaluate(() => ({ objects: window.pocd.store.objects.size, says: Number(document.querySelector("#count-objects").textContent), tiles: window.pocd.surface.tileCount, status: window.pocd.health.status.tiles }));
  check(counts.objects === counts.says, "the page counts its objects");
  await page.keyboard.press("Home");
  await shot("after_the_run");

  // The list filters by kind, class, time and place.
  const listed = () => page.$$eval("#events button", (rows) => rows.map((row) => row.className.split(" ")[0]));
  const all = await listed();
  check(["ADDED", "MOVED", "REMOVED"].every((kind) => all.includes(kind)), `the list has ${all}`);
  await page.click(".kind.added");
  await holds("a kind is left out", () => document.querySelectorAll("#events button.ADDED").length === 0 && document.querySelectorAll("#events button.MOVED").length > 0);
  await page.click(".kind.added");
  const one = await page.$eval("#filter-class", (select) => select.options[1].value);
  await page.select("#filter-class", one);
  await holds("only one class is listed", (name) => [...document.querySelectorAll("#events button")].length > 0 && [...document.querySelectorAll("#events button")].every((row) => window.pocd.panel.events.get(Number(row.dataset.event)).class === name), one);
  await page.select("#filter-class", "");
  await page.select("#filter-time", "since");
  await holds("only what came since the marker is listed", () => [...document.querySelectorAll("#events button")].length > 0 && [...document.querySelectorAll("#events button")].every((row) => window.pocd.panel.events.get(Number(row.dataset.event)).stamp >= window.pocd.time.sinceStamp()));
  await page.select("#filter-time", "all");
  await holds("all are listed again", (count) => document.querySelectorAll("#events button").length === count, all.length);
  await page.click("#filter-place");
  await holds("in view are all of them", (count) => document.querySelectorAll("#events button").length === count, all.length);
  await page.evaluate((box) => window.pocd.stage.look(box.slice(0, 3), 1.5), moved.to);
  await holds("in view are fewer from near", (count) => { const rows = document.querySelectorAll("#events button").length; return rows > 0 && rows < count; }, all.length);
  await page.click("#filter-place");
  await page.keyboard.press("Home");

  // Follow, and measure.
  await page.keyboard.press("f");
  await holds("it follows a robot", () => document.querySelector("#tool-follow").getAttribute("aria-pressed") === "true" && /Following robot/.test(document.querySelector("#hint").textContent));
  await shot("following");
  await page.keyboard.press("Escape");
  await page.keyboard.press("Home");
  await page.keyboard.press("t");
  await holds("the camera is above", () => window.pocd.stage.top && !window.pocd.stage.flight);
  await page.keyboard.press("m");
  // Two places where there is a surface, far apart.
  const ends = await page.evaluate(() => {
    const { stage, surface } = window.pocd, rect = document.querySelector("#canvas").getBoundingClientRect(), hits = [];
    for (let i = 2; i < 38; ++i) {
      for (let k = 2; k < 30; ++k) {
        const x = rect.left + rect.width * i / 40, y = rect.top + rect.height * k / 32, point = surface.hit(stage.rayAt(x, y).raycaster);
        if (point && document.elementFromPoint(x, y).id === "canvas") hits.push({ x, y, at: point.toArray() });
      }
    }
    return [hits[0], hits.at(-1)];
  });
  for (const { x, y } of ends) await page.mouse.click(x, y);
  const across = Math.hypot(ends[0].at[0] - ends[1].at[0], ends[0].at[1] - ends[1].at[1]);
  check(across > 3, `two surfaces are ${across} m apart`);
  await holds("a length is measured", (length) => [...document.querySelectorAll("#labels .measure")].some((label) => { const level = /level ([0-9.]+) m/.exec(label.textContent); return level && Math.abs(Number(level[1]) - length) < 0.1; }), across);
  await shot("measured");
  await page.keyboard.press("m");
  await page.keyboard.press("t");
  await page.keyboard.press("Home");

  // A list entry leads there, and says why.
  await page.click("#events button.MOVED");
  await holds("the selected object's past comes", () => document.querySelector("#detail svg.curve path") !== null);
  const why = await page.$eval("#detail", (detail) => detail.textContent);
  check(/Measured change/.test(why) && /E\[v\]: 0\.\d+ before/.test(why), "the evidence is told in words and numbers");
  await shot("moved_object");
  const link = await page.evaluate(async () => {
    await window.pocd.actions.link();
    return location.href;
  });
  check(/sel=[0-9a-f]{32}/.test(link), "the address holds the selection");
  const linked = await browser.newPage();
  linked.setDefaultTimeout(120000);
  await linked.goto(link);
  await until(() => linked.evaluate(() => window.pocd?.panel.selected), "a link restores the selection");
  const cameras = await Promise.all([page, linked].map((one) => one.evaluate(() => window.pocd.stage.camera.position.toArray())));
  check(cameras[0].every((v, i) => Math.abs(v - cameras[1][i]) < 0.02), "a link restores the camera");
  await linked.close();

  // A click on a box in the picture selects it.
  await page.keyboard.press("Escape");
  await page.keyboard.press("t");
  await page.keyboard.press("Home");
  await holds("the camera has arrived", () => window.pocd.stage.top && !window.pocd.stage.flight);
  const target = await page.evaluate(() => {
    const rect = document.querySelector("#canvas").getBoundingClientRect();
    const places = [...window.pocd.store.objects.values()].map(({ id, box }) => ({ id, p: window.pocd.stage.project([box[0], box[1], box[2] + box[6] / 2]) }));
    const { id, p } = places.find((place) => place.p?.inside);
    return { id, x: rect.left + p.x, y: rect.top + p.y };
  });
  await page.mouse.click(target.x, target.y);
  await holds("a click on a box selects it", (id) => window.pocd.panel.selected === id, target.id);
  await shot("top_view");
  await page.keyboard.press("Escape");
  await page.keyboard.press("t");

  // The past.
  await page.keyboard.press("Home");
  const asNow = await picture();
  const early = await page.evaluate(() => {
    const [first, last] = window.pocd.time.range;
    window.pocd.time.goTo(first + 0.2 * (last - first));
    return window.pocd.time.at;
  });
  await holds("the time line goes back", (at) => document.querySelector("#time-live").getAttribute("aria-pressed") === "false" && window.pocd.time.at === at, early);
  await holds("fewer objects then than now", () => {
    const shown = window.pocd.shown();
    return shown.then && shown.count > 0 && shown.count < window.pocd.store.objects.size + 3;
  });
  await holds("the map of then, which is smaller", (now) => window.pocd.then()?.map && document.querySelector("#pale").hidden && window.pocd.surface.tileCount < now && window.pocd.surface.tileCount > 0, counts.tiles);
  await holds("the robots of then", () => window.pocd.robots.shown.size > 0 && [...window.pocd.robots.shown.values()].every((r) => r.stamp <= window.pocd.time.at));
  await shot("then");
  const asThen = await difference(asNow, await picture());
  check(asThen > 0.02, `then looks different: ${asThen}`);
  const spoken = await page.evaluate(() => window.pocd.panel.then.length);
  check(spoken === await page.evaluate(() => window.pocd.shown().count), "the list has the objects of then");
  await page.keyboard.press("b");
  await page.keyboard.press("Home");
  await page.keyboard.press("n");
  await holds("all tiles are back", (now) => window.pocd.surface.tileCount === now, counts.tiles);
  await holds("the left half has the map of before", (id) => window.pocd.other()?.surface.tileCount > 0 && window.pocd.before()?.map && window.pocd.before().objects.some((object) => object.id === id), moved.id);
  const places = await page.evaluate((id) => [window.pocd.before().objects.find((object) => object.id === id).box, window.pocd.store.find(id).box], moved.id);
  check(Math.hypot(places[0][0] - places[1][0], places[0][1] - places[1][1]) > 0.3, "before and after differ");
  await shot("before_and_after");
  await page.keyboard.press("b");
  await page.keyboard.press("Home");
  await holds("now is shown", () => !window.pocd.then() && !window.pocd.other());
  const asBefore = await difference(asNow, await picture());
  check(asBefore < 0.01, `now looks as it did before going back: ${asBefore}`);

  // Playing.
  await page.evaluate(() => window.pocd.time.goTo(window.pocd.time.range[0] + 5));
  await page.select("#time-speed", "5");
  await page.keyboard.press(" ");
  await holds("it plays", () => window.pocd.time.at > window.pocd.time.range[0] + 8);
  await page.keyboard.press(" ");
  const paused = await page.evaluate(() => [window.pocd.time.playing, window.pocd.time.at]);
  check(!paused[0] && paused[1] !== null, "it pauses");
  await page.keyboard.press("n");
  await holds("all tiles are back after playing", (now) => window.pocd.surface.tileCount === now && window.pocd.surface.changed.size === 0, counts.tiles);
  const asPlayed = await difference(asNow, await picture());
  check(asPlayed < 0.01, `now looks as it did before playing: ${asPlayed}`);

  await page.keyboard.press("d");
  await shot("light");
  await page.keyboard.press("?");
  await shot("help");
  await page.keyboard.press("Escape");
  await page.keyboard.press("d");

  const phone = await open(390, 844, { isMobile: true, hasTouch: true, deviceScaleFactor: 2 });
  await until(() => phone.evaluate(() => window.pocd.surface.tileCount > 20 && window.pocd.times.first !== null), "a phone gets the map");
  const start = await phone.evaluate(() => ({ ...window.pocd.times, hidden: window.started, shown: window.barsAt, bar: getComputedStyle(document.querySelector("#bar")).visibility }));
  check(start.bar === "visible" && start.hidden < start.first && (start.shown >= start.first || start.shown - start.hidden > 950), `the bars come with the first picture: ${JSON.stringify(start)}`);
  check(start.firstTriangles > 0, "the first picture has some of the map");
  check(await phone.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing sticks out on a phone");
  await shot("phone", phone);
  await phone.close();

  // The component is killed: the page says so, and why; a new run leaves open what it has not seen.
  const objects = await page.evaluate(() => window.pocd.store.objects.size);
  await component.end("SIGKILL");
  await until(async () => (await state()) === "stale", "stale shows when the node is killed");
  check(await page.$eval("#alarm", (alarm) => !alarm.hidden && /Stale: because the publisher has gone/.test(alarm.textContent)), "the bar says what is wrong");
  await shot("stale");
  component = node("--robot", "robot1", "--robot", "robot2", "--lossless");
  const again = play("config/sim/demo.yaml", "--lossless", "--fast", "--max-frames", "80");
  check((await again.ended) === 0, "the player ended in order again");
  await holds("what nobody has looked at since the restart", () => window.pocd.health.status.earlier_tiles > 0 && window.pocd.health.status.unknown_objects > 0);
  check(objects > 0 && await page.$eval("#alarm", (alarm) => /Since the restart/.test(alarm.textContent)), "the bar says what is not known");
  await page.keyboard.press("Home");
  await shot("restarted");
  await component.end();

  // The server goes and comes: the page finds it by itself.
  await server.end();
  await until(async () => (await state()) === "no connection", "no connection is said");
  const second = await view("--port", port);
  await until(async () => (await state()) !== "no connection", "the page connects again by itself");
  await second.end();
  check(elsewhere.length === 0, `nothing is fetched from elsewhere: ${elsewhere}`);
  const unexpected = errors.filter((text) => !/ERR_CONNECTION_REFUSED|WebSocket connection/.test(text));
  check(unexpected.length === 0, `no error in the console: ${unexpected}`);
  await browser.close();
});
