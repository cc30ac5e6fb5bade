// Names over the map: the important ones first, none over another.

const kMost = 80;

export class Labels {
  constructor(root, stage) {
    this.root = root;
    this.stage = stage;
    this.pool = [];
  }

  /** `layers`: [{labels, offset}], offset in pixels from the left of the canvas. */
  place(layers, selected) {
    const wanted = [];
    for (const { labels, offset } of layers) {
      for (const label of labels) {
        const p = this.stage.project(label.at);
        if (!p || !p.inside) continue;
        wanted.push({ label, x: p.x + offset, y: p.y, distance: p.distance });
      }
    }
    wanted.sort((a, b) => a.label.rank - b.label.rank || a.distance - b.distance);
    const taken = [];
    let used = 0;
    for (const { label, x, y } of wanted) {
      if (used >= kMost) break;
      const half = 4 + 3.6 * label.text.length;
      const area = { left: x - half, right: x + half, top: y - 24, bottom: y };
      const free = label.rank === 0 || taken.every((t) => area.right < t.left || area.left > t.right || area.bottom < t.top || area.top > t.bottom);
      if (!free) continue;
      taken.push(area);
      const element = this.element(used++);
      const name = `label ${label.kind} ${label.id !== undefined && label.id === selected ? "selected" : ""}`;
      if (element.className !== name) element.className = name;
      if (element.textContent !== label.text) element.textContent = label.text;
      element.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px) translate(-50%, -100%)`;
      element.hidden = false;
    }
    for (let i = used; i < this.pool.length; ++i) this.pool[i].hidden = true;
  }

  element(i) {
    if (!this.pool[i]) {
      this.pool[i] = document.createElement("div");
      this.root.append(this.pool[i]);
    }
    return this.pool[i];
  }
}
