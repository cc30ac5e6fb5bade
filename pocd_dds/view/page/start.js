// The first picture of the map, and when it was there.

const kBarsAtLast = 1000;  // after the scripts were read: there may be no map [ms]

export class Start {
  constructor(stage, surface) {
    // When the first picture with a map was there, when the last one with a new surface, and when that surface came [ms]; triangles of the first one.
    this.times = { first: null, whole: null, last: null, firstTriangles: null };
    let shows = null;  // triangles of the frame that is under way, if it shows a surface that the one before did not
    stage.after.push(() => { shows = surface.drawn() ? surface.triangles : null; });
    stage.finished.push(() => {
      if (shows === null) return;
      this.times.whole = performance.now();
      if (this.times.first !== null) return;
      this.times.first = this.times.whole;
      this.times.firstTriangles = shows;
      this.showBars();
    });
    // Where the processor draws, bars and names would take its time from the map: they come with its first picture. What is seen already stays.
    if (!stage.software || performance.getEntriesByType("paint").length > 0) return;
    document.documentElement.classList.add("starting");
    setTimeout(() => this.showBars(), kBarsAtLast);
  }

  showBars() { document.documentElement.classList.remove("starting"); }
}
