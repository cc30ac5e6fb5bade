// The line of time: events as ticks, a marker "since" and one for the time that is shown; playing.
import { rgbOf } from "./colours.js";
import { timeText } from "./words.js";

const kGrab = 12;  // pixels around a marker
const kEdge = 12;  // pixels beside the line
const $ = (id) => document.getElementById(id);

export class TimeLine {
  /** `changed()` is called when the shown time or the marker has changed. */
  constructor(events, changed) {
    this.events = events;
    this.changed = changed;
    this.canvas = $("time-canvas");
    this.range = null;     // [first, last] stamp
    this.zoom = null;      // the part of it that is drawn; null: all
    this.mapSince = null;  // the map of any later time is known
    this.at = null;        // shown; null: live
    this.since = null;     // chosen by a person; null: by itself
    this.playing = false;
    this.played = null;    // kind of what is shown instead of the bus
    this.dirty = true;
    this.drag = null;
    $("time-live").addEventListener("click", () => this.live());
    $("time-play").addEventListener("click", () => this.toggle());
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
    this.canvas.addEventListener("wheel", (wheel) => {
      wheel.preventDefault();
      this.zoomBy(wheel.deltaY > 0 ? 1.25 : 0.8, wheel.offsetX);
    }, { passive: false });
    this.canvas.addEventListener("keydown", (key) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[key.key];
      if (!step || !this.range) return;
      key.preventDefault();
      key.stopPropagation();
      const [first, last] = this.drawn();
      this.goTo((this.at ?? this.range[1]) + step * (last - first) / 100);
    });
    new ResizeObserver(() => { this.dirty = true; }).observe(this.canvas);
    let before = performance.now();
    setInterval(() => {
      const now = performance.now(), passed = (now - before) / 1000;
      before = now;
      if (this.playing && this.drag !== "at") this.goTo((this.at ?? 0) + passed * Number($("time-speed").value), true);
    }, 100);
  }

  setRange(range) {
    if (this.range && range[0] === this.range[0] && range[1] === this.range[1]) return;
    this.range = range;
    this.dirty = true;
  }

  setMapSince(stamp) {
    if (stamp === this.mapSince) return;
    this.mapSince = stamp;
    this.dirty = true;
  }

  setPlayed(kind) {
    this.played = kind;
    $("time-live").textContent = kind ? "End" : "Live";
    $("time-live").title = kind ? "To the end (N)" : "Back to now (N)";
  }

  /** Changes after it are shown: the marker's, or just before the first change of this run that is no addition. */
  sinceStamp() {
    if (this.since !== null) return this.since;
    let newest = null, first = Infinity;
    for (const event of this.events.values()) if (!newest || event.stamp > newest.stamp) newest = event;
    for (const event of this.events.values()) {
      if (event.epoch === newest.epoch && (event.kind === "MOVED" || event.kind === "REMOVED")) first = Math.min(first, event.stamp);
    }
    if (first < Infinity) return first - 0.001;
    return this.range ? this.range[1] : 0;
  }

  /** The stamp that is shown. */
  shown() { return this.at ?? Infinity; }

  live() {
    this.at = null;
    this.play(false);
    this.dirty = true;
    this.changed();
  }

  toggle() {
    if (!this.range) return;
    if (!this.playing && this.at === null) this.goTo(this.played ? this.range[0] : Math.min(this.sinceStamp(), this.range[1] - 0.01));
    this.play(!this.playing);
  }

  play(on) {
    this.playing = on;
    this.dirty = true;
    $("time-play").setAttribute("aria-pressed", on);
    $("time-play").setAttribute("aria-label", on ? "Pause" : "Play");
    $("time-play").querySelector("use").setAttribute("href", `icons.svg#${on ? "pause" : "play"}`);
  }

  goTo(stamp) {
    if (!this.range) return;
    this.at = stamp >= this.range[1] ? null : Math.max(this.range[0], stamp);
    if (this.at === null) this.play(false);
    this.dirty = true;
    this.changed();
  }

  setSince(stamp) {
    this.since = stamp;
    this.dirty = true;
    this.changed();
  }

  /** First and last stamp that the line shows. */
  drawn() { return this.zoom ?? this.range; }

  zoomBy(factor, x) {
    if (!this.range) return;
    const [first, last] = this.drawn(), at = this.stampAt(x);
    const from = Math.max(this.range[0], at - factor * (at - first)), to = Math.min(this.range[1], at + factor * (last - at));
    this.zoom = to - from >= this.range[1] - this.range[0] || to - from < 1 ? (to - from < 1 ? this.zoom : null) : [from, to];
    this.dirty = true;
  }

  x(stamp) {
    const width = this.canvas.clientWidth - 2 * kEdge;
    if (!this.range || this.range[1] <= this.range[0]) return kEdge;
    const [first, last] = this.drawn();
    return kEdge + width * Math.min(1, Math.max(0, (stamp - first) / (last - first)));
  }

  stampAt(x) {
    const [first, last] = this.drawn(), share = (x - kEdge) / Math.max(1, this.canvas.clientWidth - 2 * kEdge);
    return first + Math.min(1, Math.max(0, share)) * (last - first);
  }

  move(x) {
    if (!this.range) return;
    const atEnd = x > this.canvas.clientWidth - kEdge - 3 && this.drawn()[1] === this.range[1];
    if (this.drag === "since") this.setSince(this.stampAt(x));
    else this.goTo(atEnd ? Infinity : this.stampAt(x));
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
    if (!this.range) {
      pen.fillStyle = css(theme.grid);
      pen.fillRect(kEdge, middle - 3, width - 2 * kEdge, 6);
      return;
    }
    // Thin: objects only; thick: the map, too.
    const map = this.mapSince === null ? width - kEdge : this.x(this.mapSince);
    pen.fillStyle = css(theme.grid);
    pen.fillRect(kEdge, middle - 1, map - kEdge, 2);
    pen.fillRect(map, middle - 3, width - kEdge - map, 6);
    const since = this.x(this.sinceStamp()), at = this.x(this.at ?? this.range[1]);
    pen.fillStyle = css(theme.measure);
    pen.globalAlpha = 0.55;
    if (at > since) pen.fillRect(since, middle - 3, at - since, 6);
    pen.globalAlpha = 1;
    const colour = { ADDED: css(theme.added), MOVED: css(theme.moved), REMOVED: css(theme.ghost), OPERATOR: css(theme.unknown) };
    const [first, last] = this.drawn();
    for (const event of this.events.values()) {
      if (!colour[event.kind] || event.stamp < first || event.stamp > last) continue;
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
