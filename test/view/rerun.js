// A recording for Rerun in its own web viewer: cloud, grid, boxes and transforms show, in their colours. Screenshots go
// to FOLDER. Usage: rerun.js CHROMIUM FOLDER
"use strict";
const fs = require("fs");
const http = require("http");
const path = require("path");
const puppeteer = require("puppeteer-core");
const { Program, node, play, until, check, main } = require("./processes.js");

const [chromium, folder] = process.argv.slice(2);
const viewer = path.resolve("node_modules/@rerun-io/web-viewer"), recording = path.resolve("run.mcap");
const html = `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><style>body { margin: 0 }</style><body>
<script type="module">
  import { WebViewer } from "/viewer/index.js";
  const viewer = new WebViewer();
  window.rerun = { viewer, opened: null, problem: null };
  viewer.on("recording_open", (event) => { window.rerun.opened = event; });
  viewer.start(location.origin + "/run.mcap", document.body, { width: "1280px", height: "800px", hide_welcome_screen: true, render_backend: "webgl" })
    .catch((error) => { window.rerun.problem = String(error); });
</script>`;

/** The viewer's package and the recording, as a server of one's own would have them. */
function serve() {
  const types = { ".wasm": "application/wasm", ".js": "text/javascript", ".mcap": "application/octet-stream" };
  const server = http.createServer((request, response) => {
    const name = request.url.split("?")[0];
    let file = name === "/run.mcap" ? recording : path.join(viewer, path.normalize(name.replace(/^\/viewer/, "")));
    if (!fs.existsSync(file)) file += ".js";  // its modules name one another without
    if (name === "/") response.writeHead(200, { "Content-Type": "text/html" }).end(html);
    else if (!fs.existsSync(file)) response.writeHead(404).end();
    else {
      response.writeHead(200, { "Content-Type": types[path.extname(file)] ?? "text/plain", "Content-Length": fs.statSync(file).size });
      fs.createReadStream(file).pipe(response);
    }
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(`http://127.0.0.1:${server.address().port}/`)));
}

/** How many pixels of a picture are of each colour that is looked for. */
const colours = (page, base64) => page.evaluate(async (text) => {
  const image = new Image();
  image.src = `data:image/png;base64,${text}`;
  await image.decode();
  const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
  canvas.drawImage(image, 0, 0);
  // Without the bars at the top and at the bottom.
  const { data } = canvas.getImageData(0, 60, image.width, image.height - 120);
  const count = { boxes: 0, walls: 0, occupied: 0, free: 0, one: 0 };
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = data.subarray(i, i + 3);
    count.boxes += g > 195 && r < 0.5 * g && b < 0.5 * g;                       // E[v] near 1; surfaces are darker
    count.walls += Math.abs(r - g) < 6 && Math.abs(g - b) < 6 && r > 90 && r < 190;  // grey
    count.occupied += r < 20 && g < 20 && b < 20;                               // the grid's
    count.free += r > 250 && g > 250 && b > 250;
    count.one += r > 120 && g > 110 && b < 90 && Math.abs(r - g) < 30;          // its colour for what has none
  }
  return count;
}, base64);

main(async () => {
  fs.mkdirSync(folder, { recursive: true });
  const recorder = new Program("pocd_record", ["--output", recording, "--overwrite", "--rerun", "--topic", "/pocd/*", "--topic", "/tf*", "--topic", "/*/odom", "--topic", "/*/depth/camera_info"]);
  await recorder.says(/recording on domain/);
  const component = node("--lossless", "--set", "node.outputs.markers_hz=5", "--set", "node.outputs.occupancy_whole_s=0.5");
  await recorder.says(/recording \S*objects\/markers/); // what was written before is gone for it
  const player = play("test/integration/data/two_drives.yaml", "--lossless", "--speed", "4");
  check((await player.ended) === 0, "the player ended in order");
  check((await component.end()) === 0, "the component ended in order");
  check((await recorder.end()) === 0, "the recorder ended in order");

  const browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 300000,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage"] });
  const page = await browser.newPage();
  const complaints = [];
  page.on("console", (message) => { if (["warn", "warning", "error"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.setViewport({ width: 1280, height: 800 });
  page.setDefaultTimeout(300000);
  await page.goto(await serve());
  await until(() => page.evaluate(() => window.rerun?.opened || window.rerun?.problem), "Rerun opens the recording", 300000);
  check(await page.evaluate(() => window.rerun.problem) === null, "Rerun reads it");
  // It has read all when the range does not grow any more.
  const range = () => page.evaluate(() => {
    const { viewer } = window.rerun, id = viewer.get_active_recording_id(), line = viewer.get_active_timeline(id);
    return line && viewer.get_time_range(id, line);
  });
  let last = null;
  await until(async () => {
    const now = await range(), same = now && last && now.max === last.max && now.max > now.min;
    last = now;
    await new Promise((resolve) => setTimeout(resolve, 2000));
    return same;
  }, "all of it is read");
  const look = async (share, name) => {
    await page.evaluate((part) => {
      const { viewer } = window.rerun, id = viewer.get_active_recording_id(), line = viewer.get_active_timeline(id);
      const { min, max } = viewer.get_time_range(id, line);
      viewer.set_playing(id, false);
      viewer.set_current_time(id, line, min + part * (max - min));
      for (const panel of ["blueprint", "selection"]) viewer.override_panel_state(panel, "hidden");
      viewer.override_panel_state("time", "collapsed");
    }, share);
    let found = null;
    // The camera glides to what there is; drawn by the processor that takes a while.
    for (let i = 0, before = ""; i < 30; ++i) {
      await new Promise((resolve) => setTimeout(resolve, 1500));
      found = await page.screenshot({ encoding: "base64" });
      if (found === before) break;
      before = found;
    }
    fs.writeFileSync(path.join(folder, `${name}.png`), Buffer.from(found, "base64"));
    return colours(page, found);
  };
  const end = await look(0.97, "rerun_end");
  console.log(`pixels: ${JSON.stringify(end)}`);
  check(end.occupied > 200 && end.free > 200, "the grid shows");
  check(end.walls > 500, "the cloud shows in its colours");
  check(end.one < 50, "nothing has Rerun's colour for what has none");
  check(end.boxes > 200, "boxes show, green for what stays");
  const start = await look(0.0, "rerun_start");
  check(start.boxes === 0 && start.walls < end.walls, "at the start there are none");
  const unexpected = complaints.filter((text) => !/GL Driver Message|rasterizer|not implemented in web backend|GPU stall/i.test(text));
  check(unexpected.length === 0, `Rerun does not complain: ${unexpected.join("\n")}`);
  await browser.close();
});
