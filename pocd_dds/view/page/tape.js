// A distance between two points of the surface.
import { rgbOf } from "./colours.js";
import { Lines } from "./lines.js";
import { metres } from "./words.js";

export class Tape {
  constructor(scene) {
    this.lines = new Lines(scene, true);
    this.points = null;  // of which none, one or two are chosen; null: nobody measures
  }

  get inUse() { return this.points !== null; }
  toggle() { this.points = this.points ? null : []; }

  /** The next point; the third one begins anew. */
  add(point) {
    if (this.points.length === 2) this.points = [];
    this.points.push(point);
  }

  draw(theme) {
    this.lines.begin();
    const rgb = rgbOf(theme.measure), points = this.points ?? [];
    for (const [x, y, z] of points) {
      this.lines.add([x - 0.08, y, z], [x + 0.08, y, z], rgb, 3);
      this.lines.add([x, y - 0.08, z], [x, y + 0.08, z], rgb, 3);
    }
    if (points.length === 2) this.lines.add(points[0], points[1], rgb, 3);
    this.lines.end();
  }

  get labels() {
    if (this.points?.length !== 2) return [];
    const [a, b] = this.points;
    const across = Math.hypot(a[0] - b[0], a[1] - b[1]), up = b[2] - a[2];
    return [{ at: a.map((v, i) => (v + b[i]) / 2), text: `${metres(Math.hypot(across, up))}  (level ${metres(across)}, up ${up.toFixed(2)} m)`, kind: "measure", rank: 0 }];
  }
}
