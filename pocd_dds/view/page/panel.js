// The list of changes, the list of objects, and what is known of the selected one.
import { durationText, escaped, evidenceSentences, eventTitle, metres, nameOf, placeOf, ruleText, score, timeText } from "./words.js";

const kMostRows = 200;
const $ = (id) => document.getElementById(id);

export class Panel {
  /** `act`: {select(id), flyTo(box), inView(box)}. */
  constructor(store, act) {
    this.store = store;
    this.act = act;
    this.events = new Map();
    this.histories = new Map();
    this.kinds = new Set(["ADDED", "MOVED", "REMOVED", "OPERATOR"]);
    this.selected = null;
    this.dirty = true;
    this.since = -Infinity;
    this.until = Infinity;
    this.then = null;   // objects of another time
    this.last = 0;
    for (const button of document.querySelectorAll(".kind")) {
      button.addEventListener("click", () => {
        const kind = button.dataset.kind;
        if (!this.kinds.delete(kind)) this.kinds.add(kind);
        button.setAttribute("aria-pressed", this.kinds.has(kind));
        this.dirty = true;
      });
    }
    for (const id of ["filter-class", "filter-time", "filter-place", "filter-object"]) $(id).addEventListener("input", () => { this.dirty = true; });
    for (const name of ["changes", "objects"]) $(`tab-${name}`).addEventListener("click", () => this.show(name));
    $("events").addEventListener("click", (click) => this.clicked(click));
    $("object-list").addEventListener("click", (click) => this.clicked(click));
    // A row that is pressed is not replaced before it is released.
    $("panel").addEventListener("pointerdown", () => { this.held = true; });
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => { this.held = false; });
    $("panel-grip").addEventListener("click", () => {
      const panel = $("panel");
      const next = panel.classList.contains("tall") ? "low" : panel.classList.contains("low") ? "" : "tall";
      panel.className = next;
    });
  }

  show(name) {
    for (const one of ["changes", "objects"]) {
      $(one).hidden = one !== name;
      $(`tab-${one}`).setAttribute("aria-selected", one === name);
    }
    this.dirty = true;
  }

  clicked(click) {
    const row = click.target.closest("button[data-id]");
    if (!row) return;
    const event = this.events.get(Number(row.dataset.event));
    this.act.select(row.dataset.id);
    this.act.flyTo(event ? event.box : this.store.find(row.dataset.id)?.box);
  }

  clear() {
    this.events.clear();
    this.histories.clear();
    this.dirty = true;
  }

  addEvent(event) {
    this.events.set(event.event, event);
    if (event.id === this.selected) this.wanted?.(event.id);
    this.dirty = true;
  }

  addHistory(history) {
    this.histories.set(history.id, history);
    if (this.histories.size > 200) this.histories.delete(this.histories.keys().next().value);
    this.dirty = true;
  }

  select(id) {
    this.selected = id;
    this.dirty = true;
  }

  eventsOf(id) { return [...this.events.values()].filter((event) => event.id === id); }

  passes(event, latest) {
    if (!this.kinds.has(event.kind)) return false;
    const name = $("filter-class").value, time = $("filter-time").value;
    if (name && event.class !== name) return false;
    if (time === "since" && event.stamp < this.since) return false;
    if (Number(time) > 0 && event.stamp < latest - Number(time)) return false;
    return !$("filter-place").checked || this.act.inView(event.box);
  }

  update(latest) {
    const moving = $("filter-place").checked && performance.now() - this.last > 500;
    if ((!this.dirty && !moving) || this.held) return;
    if (performance.now() - this.last < 120) return;
    this.dirty = false;
    this.last = performance.now();
    this.updateClasses();
    const all = [...this.events.values()].sort((a, b) => b.stamp - a.stamp || b.event - a.event);
    const matching = all.filter((event) => this.passes(event, latest));
    $("count-changes").textContent = matching.length;
    $("count-objects").textContent = this.then ? this.then.length : this.store.objects.size;
    if (!$("changes").hidden) {
      const rows = matching.slice(0, kMostRows).map((event) => `<li><button data-id="${escaped(event.id)}" data-event="${event.event}" class="${event.kind} ${event.id === this.selected ? "selected" : ""} ${event.stamp > this.until ? "later" : ""}">
        <span class="mark"></span><span>${escaped(eventTitle(event))}</span><span class="when">${escaped(timeText(event.stamp))}</span>
        <span class="why">${escaped(ruleText(event.evidence.rule))}</span></button></li>`);
      if (matching.length > kMostRows) rows.push(`<li class="none">${matching.length - kMostRows} older ones: filter to see them</li>`);
      this.fill($("events"), rows, all.length === 0 ? "Nothing has changed yet." : "No change passes the filters.");
    }
    if (!$("objects").hidden) this.updateObjects();
    this.updateDetail();
  }

  fill(list, rows, otherwise) {
    const html = rows.length > 0 ? rows.join("") : `<li class="none">${otherwise}</li>`;
    if (list.shown === html) return;
    list.shown = html;
    const at = list.scrollTop;
    list.innerHTML = html;
    list.scrollTop = at;
  }

  updateClasses() {
    const names = [...new Set([...this.events.values()].map((event) => event.class))].sort().join("\n");
    const select = $("filter-class");
    if (select.shown === names) return;
    select.shown = names;
    const value = select.value;
    select.innerHTML = `<option value="">all classes</option>${names.split("\n").filter(Boolean).map((name) => `<option>${escaped(name)}</option>`).join("")}`;
    select.value = value;
  }

  updateObjects() {
    const words = $("filter-object").value.toLowerCase().replace("#", "").split(/\s+/).filter(Boolean);
    const objects = (this.then ?? [...this.store.objects.values()])
      .filter((o) => words.every((word) => o.class.toLowerCase().includes(word) || String(o.number) === word))
      .sort((a, b) => a.number - b.number);
    const rows = objects.slice(0, kMostRows).map((o) => `<li><button data-id="${escaped(o.id)}" class="${o.id === this.selected ? "selected" : ""}">
      <span class="mark" style="background:${o.condition === "unknown" ? "var(--unknown)" : `hsl(${Math.round(165 * o.belief.v)} 60% 46%)`}"></span><span>${escaped(nameOf(o))}</span><span class="when">E[v] ${score(o.belief.v)}</span>
      <span class="why">${o.condition === "unknown" ? "not looked at since the restart" : this.then ? `at ${placeOf(o.box)}` : `at ${placeOf(o.box)}, last seen ${escaped(timeText(o.last_seen))}`}</span></button></li>`);
    this.fill($("object-list"), rows, "No object.");
  }

  updateDetail() {
    const root = $("detail");
    const past = this.selected && this.then?.find((one) => one.id === this.selected);
    const known = this.selected && this.store.find(this.selected);
    const object = past && known ? { ...known, ...past, condition: known.condition } : known;
    const events = this.selected ? this.eventsOf(this.selected) : [];
    root.hidden = !object && events.length === 0;
    if (root.hidden) return;
    const one = object ?? { ...events.at(-1), condition: "gone", belief: events.at(-1).evidence.after };
    const words = { present: "there", gone: one.why === "seen_again" ? "seen again" : "gone", unknown: "not looked at since the restart" };
    const open = new Set([...root.querySelectorAll("details[open]")].map((d) => d.dataset.event));
    const history = this.histories.get(this.selected);
    const html = `<h2>${escaped(nameOf(one))} <span class="badge ${one.condition}">${words[one.condition]}</span><button aria-label="Close">&times;</button></h2>
      <div class="score"><b>${score(one.belief.v)}</b><span>E[v]: probability that it stays where it is</span></div>
      ${curve(history, events)}
      <dl>${object ? `<dt>first seen</dt><dd>${escaped(timeText(one.first_seen))}</dd><dt>last seen</dt><dd>${escaped(timeText(one.last_seen))}${one.robot ? `, by ${escaped(one.robot)}` : ""}</dd>
      <dt>observations</dt><dd>${one.observations}${one.seen_by.length > 1 ? `, by ${escaped(one.seen_by.join(", "))}` : ""}</dd>` : ""}
      <dt>place</dt><dd>${placeOf(one.box)}, ${Math.round(one.box[3] * 180 / Math.PI)}&deg;</dd>
      <dt>size</dt><dd>${one.box.slice(4).map((m) => m.toFixed(2)).join(" x ")} m</dd>
      <dt>change in place</dt><dd>${one.belief.mu.toFixed(2)} m &plusmn; ${one.belief.sigma.toFixed(2)} m</dd></dl>
      <h3>What happened to it</h3>
      ${events.length === 0 ? `<p class="none">No event since this page's server started.</p>` : events.reverse().map((event) => `<details data-event="${event.event}" ${open.has(String(event.event)) || (open.size === 0 && event === events[0]) ? "open" : ""}>
        <summary class="${event.kind}"><b>${escaped(event.kind.toLowerCase())}</b> at ${escaped(timeText(event.stamp))}${event.robot ? `, seen by ${escaped(event.robot)}` : ""}</summary>
        <p>${evidenceSentences(event).map(escaped).join(" ")}</p>
        <dl>${numbers(event)}</dl></details>`).join("")}`;
    if (root.shown === html) return;
    root.shown = html;
    root.innerHTML = html;
    root.querySelector("h2 button").addEventListener("click", () => this.act.select(null));
  }
}

