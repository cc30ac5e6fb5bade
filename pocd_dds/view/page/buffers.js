// Surfaces that are drawn, many in one buffer of the graphics: a cell of the map has few buffers, and what changes is written into its place.
import * as THREE from "./three/build/three.module.js";

export const kSteps = 15, kChunkVoxels = 64;
const kCellChunks = 4;      // along each axis
const kWords = 6;           // of a vertex: place and owner, and two of normal and flag
const kMost = 32768;        // vertices of a buffer; of a surface that has more alone, as many
const kFewest = 512;
const kGrowth = 1.5;
const kRadius = kSteps * kChunkVoxels * kCellChunks * Math.sqrt(3) / 2;

/** The chunk in the corner of a chunk's cell: cells are shifted by half in height, for a floor at 0. */
function cornerOf({ x, y, z }) {
  const down = (v) => kCellChunks * Math.floor(v / kCellChunks), half = kCellChunks / 2;
  return [down(x), down(y), down(z + half) - half];
}

/** Free places of a buffer: the first one that is large enough is taken. */
class Places {
  constructor() { this.free = []; this.size = 0; }

  take(count) {
    const i = this.free.findIndex((place) => place.count >= count);
    if (i < 0) return null;
    const place = this.free[i], at = place.at;
    place.at += count;
    place.count -= count;
    if (place.count === 0) this.free.splice(i, 1);
    return at;
  }

  give(at, count) {
    if (count === 0) return;
    const i = this.free.findIndex((place) => place.at > at), next = i < 0 ? this.free.length : i;
    this.free.splice(next, 0, { at, count });
    for (const k of [next, next - 1]) {
      const here = this.free[k], after = this.free[k + 1];
      if (!here || !after || here.at + here.count !== after.at) continue;
      here.count += after.count;
      this.free.splice(k + 1, 1);
    }
  }

  /** Behind all that are taken. */
  get end() {
    const last = this.free[this.free.length - 1];
    return last && last.at + last.count === this.size ? last.at : this.size;
  }

  grow(size) {
    this.give(this.size, size - this.size);
    this.size = size;
  }
}

/** What has changed of an array since the last frame: one range. */
class Changed {
  constructor() { this.clear(); }
  clear() { this.from = Infinity; this.to = 0; }
  get count() { return Math.max(0, this.to - this.from); }
  add(from, count) {
    this.from = Math.min(this.from, from);
    this.to = Math.max(this.to, from + count);
  }
}

/** One buffer of vertices, one of indices, and the mesh that draws them. Indices of free places are those of triangles without area. */
class Buffer {
  constructor(place, material) {
    this.vertices = new Places();
    this.indices = new Places();
    this.changed = { words: new Changed(), index: new Changed() };
    this.words = new Uint16Array(0);
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    place(this.mesh);
    this.used = 0;  // surfaces
  }

  /** Room for so many: everything is written anew. */
  grow(vertices, indices) {
    const words = new Uint16Array(kWords * vertices), index = vertices > 65536 ? new Uint32Array(indices) : new Uint16Array(indices);
    words.set(this.words);
    if (this.index) index.set(this.index);
    this.words = words;
    this.index = index;
    this.vertices.grow(vertices);
    this.indices.grow(indices);
    this.mesh.geometry.dispose();
    const geometry = new THREE.BufferGeometry();
    this.data = new THREE.InterleavedBuffer(words, kWords);
    geometry.setAttribute("position", new THREE.InterleavedBufferAttribute(this.data, 4, 0));
    geometry.setAttribute("facing", new THREE.InterleavedBufferAttribute(this.data, 2, 4));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    const middle = kSteps * kChunkVoxels * kCellChunks / 2;
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(middle, middle, middle), kRadius);
    this.mesh.geometry = geometry;
    this.changed.words.add(0, words.length);
    this.changed.index.add(0, index.length);
  }

  /** A place for a surface; null when it does not fit. `expected`: {vertices, indices} that come to this cell now, with it. */
  place(vertices, indices, expected) {
    for (;;) {
      const at = this.vertices.take(vertices);
      if (at !== null) {
        const first = this.indices.take(indices);
        if (first !== null) return { at, first };
        this.vertices.give(at, vertices);
      }
      const now = this.vertices.size;
      if (now >= kMost || (now > 0 && now + vertices > kMost)) return null;
      const larger = (size, more, other) => Math.max(Math.ceil(kGrowth * size), size + other, Math.ceil(size + more));
      this.grow(Math.max(vertices, Math.min(kMost, Math.max(kFewest, larger(now, expected.vertices, vertices)))),
        Math.max(4 * kFewest, larger(this.indices.size, expected.indices, indices)));
    }
  }

  get bytes() { return 2 * this.changed.words.count + this.index.BYTES_PER_ELEMENT * this.changed.index.count; }

  /** The next frame writes what has changed. */
  mark() {
    for (const [attribute, changed] of [[this.data, this.changed.words], [this.mesh.geometry.index, this.changed.index]]) {
      if (changed.count === 0) continue;
      Object.assign(attribute.updateRange, { offset: changed.from, count: changed.count });
      attribute.needsUpdate = true;
    }
    this.mesh.geometry.setDrawRange(0, this.indices.end);
    this.mesh.frustumCulled = false;  // also what is not in the picture: it would all come at once when the camera turns
  }

  drawn() {
    this.changed.words.clear();
    this.changed.index.clear();
    this.data.updateRange.count = this.mesh.geometry.index.updateRange.count = -1;
    this.mesh.frustumCulled = true;
  }
}

