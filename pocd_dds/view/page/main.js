// The page: what comes in is put in its place, what a person does is carried out.
import * as THREE from "./three/build/three.module.js";
import { colourOfScore, rgbOf, themes } from "./colours.js";
import { Connection } from "./connection.js";
import { Health } from "./health.js";
import { helpHtml, keyTable } from "./help.js";
import { Labels } from "./labels.js";
import { Lines } from "./lines.js";
import { ObjectLayer, ObjectStore } from "./objects.js";
import { Panel } from "./panel.js";
import { Robots } from "./robots.js";
import { Stage } from "./stage.js";
import { Surface } from "./surface.js";
import { TimeLine } from "./timeline.js";
import { metres, timeText } from "./words.js";

const $ = (id) => document.getElementById(id);
let theme = themes.dark;
let selected = null, following = null, measuring = null, fitted = false, wantsFit = true;
let then = null;      // objects and robots of another time: {stamp, map, objects, robots}
let before = null;    // those of the marker "since", for the left half
let other = null;     // the map of then for the left half: {connection, surface}
let drawn = false, cut = Infinity, restored = false;

// When the first picture with a map was there, when the last one with a new surface, and when that surface came [ms].
const times = { first: null, whole: null, last: null };

const connection = new Connection(use, (link) => health.setLink(link));
const stage = new Stage();
const store = new ObjectStore();
const health = new Health();
const surface = new Surface(stage.scene, (list) => connection.wish("want", list));
const layers = { now: new ObjectLayer(stage.scene), before: new ObjectLayer(stage.scene) };
layers.before.group.visible = false;
const robots = new Robots(stage.scene);
const grid = new Lines(stage.scene);
const tape = new Lines(stage.scene, true);
const labels = new Labels($("labels"), stage);
const panel = new Panel(store, { select, flyTo, inView });
panel.wanted = askHistory;
const time = new TimeLine(panel.events, timeChanged);

function use(piece) {
  if (piece.kind !== "json") {
    surface.use(piece);
    times.last = performance.now();
    stage.askSoon();
    return;
  }
  const json = piece.json;
  switch (json.type) {
    case "reset":
      for (const part of [store, panel, health, robots, surface]) part.clear();
      break;
    case "status":
      health.useStatus(json);
      connection.beats = !json.played;
      surface.setRun(json.run, json.voxel);
      if (json.time) time.setRange(json.time);
      time.setMapSince(json.map_since ?? null);
      if ((json.played?.kind ?? null) !== time.played) time.setPlayed(json.played?.kind ?? null);
      $("empty").textContent = json.played ? (json.played.read < 1 ? `Reading ${json.played.name} ...` : "It holds no map.") : json.publisher_seen ? "The map is still empty." : "Waiting for a map on the bus ...";
      break;
    case "health": health.useNode(json); break;
    case "robot": robots.use(json); break;
    case "looks":
      surface.useLooks(json);
      stage.askSoon();
      break;
    case "object":
      store.use(json, performance.now());
      if (json.id === selected) askHistory(json.id);
      panel.dirty = true;
      break;
    case "event":
      panel.addEvent(json);
      if (json.kind === "OPERATOR") document.querySelector(".kind.operator").hidden = false;
      time.dirty = true;
      break;
    case "history": panel.addHistory(json); break;
    case "then":
      if (time.at !== null) showThen(json);
      break;
  }
  drawn = false;
}

/** What comes for the left half. */
function useBefore(piece) {
  if (!other) return;
  if (piece.kind !== "json") {
    other.surface.use(piece);
    stage.askSoon();
  } else if (piece.json.type === "reset") {
    other.surface.clear();
  } else if (piece.json.type === "status") {
    other.surface.setRun(piece.json.run, piece.json.voxel);
  } else if (piece.json.type === "then") {
    before = piece.json;
    drawn = false;
  }
}

function showThen(json) {
  then = json;
  robots.show(json?.robots ?? null);
  panel.then = json?.objects ?? null;
  panel.dirty = true;
  $("pale").hidden = !json || json.map;
  drawn = false;
}

