// What clients of pocd_view cost: connects CLIENTS clients of the page's protocol at once and says how long each
// takes to the first surface and to the whole map, the bytes that it gets, and the CPU of the server, as rows of a table.
// Usage: costs.js PORT PID_OF_SERVER CLIENTS SECONDS_AFTER
//        costs.js PORT --until-drawn     ends when the server has drawn all of the map
"use strict";
const fs = require("fs");
const zlib = require("zlib");
const { WebSocket } = require("ws");

const [port, pid, clients, seconds] = process.argv.slice(2).map(Number);
const kFine = 400;      // chunks that a page wants finely
const kQuiet_ms = 2000; // without a surface: the map is there

/** CPU of the server [s]. */
function cpu() {
  const fields = fs.readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ");
  return (Number(fields[11]) + Number(fields[12])) / 100;
}

/** As the page does: uses a message, then acknowledges it; wants the chunks that it has heard of. */
class Client {
  constructor() {
    this.start = Date.now();
    this.bytes = this.surfaces = this.tiles = 0;
    this.status = null;
    this.first = this.last = null;
    this.chunks = new Map();
    this.wanted = "";
    this.socket = new WebSocket(`ws://127.0.0.1:${port}/live`, ["pocd.view.v1"]);
    this.socket.on("message", (data) => this.use(data));
    this.socket.on("close", () => {
      console.error("pocd_view has ended the connection");
      process.exit(1);
    });
    this.wishing = setInterval(() => this.wish(), 250);
  }
  use(data) {
    this.bytes += data.length;
    const plain = zlib.inflateRawSync(data.subarray(4));
    for (let at = 0; at + 24 <= plain.length;) {
      const kind = plain.readUInt32LE(at), size = plain.readUInt32LE(at + 4);
      if (kind === 1) {
        const json = JSON.parse(plain.toString("utf8", at + 24, at + 24 + size));
        if (json.type === "status") this.status = json;
      }
      if (kind === 2 || kind === 3) {
        ++this.surfaces;
        this.tiles += kind === 2;
        this.last = Date.now();
        this.first ??= this.last;
        if (kind === 3) {
          const key = [8, 12, 16].map((offset) => plain.readInt32LE(at + offset));
          this.chunks.set(key.join(), key);
        }
      }
      at += 24 + size;
    }
    this.socket.send(JSON.stringify({ ack: data.readUInt32LE(0) }));
  }
  wish() {
    const list = [...this.chunks.values()].sort((a, b) => Math.hypot(...a) - Math.hypot(...b)).slice(0, kFine);
    const text = JSON.stringify({ want: list });
    if (this.socket.readyState === WebSocket.OPEN && text !== this.wanted) this.socket.send(this.wanted = text);
  }
}

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const range = (list, digits) => {
  const sorted = [...list].sort((a, b) => a - b).map((value) => value.toFixed(digits));
  return sorted[0] === sorted.at(-1) ? sorted[0] : `${sorted[0]} to ${sorted.at(-1)}`;
};

(async () => {
  if (process.argv[3] === "--until-drawn") {
    const one = new Client();
    const done = ({ in_step, drawing, tiles, drawn }) => in_step && !drawing && tiles > 0 && drawn >= tiles;
    while (!(one.status && done(one.status))) await wait(50);
    process.exit(0);
  }
  const before = cpu();
  const all = Array.from({ length: clients }, () => new Client());
  while (!all.every((one) => one.last && Date.now() - one.last > kQuiet_ms)) await wait(50);
  const loaded = cpu();
  const row = (name, value) => console.log(`| ${name} | ${value} |`);
  row("a client gets", `${range(all.map((one) => one.bytes / 1e6), 1)} MB: the coarse surface of ${range(all.map((one) => one.chunks.size), 0)} chunks, and ${range(all.map((one) => one.tiles), 0)} fine tiles near the camera`);
  row(`\`pocd_view\` spends on all ${clients}`, `${(loaded - before).toFixed(1)} s of CPU: what is sent has been drawn and compressed before`);
  row("from connecting to the first surface; to all of them", `${range(all.map((one) => (one.first - one.start) / 1000), 2)} s; ${range(all.map((one) => (one.last - one.start) / 1000), 1)} s`);
  const bytes = all.map((one) => one.bytes);
  await wait(1000 * seconds);
  row("then, while nothing changes", `${range(all.map((one, i) => (one.bytes - bytes[i]) / 1e3 / seconds), 2)} KB/s each, ${(100 * (cpu() - loaded) / seconds).toFixed(1)} % of a processor for all of them`);
  process.exit(0);
})();
