// The line of time: events as ticks, a marker "since" and one for the time that is shown.
import { rgbOf } from "./colours.js";
import { timeText } from "./words.js";

const kGrab = 12;  // pixels around a marker
const $ = (id) => document.getElementById(id);

export class TimeLine {
  /** `changed()` is called when a person has moved a marker. */
  constructor(events, changed) {
    this.events = events;
    this.changed = changed;
    this.canvas = $("time-canvas");
    this.range = null;     // [first, last] stamp
    this.at = null;        // shown; null: live
    this.since = null;     // chosen by a person; null: by itself
    this.dirty = true;
    this.drag = null;
    $("time-live").addEventListener("click", () => this.live());
    this.canvas.addEventListener("pointerdown", (press) => {
      this.canvas.setPointerCapture(press.pointerId);
      const x = press.offsetX;
      this.drag = Math.abs(x - this.x(this.sinceStamp())) < kGrab && press.offsetY > this.canvas.clientHeight * 0.55 ? "since" : "at";
      this.move(x);
    });
    this.canvas.addEventListener("pointermove", (move) => {
      if (this.drag) this.move(move.offsetX);
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => { this.drag = null; });
    this.canvas.addEventListener("keydown", (key) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[key.key];
      if (!step || !this.range) return;
      key.preventDefault();
      key.stopPropagation();
      this.goTo((this.at ?? this.range[1]) + step * (this.range[1] - this.range[0]) / 100);
    });
    new ResizeObserver(() => { this.dirty = true; }).observe(this.canvas);
  }

  setRange(range) {
    if (this.range && range[0] === this.range[0] && range[1] === this.range[1]) return;
    this.range = range;
    this.dirty = true;
  }

  /** Changes after it are shown: the marker's, or just before the first change that is no addition. */
  sinceStamp() {
    if (this.since !== null) return this.since;
    for (const event of this.events.values()) {
      if (event.kind === "MOVED" || event.kind === "REMOVED") return event.stamp - 0.001;
    }
    return this.range ? this.range[1] : 0;
  }

  /** The stamp that is shown. */
  shown() { return this.at ?? Infinity; }

  live() {
    this.at = null;
    this.dirty = true;
    this.changed();
  }

  goTo(stamp) {
    if (!this.range) return;
    this.at = stamp >= this.range[1] ? null : Math.max(this.range[0], stamp);
    this.dirty = true;
    this.changed();
  }

  setSince(stamp) {
    this.since = stamp;
    this.dirty = true;
    this.changed();
  }

  x(stamp) {
    const width = this.canvas.clientWidth - 24;
    if (!this.range || this.range[1] <= this.range[0]) return 12;
    return 12 + width * Math.min(1, Math.max(0, (stamp - this.range[0]) / (this.range[1] - this.range[0])));
  }

  move(x) {
    if (!this.range) return;
    const share = (x - 12) / Math.max(1, this.canvas.clientWidth - 24);
    const stamp = this.range[0] + Math.min(1, Math.max(0, share)) * (this.range[1] - this.range[0]);
    if (this.drag === "since") this.setSince(stamp);
    else this.goTo(share > 0.995 ? Infinity : stamp);
  }

  draw(theme) {
    if (!this.dirty) return;
    this.dirty = false;
    const { clientWidth: width, clientHeight: height } = this.canvas, scale = Math.min(devicePixelRatio, 2);
    if (width === 0) return;
    this.canvas.width = width * scale;
    this.canvas.height = height * scale;
    const pen = this.canvas.getContext("2d");
    pen.scale(scale, scale);
    const css = (hex) => `rgb(${rgbOf(hex)})`;
    $("time-live").setAttribute("aria-pressed", this.at === null);
    $("time-text").textContent = this.range ? timeText(this.at ?? this.range[1]) : "";
    const middle = height / 2;
    pen.fillStyle = css(theme.grid);
    pen.fillRect(12, middle - 3, width - 24, 6);
    if (!this.range) return;
    const since = this.x(this.sinceStamp()), at = this.x(this.at ?? this.range[1]);
    pen.fillStyle = css(theme.measure);
    pen.globalAlpha = 0.55;
    if (at > since) pen.fillRect(since, middle - 3, at - since, 6);
    pen.globalAlpha = 1;
    const colour = { ADDED: css(theme.added), MOVED: css(theme.moved), REMOVED: css(theme.ghost) };
    for (const event of this.events.values()) {
      if (!colour[event.kind]) continue;
      const tall = event.kind === "ADDED" ? 8 : 14;
      pen.fillStyle = colour[event.kind];
      pen.fillRect(this.x(event.stamp) - 1.5, middle - tall, 3, tall - 4);
    }
    pen.fillStyle = css(theme.text);
    pen.strokeStyle = css(theme.ground);
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(since - 7, middle + 20);
    pen.lineTo(since, middle + 6);
    pen.lineTo(since + 7, middle + 20);
    pen.closePath();
    pen.fill();
    pen.beginPath();
    pen.arc(at, middle, 9, 0, 7);
    pen.fill();
    pen.stroke();
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = since > width - 160 ? "right" : "left";
    if (width > 420) pen.fillText("changes since here", since + (since > width - 160 ? -12 : 12), middle + 20);
  }
}
