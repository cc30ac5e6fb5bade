// The page: what comes in is put in its place, what a person does is carried out.
import * as THREE from "./three/build/three.module.js";
import { changesBetween } from "./changes.js";
import { colourOfScore, themes } from "./colours.js";
import { Connection } from "./connection.js";
import { Grid } from "./grid.js";
import { Health } from "./health.js";
import { helpHtml, keyTable } from "./help.js";
import { Labels } from "./labels.js";
import { Link, readLink, whenKnown } from "./link.js";
import { ObjectLayer, ObjectStore } from "./objects.js";
import { Panel } from "./panel.js";
import { Robots } from "./robots.js";
import { Stage } from "./stage.js";
import { Start } from "./start.js";
import { Surface } from "./surface.js";
import { Tape } from "./tape.js";
import { TimeLine } from "./timeline.js";
import { timeText } from "./words.js";

const $ = (id) => document.getElementById(id);
let theme = themes.dark;
let selected = null, following = null, fitted = false, wantsFit = true;
let then = null;      // objects and robots of another time: {stamp, map, objects, robots}
let before = null;    // those of the marker "since", for the left half
let other = null;     // the map of then for the left half: {connection, surface}
let drawn = false, cut = Infinity, restored = false;

const connection = new Connection(use, (link) => health.setLink(link));
const stage = new Stage();
const store = new ObjectStore();
const health = new Health();
const surface = new Surface(stage.scene, (list) => connection.wish("want", list));
const { times } = new Start(stage, surface);
const layers = { now: new ObjectLayer(stage.scene), before: new ObjectLayer(stage.scene) };
layers.before.group.visible = false;
const robots = new Robots(stage.scene);
const grid = new Grid(stage.scene);
const tape = new Tape(stage.scene);
const labels = new Labels($("labels"), stage);
const panel = new Panel(store, { select, flyTo, inView });
panel.wanted = askHistory;
const time = new TimeLine(panel.events, timeChanged);
const link = new Link(() => [
  ["c", [...stage.camera.position.toArray(), ...stage.controls.target.toArray()].map((v) => v.toFixed(2)).join(",")],
  ["sel", selected], ["t", time.at?.toFixed(3)], ["since", time.since?.toFixed(3)], ["split", stage.split ? 1 : null], ["top", stage.top ? 1 : null],
]);

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
  link.save();
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

function drawObjects(now) {
  panel.since = time.sinceStamp();
  const changes = changesBetween(panel.events.values(), panel.since, time.shown());
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
  for (const one of [layers.now, layers.before, robots.lines, grid.lines, tape.lines]) one.resize(width, height, pixels);
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
const rightLabels = () => layers.now.labels.concat(robots.labels, tape.labels);
stage.after.push(() => {
  const placed = stage.split ? [{ labels: layers.before.labels, offset: 0 }, { labels: rightLabels(), offset: stage.partWidth }]
    : [{ labels: rightLabels(), offset: 0 }];
  labels.place(placed, selected);
});

stage.after.push(() => {
  other?.surface.drawn();
  if (surface.changed.size > 0 || other?.surface.changed.size > 0) stage.askSoon();
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
  if (grid.draw(bounds, theme)) stage.ask();
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
    tape.toggle();
    press("tool-measure", tape.inUse);
    hint(tape.inUse ? "Click two points on the surface" : "");
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
    link.save(true);
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
    if (tape.inUse) actions.measure();
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
  stage.step(key.key);
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
  if (tape.inUse) {
    if (!point) return;
    tape.add(point.toArray());
    drawTape();
    return;
  }
  const limit = point ? point.distanceTo(raycaster.ray.origin) + 0.4 : Infinity;
  select((part === "left" ? layers.before : layers.now).pick(raycaster.ray, limit));
});

function drawTape() {
  tape.draw(theme);
  stage.ask();
}

stage.controls.addEventListener("change", () => { if (stage.touched || !wantsFit) link.save(); });

function restoreLink() {
  const { camera, top, split, since, selected: wanted, at } = readLink();
  if (camera) {
    restored = true;
    stage.camera.position.fromArray(camera);
    stage.controls.target.fromArray(camera, 3);
    if (top) {
      stage.top = true;
      stage.controls.enableRotate = false;
      press("tool-top", true);
    }
    stage.controls.update();
  }
  if (split) actions.split();
  if (since !== null) time.since = since;
  whenKnown(() => time.range, () => !wanted || store.find(wanted), () => {
    if (wanted) select(wanted);
    if (at !== null) time.goTo(at);
  });
}

setTheme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
restoreLink();

// For tests and the curious: what the page knows.
window.pocd = { stage, store, surface, panel, time, health, robots, connection, select, actions,
  times, then: () => then, before: () => before, other: () => other,
  shown: () => ({ then: Boolean(then), count: then ? then.objects.length : store.objects.size }) };