let historyTimer = null;
function askHistory(id) {
  if (historyTimer) return;
  historyTimer = setTimeout(() => {
    historyTimer = null;
    if (selected) connection.send({ history: selected });
  }, id === selected ? 250 : 0);
}

function select(id) {
  selected = id;
  panel.select(id);
  if (id) connection.send({ history: id });
  if (id && $("panel").classList.contains("low")) $("panel").className = "";
  drawn = false;
  saveLink();
}

function flyTo(box) {
  if (!box) return;
  wantsFit = false;
  stage.look(box.slice(0, 3), Math.max(4, 4.5 * Math.max(...box.slice(4))));
}

function inView(box) {
  const p = stage.project(box.slice(0, 3));
  return Boolean(p && p.inside);
}

let thenTimer = null;
function timeChanged() {
  if (time.at === null && then) showThen(null);
  // While a marker is dragged the server is asked ten times a second at most.
  thenTimer ??= setTimeout(() => {
    thenTimer = null;
    if (time.at !== timeChanged.asked) connection.wish("at", time.at);
    timeChanged.asked = time.at;
    if (other) askBefore();
  }, 100);
  panel.until = time.shown();
  panel.dirty = true;
  drawn = false;
}

function askBefore() {
  const since = time.sinceStamp();
  if (since === other.asked) return;
  other.asked = since;
  other.connection.wish("at", since);
}

function setSplit(on) {
  stage.split = on;
  before = null;
  if (on) {
    other = { surface: new Surface(stage.scene, (list) => other?.connection.wish("want", list)), asked: null };
    other.surface.setTheme(theme);
    other.surface.cutAbove(Number.isFinite(cut) ? cut : 1e6);
    other.connection = new Connection(useBefore, () => {});
    askBefore();
  } else if (other) {
    other.connection.end();
    other.surface.end();
    other = null;
    surface.group.visible = true;
  }
}

/** The last event of each object that has changed between the marker and the time that is shown. */
function changesShown() {
  const since = time.sinceStamp(), until = time.shown(), last = new Map();
  for (const event of panel.events.values()) {
    if (event.kind === "UPDATED" || event.stamp < since || event.stamp > until) continue;
    if (event.kind === "OPERATOR") { last.delete(event.id); continue; }
    const first = last.get(event.id);
    if (event.kind === "REMOVED" && first?.kind === "ADDED") last.delete(event.id);
    else if (event.kind === "MOVED" && first?.kind === "ADDED") last.set(event.id, { ...event, kind: "ADDED" });
    else if (event.kind === "MOVED" && first?.kind === "MOVED") last.set(event.id, { ...event, previous: first.previous });
    else last.set(event.id, event);
  }
  return [...last.values()];
}

function drawObjects(now) {
  panel.since = time.sinceStamp();
  const changes = changesShown();
  const live = store.list(now);
  const objects = then ? then.objects.map((object) => ({ ...object, condition: "present" })) : live;
  layers.now.draw(objects, changes, theme, selected);
  surface.dim(then && !then.map ? 1 : 0);
  for (const object of store.gone.values()) surface.paint(object.run, object.number, null);
  if (then) for (const object of live) surface.paint(object.run, object.number, null);
  for (const object of objects) surface.paint(object.run, object.number, object.condition === "unknown" ? null : colourOfScore(object.belief.v));
  health.unknown = live.filter((object) => object.condition === "unknown").length;
  if (other) {
    const then_objects = (before?.objects ?? []).map((object) => ({ ...object, condition: "present" }));
    layers.before.draw(then_objects, [], theme, selected);
    other.surface.dim(before && !before.map ? 1 : 0);
    for (const object of then_objects) other.surface.paint(object.run, object.number, colourOfScore(object.belief.v));
    if (before) askBefore();
  }
  $("split-left").textContent = `before: ${timeText(time.sinceStamp())}`;
  $("split-right").textContent = time.at === null ? "now" : timeText(time.at);
  drawn = store.gliding.size === 0;
}

function pose(json) { return [json.position[0], json.position[1], json.position[2]]; }

