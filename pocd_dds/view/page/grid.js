// Metres on the ground: every one of a room, every ten of a hall.
import { rgbOf } from "./colours.js";
import { Lines } from "./lines.js";

export class Grid {
  constructor(scene) {
    this.lines = new Lines(scene);
    this.drawn = "";
  }

  /** Under these bounds; true when it is different from before. */
  draw(bounds, theme) {
    const step = Math.max(bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y) > 60 ? 10 : 1;
    const [x0, y0] = [bounds.min.x, bounds.min.y].map((v) => step * Math.floor(v / step));
    const [x1, y1] = [bounds.max.x, bounds.max.y].map((v) => step * Math.ceil(v / step));
    const wanted = `${x0},${y0},${x1},${y1},${theme.grid}`;
    if (wanted === this.drawn) return false;
    this.drawn = wanted;
    this.lines.begin();
    const rgb = rgbOf(theme.grid);
    for (let x = x0; x <= x1; x += step) this.lines.add([x, y0, 0], [x, y1, 0], rgb, x % (5 * step) === 0 ? 1.6 : 1, 0.8);
    for (let y = y0; y <= y1; y += step) this.lines.add([x0, y, 0], [x1, y, 0], rgb, y % (5 * step) === 0 ? 1.6 : 1, 0.8);
    this.lines.end();
    return true;
  }
}
