// How the map, the node and the robots are: chips in the bar, and a line that says what is wrong.
import { escaped } from "./words.js";

const $ = (id) => document.getElementById(id);
const kCatchingUp = 2500;  // a copy that is a step behind for less is not stale [ms]

export class Health {
  constructor() {
    this.link = "closed";
    this.unknown = 0;  // objects that are drawn so
    this.clear();
    $("state").addEventListener("click", () => { $("alarm").hidden = !$("alarm").hidden; });
  }

  clear() {
    this.status = null;
    this.behind = null;
    this.nodes = new Map();
    this.show();
  }

  useStatus(status) {
    this.status = status;
    const behind = !status.in_step && status.publisher_present && status.stale_because.startsWith("at version");
    this.behind = behind ? this.behind ?? performance.now() : null;
    this.show();
  }

  useNode(node) {
    this.nodes.set(node.node, node);
    this.show();
  }

  setLink(link) {
    this.link = link;
    this.show();
  }

  /** [level, words, reason]: what a person has to know of the picture. */
  verdict() {
    if (this.link === "closed") return ["bad", "no connection", "this page has lost pocd_view and tries to reach it again; what you see is the last that came"];
    if (this.link === "silent") return ["bad", "stale", "pocd_view is silent; what you see is the last that came"];
    if (!this.status) return ["warn", "connecting", ""];
    const status = this.status;
    if (status.played) {
      const { kind, name, read, problem } = status.played;
      if (problem) return ["warn", `${kind}, damaged`, ""];
      return read < 1 ? ["warn", `reading ${Math.floor(100 * read)} %`, ""] : ["good", `${kind} ${name}`, ""];
    }
    if (!status.publisher_seen) return ["warn", "no map yet", "no publisher of this map was heard of; is pocd_node running on this domain?"];
    if (this.behind !== null && performance.now() - this.behind < kCatchingUp) return ["good", "in step", ""];
    if (!status.in_step) return ["bad", "stale", status.stale_because];
    return status.ended ? ["warn", "run ended, final map", ""] : ["good", "in step", ""];
  }

  show() {
    const [level, words, reason] = this.verdict();
    const chip = $("state");
    chip.className = `chip ${level}`;
    chip.textContent = words;
    chip.title = this.status ? `map version ${this.status.version}, ${this.status.tiles} tiles, epoch ${this.status.epoch}` : "";
    const alarms = [];
    if (level === "bad" || (words === "no map yet")) alarms.push(`<b>${escaped(words === "no map yet" ? "No map yet" : words === "stale" ? "Stale" : "No connection")}</b>: because ${escaped(reason)}.`);
    const nodes = [];
    let robots = [];
    for (const node of this.nodes.values()) {
      if (node.condition === "ended") continue;
      const bad = node.condition === "silent" || node.level >= 2;
      const why = node.condition === "silent" ? "has said nothing for more than 2.5 s" : node.message;
      nodes.push(`<span class="chip ${bad ? "bad" : node.level === 1 ? "warn" : "good"}" title="${escaped(`${node.name}: ${why}; ${node.frames_processed} frames, ${node.processing_ms.toFixed(1)} ms each`)}">${escaped(node.name)}</span>`);
      if (bad) alarms.push(`<b>${escaped(node.name)}</b>: ${escaped(why)}.`);
      if (node.condition === "present") {
        for (const robot of node.robots) {
          const waits = robot.waiting_for.includes("wait for its next frame") ? "" : robot.waiting_for;  // that is no fault of its own
          if (waits) alarms.push(`<b>${escaped(robot.name)}</b>: ${escaped(waits)}.`);
          robots.push(`<span class="chip ${!robot.present ? "" : waits ? "warn" : "good"}" title="${escaped(`${robot.frames} frames, ${robot.dropped} dropped. ${waits}`)}">${escaped(robot.name)}</span>`);
        }
      }
    }
    if (this.status?.played?.problem) alarms.push(`<b>${escaped(this.status.played.name)}</b> is damaged: ${escaped(this.status.played.problem)}.`);
    if (robots.length > 4) robots = [`<span class="chip good">${robots.length} robots</span>`];
    const unknown = Math.max(this.status?.unknown_objects ?? 0, this.unknown);
    const { earlier_tiles: tiles = 0, regions_not_looked_at: regions = 0 } = this.status ?? {};
    if (!this.status?.played && (tiles > 0 || regions > 0 || unknown > 0)) {
      const count = (number, what) => (number > 0 ? [`${number} ${what}${number === 1 ? "" : "s"}`] : []);
      const map = regions > 0 ? count(regions, "region") : count(tiles, "tile");
      alarms.push(`Since the restart nobody has looked at ${[...count(unknown, "object"), ...map.map((part) => `${part} of the map (striped)`)].join(" and ")}.`);
    }
    fill($("nodes"), nodes.join(""));
    fill($("robots"), robots.join(""));
    const text = alarms.slice(0, 4).join("<br>");
    if ($("alarm").shown !== text) {
      $("alarm").shown = text;
      $("alarm").innerHTML = text;
      $("alarm").hidden = text === "";
    }
  }
}

function fill(element, html) {
  if (element.shown === html) return;
  element.shown = html;
  element.innerHTML = html;
}