stage.resizers.push((width, height, pixels) => {
  for (const one of [layers.now, layers.before, robots.lines, grid, tape]) one.resize(width, height, pixels);
});
stage.before.push((now) => {
  if (!fitted && times.last) adapt();
  if (!drawn) {
    drawObjects(now);
    if (drawn) stage.askSoon();
    else stage.ask();  // a box glides
  }
  if (robots.draw(theme, following)) stage.askSoon();
  const followed = following && robots.find(following);
  if (followed && robots.moved) stage.follow(robots.moved.from, pose(followed));
  robots.moved = null;
  const reach = Math.max(60, 6 * stage.camera.position.distanceTo(stage.controls.target));
  if (surface.update(stage.camera.position, reach)) {
    times.last = performance.now();
    stage.askSoon();
  }
  if (other?.surface.update(stage.camera.position, reach)) stage.askSoon();
  time.draw(theme);
  panel.update(time.range ? time.range[1] : 0);
  return false;
});
stage.halves.push((part) => {
  layers.now.group.visible = part !== "left";
  layers.before.group.visible = part === "left";
  robots.lines.mesh.visible = part !== "left" && robots.any;
  if (other) {
    surface.group.visible = part !== "left";
    other.surface.group.visible = part === "left";
  }
});
const rightLabels = () => layers.now.labels.concat(robots.labels, tapeLabels());
stage.after.push(() => {
  const placed = stage.split ? [{ labels: layers.before.labels, offset: 0 }, { labels: rightLabels(), offset: stage.partWidth }]
    : [{ labels: rightLabels(), offset: 0 }];
  labels.place(placed, selected);
});

let showsNew = false;  // the frame that is under way shows a surface that the one before did not
stage.after.push(() => {
  showsNew = surface.drawn();
  other?.surface.drawn();
  if (surface.changed.size > 0 || other?.surface.changed.size > 0) stage.askSoon();
});
stage.finished.push(() => {
  if (!showsNew) return;
  times.whole = performance.now();
  times.first ??= times.whole;
});

/** Bounds of the map and its objects; null when there is no map. Objects come first: with them the first picture is of all. */
function extent() {
  const bounds = surface.bounds();
  if (bounds && !then) for (const { box } of store.objects.values()) bounds.expandByPoint(new THREE.Vector3(box[0], box[1], box[2]));
  return bounds;
}

function adapt() {
  for (const one of [surface, other?.surface]) one?.chooseDetail(stage.camera.position, stage.controls.target, stage.focal, stage.software);
  const bounds = extent();
  $("empty").hidden = Boolean(bounds) || store.objects.size > 0;
  health.show();
  if (!bounds) return;
  drawGrid(bounds);
  if ((wantsFit && !stage.touched && !restored) && !(fitted && fitted.containsBox(bounds))) {
    stage.fit(bounds, !fitted || stage.software);
    fitted = bounds.clone().expandByScalar(0.3);
  }
  const top = Math.max(0.1, bounds.max.z), share = Number($("cut-range").value) / 100;
  const height = share >= 1 ? Infinity : bounds.min.z + share * (top - bounds.min.z);
  if (height !== cut) {
    cut = height;
    for (const one of [surface, other?.surface]) one?.cutAbove(Number.isFinite(cut) ? cut : 1e6);
    $("cut-value").textContent = Number.isFinite(cut) ? `${cut.toFixed(1)} m` : "off";
    stage.ask();
  }
}
setInterval(adapt, 250);  // to where the camera is

/** Metres on the ground: every one of a room, every ten of a hall. */
let gridded = "";
function drawGrid(bounds) {
  const step = Math.max(bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y) > 60 ? 10 : 1;
  const [x0, y0] = [bounds.min.x, bounds.min.y].map((v) => step * Math.floor(v / step));
  const [x1, y1] = [bounds.max.x, bounds.max.y].map((v) => step * Math.ceil(v / step));
  const wanted = `${x0},${y0},${x1},${y1},${theme.grid}`;
  if (wanted === gridded) return;
  gridded = wanted;
  grid.begin();
  const rgb = rgbOf(theme.grid);
  for (let x = x0; x <= x1; x += step) grid.add([x, y0, 0], [x, y1, 0], rgb, x % (5 * step) === 0 ? 1.6 : 1, 0.8);
  for (let y = y0; y <= y1; y += step) grid.add([x0, y, 0], [x1, y, 0], rgb, y % (5 * step) === 0 ? 1.6 : 1, 0.8);
  grid.end();
  stage.ask();
}

