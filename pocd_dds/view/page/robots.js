// Robots: camera, what it can see, and the way that it came.
import { rgbOf } from "./colours.js";
import { Lines } from "./lines.js";

const kCone = 1.3;    // length of the drawn view [m]
const kTrail = 200;   // places
const kStep = 0.15;   // between them [m]
const kGap = 1.2;     // farther apart than that: what lies between was not heard [m]

function turned([x, y, z, w], [a, b, c]) {
  const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

export class Robots {
  constructor(scene) {
    this.lines = new Lines(scene);
    this.moved = null;
    this.followed = null;
    this.clear();
  }

  clear() {
    this.robots = new Map();
    this.then = null;  // those of another time
    this.trails = new Map();
    this.labels = [];
    this.dirty = true;
    this.any = false;
  }

  use(json) {
    const before = this.robots.get(json.name);
    if (before && json.name === this.followed && !this.then) this.moved ??= { from: before.position };
    this.robots.set(json.name, json);
    const trail = this.trails.get(json.name) ?? [];
    const last = trail.at(-1);
    if (!last || Math.hypot(last[0] - json.position[0], last[1] - json.position[1]) > kStep) trail.push([json.position[0], json.position[1], 0.04]);
    if (trail.length > kTrail) trail.shift();
    this.trails.set(json.name, trail);
    this.dirty = true;
  }

  /** Robots as they were at another time, with the ways that they had come; null: as they are now. */
  show(list) {
    if (!list && !this.then) return;
    const before = this.find(this.followed);
    this.then = list && new Map(list.map((robot) => [robot.name, robot]));
    const after = this.find(this.followed);
    if (before && after) this.moved ??= { from: before.position };
    this.dirty = true;
  }

  get shown() { return this.then ?? this.robots; }
  find(name) { return this.shown.get(name); }

  /** The one after `name`, by name; null after the last. */
  next(name) {
    const names = [...this.shown.keys()].sort();
    return names[name === null ? 0 : names.indexOf(name) + 1] ?? null;
  }

  /** True when something has changed. */
  draw(theme, followed) {
    this.followed = followed;
    if (!this.dirty) return false;
    this.dirty = false;
    const rgb = rgbOf(theme.robot);
    this.lines.begin();
    this.labels = [];
    for (const robot of this.shown.values()) {
      const at = robot.position, [left, right, up, down] = robot.view;
      const corners = [[-left, -up], [right, -up], [right, down], [-left, down]].map(([x, y]) => {
        const ray = turned(robot.rotation, [kCone * x, kCone * y, kCone]);
        return [at[0] + ray[0], at[1] + ray[1], at[2] + ray[2]];
      });
      const width = robot.name === followed ? 3 : 2;
      corners.forEach((corner, i) => {
        this.lines.add(at, corner, rgb, width, 0.95);
        this.lines.add(corner, corners[(i + 1) % 4], rgb, width, 0.95);
      });
      this.lines.add([at[0], at[1], 0], at, rgb, 2.5);
      const trail = this.then ? [[at[0], at[1], 0.04], ...robot.trail.map(([x, y]) => [x, y, 0.04])].reverse() : this.trails.get(robot.name);
      for (let i = 1; i < trail.length; ++i) {
        if (Math.hypot(trail[i - 1][0] - trail[i][0], trail[i - 1][1] - trail[i][1]) > kGap) continue;
        this.lines.add(trail[i - 1], trail[i], rgb, 1.6, 0.15 + 0.5 * i / trail.length);
      }
      this.labels.push({ at: [at[0], at[1], at[2] + 0.2], text: robot.name, kind: "robot", rank: 1 });
    }
    this.lines.end();
    this.any = this.lines.mesh.visible;
    return true;
  }
}