export class Buffers {
  /** `place(mesh, x, y, z)` puts a mesh whose origin is the corner of that chunk, in 1/15 voxel. */
  constructor(group, material, place) {
    Object.assign(this, { group, material, place });
    this.cells = new Map();      // "x,y,z" -> buffers
    this.unwritten = new Set();  // buffers that have changed since the last frame
    this.expected = new Map();   // "x,y,z" -> {vertices, indices}
    this.triangles = 0;
  }

  /** What comes next, [chunk, surface]: buffers are made large enough at once. */
  expect(list) {
    this.expected.clear();
    for (const [chunk, surface] of list) {
      const key = cornerOf(chunk).join(), sum = this.expected.get(key);
      if (sum) {
        sum.vertices += surface.vertices;
        sum.indices += surface.index.length;
      } else {
        this.expected.set(key, { vertices: surface.vertices, indices: surface.index.length });
      }
    }
  }

  /** Bytes that the next frame writes. */
  get waiting() {
    let bytes = 0;
    for (const buffer of this.unwritten) bytes += buffer.bytes;
    return bytes;
  }

  /**
   * Shows a surface of a chunk. `slots`: places in the palette of its owners; `offset`: of the surface in the chunk [1/15 voxel];
   * `striped`: all of it, not only what the vertices say. Gives back what `remove` takes.
   */
  put({ x, y, z }, surface, offset, slots, striped) {
    const corner = cornerOf({ x, y, z }), key = corner.join();
    const expected = this.expected.get(key) ?? { vertices: 0, indices: 0 };
    if (!this.cells.has(key)) this.cells.set(key, []);
    const buffers = this.cells.get(key);
    let buffer = null, place = null;
    for (buffer of buffers) {
      place = buffer.place(surface.vertices, surface.index.length, expected);
      if (place) break;
    }
    if (!place) {
      buffer = new Buffer((mesh) => this.place(mesh, ...corner), this.material);
      place = buffer.place(surface.vertices, surface.index.length, expected);
      buffer.corner = corner;
      buffers.push(buffer);
      this.group.add(buffer.mesh);
    }
    const { words, index } = buffer, { at, first } = place;
    const from = new Uint16Array(surface.bytes.buffer, surface.bytes.byteOffset, kWords * surface.vertices);
    words.set(from, kWords * at);
    const [ox, oy, oz] = [x, y, z].map((v, i) => (v - corner[i]) * kChunkVoxels * kSteps + offset[i]);
    for (let w = kWords * at, end = w + from.length; w < end; w += kWords) {
      words[w] += ox;
      words[w + 1] += oy;
      words[w + 2] += oz;
      words[w + 3] = slots[words[w + 3]] ?? 0;
      if (striped) words[w + 5] |= 0x100;
    }
    for (let i = 0; i < surface.index.length; ++i) index[first + i] = surface.index[i] + at;
    expected.vertices -= surface.vertices;
    expected.indices -= surface.index.length;
    buffer.changed.words.add(kWords * at, from.length);
    buffer.changed.index.add(first, surface.index.length);
    ++buffer.used;
    this.triangles += surface.index.length / 3;
    this.touch(buffer);
    return { key, buffer, at, first, vertices: surface.vertices, indices: surface.index.length };
  }

  remove({ key, buffer, at, first, vertices, indices }) {
    this.triangles -= indices / 3;
    if (--buffer.used === 0) {
      this.cells.set(key, this.cells.get(key).filter((other) => other !== buffer));
      this.group.remove(buffer.mesh);
      buffer.mesh.geometry.dispose();
      this.unwritten.delete(buffer);
      return;
    }
    buffer.vertices.give(at, vertices);
    buffer.indices.give(first, indices);
    buffer.index.fill(0, first, first + indices);
    buffer.changed.index.add(first, indices);
    this.touch(buffer);
  }

  touch(buffer) {
    buffer.mark();
    this.unwritten.add(buffer);
  }

  /** A frame was drawn: what had changed has been written. True when there was something. */
  drawn() {
    const any = this.unwritten.size > 0;
    for (const buffer of this.unwritten) buffer.drawn();
    this.unwritten.clear();
    return any;
  }

  placeAgain() {
    for (const buffers of this.cells.values()) for (const buffer of buffers) this.place(buffer.mesh, ...buffer.corner);
  }
}