function setTheme(name) {
  theme = themes[name];
  document.documentElement.dataset.theme = name;
  stage.renderer.setClearColor(theme.ground, 1);
  surface.setTheme(theme);
  other?.surface.setTheme(theme);
  time.dirty = true;
  drawn = false;
  robots.dirty = true;
  localStorage.setItem("theme", name);
  stage.ask();
}

function press(id, on) { $(id).setAttribute("aria-pressed", on); }
function hint(text) {
  $("hint").textContent = text;
  $("hint").hidden = !text;
}

const actions = {
  home() {
    wantsFit = true;
    const bounds = extent();
    if (bounds) stage.fit(bounds);
  },
  top() {
    stage.setTop(!stage.top);
    press("tool-top", stage.top);
    if (wantsFit) actions.home();  // all of it was shown: from above, too
  },
  follow() {
    following = robots.next(following);
    press("tool-follow", Boolean(following));
    hint(following ? `Following ${following}: F takes the next one` : "");
    const robot = following && robots.find(following);
    if (robot) stage.look(pose(robot), 7);
    robots.dirty = true;
  },
  measure() {
    measuring = measuring ? null : [];
    press("tool-measure", Boolean(measuring));
    hint(measuring ? "Click two points on the surface" : "");
    drawTape();
  },
  split() {
    setSplit(!stage.split);
    press("tool-split", stage.split);
    $("split-line").hidden = !stage.split;
    timeChanged();
  },
  theme() { setTheme(theme === themes.dark ? "light" : "dark"); },
  async link() {
    saveLink(true);
    try {
      await navigator.clipboard.writeText(location.href);
      hint("The link to this view was copied");
    } catch {
      hint("The link to this view is in the address bar");
    }
    setTimeout(() => hint(""), 2500);
  },
  help() {
    $("help").innerHTML = helpHtml();
    if ($("help").open) $("help").close();
    else {
      $("help").showModal();
      $("help").scrollTop = 0;  // its button at the end has the focus
    }
  },
  play() { time.toggle(); },
  live() { time.live(); },
  escape() {
    if (measuring) actions.measure();
    else if (selected) select(null);
    else if (following) {
      following = null;
      press("tool-follow", false);
      hint("");
    }
  },
};
for (const name of ["home", "top", "follow", "measure", "split", "theme", "link", "help"]) $(`tool-${name}`).addEventListener("click", actions[name]);

addEventListener("keydown", (key) => {
  if (key.target.matches("input:not([type=checkbox]), select, dialog *") || key.ctrlKey || key.metaKey || key.altKey) return;
  const bound = keyTable.find((row) => row.keys.includes(key.key));
  if (!bound) return;
  if (key.key === " " && key.target.matches("button, summary, input")) return;
  key.preventDefault();
  if (bound.action) return actions[bound.action]();
  const target = stage.controls.target, reach = stage.camera.position.distanceTo(target);
  const ahead = target.clone().sub(stage.camera.position).setZ(0);
  if (ahead.lengthSq() < 1e-6) ahead.set(0, 1, 0);
  ahead.normalize().multiplyScalar(0.12 * reach);
  const by = { ArrowUp: ahead, ArrowDown: ahead.clone().negate(), ArrowLeft: new THREE.Vector3(-ahead.y, ahead.x, 0), ArrowRight: new THREE.Vector3(ahead.y, -ahead.x, 0) }[key.key];
  if (by) {
    stage.follow([0, 0], [by.x, by.y]);
  } else {
    const zoom = key.key === "+" || key.key === "=" ? 0.8 : 1.25;
    stage.camera.position.sub(target).multiplyScalar(zoom).add(target);
    stage.controls.update();
  }
  stage.touched = true;
});

