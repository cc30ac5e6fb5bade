// What the page's buffers draw, checked in the page itself: after any order of surfaces that come, change and go, the graphics' copies
// hold exactly the triangles of those that are there, and a frame hands over a bounded piece.
"use strict";

/** {wrong, frames, most, bound, drawn}: run in the page. `wrong` is empty when what is drawn is what was put. */
async function checkBuffers() {
  const THREE = await import("./three/build/three.module.js");
  const { Buffers } = await import("./buffers.js");
  const { Surface } = await import("./surface.js");
  let seed = 7;
  const random = (below) => {
    seed = (Math.imul(seed, 1103515245) + 12345) & 0x7fffffff;
    return (seed >> 8) % below;
  };
  const surfaceOf = (vertices, triangles) => {
    const words = Uint16Array.from({ length: 6 * vertices }, (_, i) => [random(900), random(900), random(900), 0, random(65536), random(256)][i % 6]);
    // No triangle of them is without area.
    const index = Uint16Array.from({ length: 3 * triangles }, (_, i) => (Math.floor(i / 3) % (vertices - 2)) + i % 3);
    return { vertices, owners: new Uint32Array([3]), bytes: new Uint8Array(words.buffer), index };
  };

  const copies = new Map();  // what the graphics have: three.js writes a new attribute whole, and of another one its range
  const upload = (attribute) => {
    const known = copies.get(attribute), { offset, count } = attribute.updateRange;
    if (!known) copies.set(attribute, attribute.array.slice());
    else if (count >= 0) known.set(attribute.array.subarray(offset, offset + count), offset);
  };
  const frame = (buffers) => {
    const bytes = buffers.waiting;
    for (const buffer of buffers.unwritten) for (const attribute of [buffer.data, buffer.mesh.geometry.index]) upload(attribute);
    buffers.drawn();
    return bytes;
  };
  const corner = (words, v, origin) => [0, 1, 2].map((i) => words[6 * v + i] + 960 * origin[i]).concat(words[6 * v + 3], words[6 * v + 4], words[6 * v + 5]).join();
  const drawn = (buffers) => {
    const found = [];
    for (const buffer of [...buffers.cells.values()].flat()) {
      const words = copies.get(buffer.data), index = copies.get(buffer.mesh.geometry.index);
      for (let i = 0; i < buffer.mesh.geometry.drawRange.count; i += 3) {
        if (index[i] === index[i + 1]) continue;
        found.push([0, 1, 2].map((k) => corner(words, index[i + k], buffer.corner)).join(" "));
      }
    }
    return found.sort().join("\n");
  };
  const expected = (live) => live.flatMap(({ chunk, surface, slot, striped }) => {
    const words = new Uint16Array(surface.bytes.slice().buffer), triangles = [];
    for (let v = 0; v < surface.vertices; ++v) {
      words[6 * v + 3] = slot;
      if (striped) words[6 * v + 5] |= 0x100;
    }
    for (let i = 0; i < surface.index.length; i += 3) triangles.push([0, 1, 2].map((k) => corner(words, surface.index[i + k], [chunk.x, chunk.y, chunk.z])).join(" "));
    return triangles;
  }).sort().join("\n");

  const wrong = [];
  const buffers = new Buffers(new THREE.Group(), null, () => {}), live = [];
  for (let step = 0; step < 600 && wrong.length === 0; ++step) {
    if (live.length > 0 && random(5) < 2) {
      buffers.remove(live.splice(random(live.length), 1)[0].place);
    } else {
      const one = { chunk: { x: random(9) - 4, y: random(3) - 1, z: random(2) - 1 }, surface: surfaceOf(3 + random(step === 300 ? 60000 : 900), 1 + random(2000)), slot: random(60000), striped: random(2) === 1 };
      one.place = buffers.put(one.chunk, one.surface, [0, 0, 0], [one.slot], one.striped);
      live.push(one);
    }
    if (random(3) === 0) frame(buffers);
    if (step % 40 !== 39) continue;
    frame(buffers);
    if (drawn(buffers) !== expected(live)) wrong.push(`after ${step + 1} steps`);
  }
  while (live.length > 0) buffers.remove(live.pop().place);
  if ([...buffers.cells.values()].flat().length > 0 || buffers.triangles !== 0) wrong.push("something is left of what has gone");

  // Much at once: as many frames as it takes, each with a bounded piece.
  const scene = new THREE.Group(), surface = new Surface(scene, () => {});
  surface.setRun(1, 0.05);
  for (let i = 0; i < 1500; ++i) surface.use({ kind: "chunk", x: i % 40, y: Math.floor(i / 40), z: 0, run: 1, surface: surfaceOf(800, 1500) });
  let frames = 0, most = 0;
  while (surface.changed.size > 0 && frames < 10000) {
    for (let turn = 0; turn < 20; ++turn) surface.update(new THREE.Vector3(), 100);  // turns in which no frame could be drawn
    most = Math.max(most, frame(surface.buffers));
    ++frames;
  }
  return { wrong, frames, most, drawn: surface.triangles };
}

module.exports = { checkBuffers };