function numbers(event) {
  const e = event.evidence;
  const rows = [["change delta", metres(e.delta)], ["sigma of the measurement", metres(e.sigma)], ["class s", e.static ? "1, static" : "0, movable"], ["semantic weight k", e.k.toFixed(2)],
    ["inlier c1, outlier c2", `${score(e.c1)}, ${score(e.c2)}`], ["alpha, beta before", `${e.before.alpha.toFixed(2)}, ${e.before.beta.toFixed(2)}`],
    ["alpha, beta after", `${e.after.alpha.toFixed(2)}, ${e.after.beta.toFixed(2)}`], ["rule", e.rule], ["frame", event.frame]];
  if (event.previous) rows.unshift(["from", placeOf(event.previous)], ["to", placeOf(event.box)]);
  return rows.map(([name, value]) => `<dt>${escaped(name)}</dt><dd>${escaped(value)}</dd>`).join("");
}

/** E[v] over time, with a dot for each event. */
function curve(history, events) {
  if (!history || history.samples.length === 0) return "";
  const samples = history.samples, w = 330, h = 110, left = 26, bottom = 18;
  const t0 = Math.min(samples[0][0], ...events.map((e) => e.stamp)), t1 = Math.max(samples.at(-1)[0], history.gone ?? -Infinity, ...events.map((e) => e.stamp), t0 + 1);
  const x = (t) => left + (w - left - 6) * (t - t0) / (t1 - t0), y = (v) => 6 + (h - bottom - 10) * (1 - v);
  const steps = samples.map(([t, v], i) => `${i === 0 ? `M${x(t).toFixed(1)} ` : `H${x(t).toFixed(1)}V`}${y(v).toFixed(1)}`).join("");
  const marks = events.map((e) => `<circle cx="${x(e.stamp).toFixed(1)}" cy="${y(e.evidence.after.v).toFixed(1)}" r="4" fill="var(--${e.kind.toLowerCase()})"><title>${escaped(eventTitle(e))}</title></circle>`).join("");
  const lines = [0, 0.5, 1].map((v) => `<line class="grid" x1="${left}" x2="${w}" y1="${y(v)}" y2="${y(v)}"/><text x="0" y="${y(v) + 4}">${v}</text>`).join("");
  return `<svg class="curve" viewBox="0 0 ${w} ${h}" preserveAspectRatio="none" role="img" aria-label="E[v] over ${durationText(t1 - t0)}">${lines}<path d="${steps}H${x(history.gone ?? t1).toFixed(1)}"/>${marks}
    <text x="${left}" y="${h - 4}">${escaped(timeText(t0))}</text><text x="${w}" y="${h - 4}" text-anchor="end">${escaped(timeText(t1))}</text></svg>`;
}