// What was chosen is chosen: the keys are the page's again.
for (const select of document.querySelectorAll("select")) select.addEventListener("change", () => select.blur());

// A click is a press that does not move; a drag is the camera's.
let pressedAt = null;
$("canvas").addEventListener("pointerdown", (down) => { pressedAt = [down.clientX, down.clientY]; });
$("canvas").addEventListener("pointerup", (up) => {
  if (!pressedAt || Math.hypot(up.clientX - pressedAt[0], up.clientY - pressedAt[1]) > 6) return;
  const { raycaster, part } = stage.rayAt(up.clientX, up.clientY);
  const point = (part === "left" && other ? other.surface : surface).hit(raycaster);
  if (measuring) {
    if (!point) return;
    if (measuring.length === 2) measuring = [];
    measuring.push(point.toArray());
    drawTape();
    return;
  }
  const limit = point ? point.distanceTo(raycaster.ray.origin) + 0.4 : Infinity;
  select((part === "left" ? layers.before : layers.now).pick(raycaster.ray, limit));
});

function drawTape() {
  tape.begin();
  const rgb = rgbOf(theme.measure), points = measuring ?? [];
  for (const [x, y, z] of points) {
    tape.add([x - 0.08, y, z], [x + 0.08, y, z], rgb, 3);
    tape.add([x, y - 0.08, z], [x, y + 0.08, z], rgb, 3);
  }
  if (points.length === 2) tape.add(points[0], points[1], rgb, 3);
  tape.end();
  stage.ask();
}
function tapeLabels() {
  if (measuring?.length !== 2) return [];
  const [a, b] = measuring;
  const across = Math.hypot(a[0] - b[0], a[1] - b[1]), up = b[2] - a[2];
  return [{ at: a.map((v, i) => (v + b[i]) / 2), text: `${metres(Math.hypot(across, up))}  (level ${metres(across)}, up ${up.toFixed(2)} m)`, kind: "measure", rank: 0 }];
}

// The address holds the view: camera, selection, times.
function saveLink(now = false) {
  clearTimeout(saveLink.timer);
  const save = () => {
    const camera = [...stage.camera.position.toArray(), ...stage.controls.target.toArray()].map((v) => v.toFixed(2)).join(",");
    const parts = [["c", camera], ["sel", selected], ["t", time.at?.toFixed(3)], ["since", time.since?.toFixed(3)], ["split", stage.split ? 1 : null], ["top", stage.top ? 1 : null]];
    history.replaceState(null, "", `#${parts.filter(([, v]) => v !== null && v !== undefined).map(([k, v]) => `${k}=${v}`).join("&")}`);
  };
  if (now) save();
  else saveLink.timer = setTimeout(save, 400);
}
stage.controls.addEventListener("change", () => { if (stage.touched || !wantsFit) saveLink(); });

function restoreLink() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const camera = (parts.get("c") ?? "").split(",").map(Number);
  if (camera.length === 6 && camera.every(Number.isFinite)) {
    restored = true;
    stage.camera.position.fromArray(camera);
    stage.controls.target.fromArray(camera, 3);
    if (parts.get("top")) {
      stage.top = true;
      stage.controls.enableRotate = false;
      press("tool-top", true);
    }
    stage.controls.update();
  }
  if (parts.get("split")) actions.split();
  if (parts.get("since")) time.since = Number(parts.get("since"));
  const wanted = { id: parts.get("sel"), at: parts.has("t") ? Number(parts.get("t")) : null };
  const wait = setInterval(() => {
    if (!time.range) return;
    if (wanted.id && !store.find(wanted.id) && performance.now() < 10000) return;
    clearInterval(wait);
    if (wanted.id) select(wanted.id);
    if (Number.isFinite(wanted.at) && wanted.at !== null) time.goTo(wanted.at);
  }, 150);
}

setTheme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
restoreLink();

// For tests and the curious: what the page knows.
window.pocd = { stage, store, surface, panel, time, health, robots, connection, select, actions,
  times, then: () => then, before: () => before, other: () => other,
  shown: () => ({ then: Boolean(then), count: then ? then.objects.length : store.objects.size }) };
