// The address holds the view: camera, selection, times.
const kSaveAfter = 400, kRestoreEvery = 150;  // [ms]
const kWaitForSelected = 10000;               // from the beginning [ms]

/** Writes the view into the address: `parts` gives [[name, value], ...], null or undefined for what is not to be there. */
export class Link {
  constructor(parts) {
    this.parts = parts;
    this.timer = null;
  }

  save(now = false) {
    clearTimeout(this.timer);
    const save = () => {
      const known = this.parts().filter(([, value]) => value !== null && value !== undefined);
      history.replaceState(null, "", `#${known.map(([name, value]) => `${name}=${value}`).join("&")}`);
    };
    if (now) save();
    else this.timer = setTimeout(save, kSaveAfter);
  }
}

/** What the address says: {camera, top, split, since, selected, at}, each null when it says nothing of it. */
export function readLink() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const number = (name) => parts.has(name) && Number.isFinite(Number(parts.get(name))) ? Number(parts.get(name)) : null;
  const camera = (parts.get("c") ?? "").split(",").map(Number);
  return { camera: camera.length === 6 && camera.every(Number.isFinite) ? camera : null, top: Boolean(parts.get("top")), split: Boolean(parts.get("split")),
    since: number("since"), selected: parts.get("sel"), at: number("t") };
}

/** Calls `use` as soon as `timeKnown`, and `selectedKnown` unless that takes too long. */
export function whenKnown(timeKnown, selectedKnown, use) {
  const wait = setInterval(() => {
    if (!timeKnown() || (!selectedKnown() && performance.now() < kWaitForSelected)) return;
    clearInterval(wait);
    use();
  }, kRestoreEvery);
}
