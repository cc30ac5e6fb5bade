// The surface of the map in chunks: coarse everywhere, fine where the camera is near.
import * as THREE from "./three/build/three.module.js";
import { Buffers, kChunkVoxels, kSteps } from "./buffers.js";

const kTileVoxels = 16, kChunkTiles = 4;
const kPalette = 256;         // side of the texture with one colour per owner
const kWriting = 4 << 20;     // bytes that a frame hands to the graphics, and the surface that goes beyond: a picture comes early, and none takes long
const kPreparing = 8;         // in each turn [ms]
const kCoarseCell = 8;        // voxels between vertices of a coarse surface
const kLargestCell = 3;       // pixels: where it looks larger, the fine surface is wanted
const kLargestOfSoftware = 12;
const coarsePointer = matchMedia("(pointer: coarse)").matches;
const kMostFine = 400, kFewFine = 96;  // chunks
const vertexShader = `
precision highp float;
attribute vec4 position;  // 1/15 voxel in the cell, and the owner's place in the palette
attribute vec2 facing;    // four bytes: the normal (signed), and 1 for an earlier run or what nobody has looked at
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D palette;
varying vec3 world, normal;
varying vec4 owner;
varying float earlier;
void main() {
  vec4 at = modelMatrix * vec4(position.xyz, 1.0);
  world = at.xyz;
  vec2 high = floor(facing / 256.0), low = facing - 256.0 * high;
  normal = vec3(low.x, high.x, low.y);
  normal -= 256.0 * step(127.5, normal);
  earlier = high.y > 0.5 ? 1.0 : 0.0;
  float slot = position.w;
  owner = texture2D(palette, (vec2(mod(slot, 256.0), floor(slot / 256.0)) + 0.5) / 256.0);
  gl_Position = projectionMatrix * viewMatrix * at;
}`;
const fragmentShader = `
precision highp float;
uniform vec3 wall, ground, floorColour, eye;
uniform float cut, dim, reach;
varying vec3 world, normal;
varying vec4 owner;
varying float earlier;
void main() {
  if (world.z > cut) discard;
  vec3 n = normalize(normal);
  vec3 toEye = normalize(eye - world);
  float sun = max(dot(n, normalize(vec3(0.45, 0.3, 0.84))), 0.0);
  float head = max(dot(n, toEye), 0.0);
  float light = 0.5 + 0.32 * sun + 0.26 * head;
  float flat_ = smoothstep(0.75, 0.95, n.z);
  vec3 base = mix(mix(wall, floorColour, flat_), owner.rgb, owner.a * (1.0 - dim));
  if (earlier > 0.5) {
    float stripe = step(0.5, fract((world.x + world.y + world.z) * 3.0));
    base = mix(mix(base, ground, 0.55), ground, 0.35 * stripe);
  }
  float far = smoothstep(0.55 * reach, reach, distance(eye, world));
  gl_FragColor = vec4(mix(base * light, ground, max(0.45 * dim, 0.85 * far)), 1.0);
}`;

const keyOf = (x, y, z) => `${x},${y},${z}`;

class Chunk {
  constructor(x, y, z) {
    // `shown`: what is drawn of it, surface -> its place in the buffers.
    Object.assign(this, { x, y, z, coarse: null, tiles: new Map(), wanted: false, done: false, shown: new Map() });
  }

  /** The surfaces that are to be drawn. One that is shown coarsely waits until all of its tiles are there. */
  get chosen() {
    if (this.wanted && this.tiles.size > 0 && (this.done || !this.coarse)) return [...this.tiles.values()];
    return this.coarse ? [this.coarse] : [];
  }
}

export class Surface {
  /** `wish(list)` asks for the chunks that are wanted finely, nearest first. */
  constructor(scene, wish) {
    this.wish = wish;
    this.group = new THREE.Group();
    scene.add(this.group);
    this.chunks = new Map();
    this.voxel = 0.05;
    this.run = 0;
    this.slots = new Map();  // "run/owner" -> place in the palette
    this.colours = new Uint8Array(4 * kPalette * kPalette);
    this.palette = new THREE.DataTexture(this.colours, kPalette, kPalette, THREE.RGBAFormat);
    this.uniforms = {
      palette: { value: this.palette }, wall: { value: new THREE.Color() }, floorColour: { value: new THREE.Color() },
      ground: { value: new THREE.Color() }, eye: { value: new THREE.Vector3() }, cut: { value: 1e6 }, dim: { value: 0 }, reach: { value: 400 },
    };
    this.material = new THREE.RawShaderMaterial({ uniforms: this.uniforms, vertexShader, fragmentShader, side: THREE.FrontSide });
    this.buffers = new Buffers(this.group, this.material, (mesh, ...corner) => this.place(mesh, corner));
    this.changed = new Set();     // chunks of which something else is to be drawn
    this.sectors = new Map();     // "x/y/z" -> keys of such chunks
    // A triangle without area: the shader is made ready while the first surfaces are on their way.
    const nothing = new THREE.BufferGeometry();
    for (const [name, size] of [["position", 4], ["facing", 2]]) nothing.setAttribute(name, new THREE.BufferAttribute(new Uint16Array(3 * size), size));
    this.first = new THREE.Mesh(nothing, this.material);
    this.first.frustumCulled = false;
    this.group.add(this.first);
    this.lastWish = "";
    this.tileCount = 0;
  }

  get triangles() { return this.buffers.triangles; }

  setTheme(theme) {
    this.uniforms.wall.value.setHex(theme.wall);
    this.uniforms.floorColour.value.setHex(theme.floor);
    this.uniforms.ground.value.setHex(theme.ground);
  }

  slotOf(run, owner) {
    if (owner === 0) return 0;
    const key = `${run}/${owner}`;
    let slot = this.slots.get(key);
    if (slot === undefined) {
      slot = (this.slots.size % (kPalette * kPalette - 1)) + 1;
      this.slots.set(key, slot);
    }
    return slot;
  }

  /** [r, g, b] for the surface of an object, or null for that of the background. */
  paint(run, owner, rgb) {
    const slot = this.slotOf(run, owner);
    const next = rgb ? [...rgb, 235] : [0, 0, 0, 0];
    if (next.every((value, i) => this.colours[4 * slot + i] === value)) return;
    this.colours.set(next, 4 * slot);
    this.palette.needsUpdate = true;
  }

  setRun(run, voxel) {
    if (voxel > 0 && voxel !== this.voxel) {
      this.voxel = voxel;
      this.buffers.placeAgain();
    }
    if (run === this.run) return;
    this.run = run;
    for (const chunk of this.chunks.values()) this.drawAgain(chunk);
  }

  /** Chunks [x, y, z, last look] of a sector that nobody has looked at since the node was started. */
  useLooks({ sector, not_looked_at: list }) {
    const keys = new Map(list.map(([x, y, z, stamp]) => [keyOf(x, y, z), stamp]));
    const before = this.sectors.get(sector) ?? new Map();
    this.sectors.set(sector, keys);
    for (const key of new Set([...keys.keys(), ...before.keys()])) {
      if (keys.has(key) !== before.has(key) && this.chunks.has(key)) this.drawAgain(this.chunks.get(key));
    }
  }

  /** Stamp of the last look at a chunk that nobody has looked at since the restart; undefined for others. */
  lastLook(chunk) {
    const sector = [chunk.x, chunk.y, chunk.z].map((v) => v >> 3).join("/");
    return this.sectors.get(sector)?.get(keyOf(chunk.x, chunk.y, chunk.z));
  }

  /** All of it, in the next frames: it looks different. */
  drawAgain(chunk) {
    chunk.again = true;
    this.changed.add(chunk);
  }

  end() {
    this.clear();
    this.group.parent.remove(this.group);
    this.palette.dispose();
  }

  clear() {
    this.sectors.clear();
    for (const chunk of this.chunks.values()) for (const place of chunk.shown.values()) this.buffers.remove(place);
    this.chunks.clear();
    this.changed.clear();
    this.tileCount = 0;
  }

  chunk(x, y, z) {
    const key = keyOf(x, y, z);
    if (!this.chunks.has(key)) this.chunks.set(key, new Chunk(x, y, z));
    return this.chunks.get(key);
  }

  use({ kind, x, y, z, run, surface }) {
    const [cx, cy, cz] = kind === "tile" ? [x, y, z].map((v) => Math.floor(v / kChunkTiles)) : [x, y, z];
    const chunk = this.chunk(cx, cy, cz);
    if (kind === "chunk") {
      chunk.coarse = surface ? { surface, run, offset: [0, 0, 0] } : null;
    } else if (kind === "tile") {
      chunk.wanted = true;  // it was asked for; what is not wanted any more goes with the next choice
      const key = keyOf(x, y, z);
      this.tileCount -= chunk.tiles.has(key) ? 1 : 0;
      if (surface) {
        const offset = [x - kChunkTiles * cx, y - kChunkTiles * cy, z - kChunkTiles * cz].map((tiles) => tiles * kTileVoxels * kSteps);
        chunk.tiles.set(key, { surface, run, offset });
        this.tileCount += 1;
      } else {
        chunk.tiles.delete(key);
      }
    } else if (kind === "done") {
      chunk.done = chunk.wanted;
    }
    this.changed.add(chunk);
  }

  /** Draws of a chunk what is to be drawn of it; what is drawn already stays. True when something is different. */
  draw(chunk) {
    const chosen = new Set(chunk.chosen), before = chunk.shown.size;
    let changes = 0;
    for (const [part, place] of chunk.shown) {
      if (chosen.has(part) && !chunk.again) continue;
      this.buffers.remove(place);
      chunk.shown.delete(part);
      ++changes;
    }
    chunk.again = false;
    const unlooked = this.lastLook(chunk) !== undefined;
    for (const part of chosen) {
      if (chunk.shown.has(part)) continue;
      const slots = Array.from(part.surface.owners, (owner) => this.slotOf(part.run, owner));
      chunk.shown.set(part, this.buffers.put(chunk, part.surface, part.offset, slots, unlooked || part.run !== this.run));
      ++changes;
    }
    if (before === 0 && changes > 0) this.group.remove(this.first);
    return changes > 0;
  }

  place(mesh, corner) {
    mesh.scale.setScalar(this.voxel / kSteps);
    mesh.position.set(...corner).multiplyScalar(kChunkVoxels).addScalar(0.5).multiplyScalar(this.voxel);
    mesh.updateMatrixWorld(true);
  }

  centre(chunk) {
    return new THREE.Vector3(chunk.x, chunk.y, chunk.z).addScalar(0.5).multiplyScalar(kChunkVoxels * this.voxel);
  }

  /**
   * Asks for the chunks finely whose coarse surface would look coarse, the nearest ones first, and forgets the tiles of the others.
   * `focal`: pixels of a metre at a distance of a metre; `software`: the processor draws, and less of it.
   */
  chooseDetail(eye, target, focal, software) {
    const reach = kCoarseCell * this.voxel * focal / (software ? kLargestOfSoftware : kLargestCell) + kChunkVoxels * this.voxel;
    const sorted = [...this.chunks.values()].map((chunk) => {
      const c = this.centre(chunk), far = c.distanceTo(eye);
      return [Math.min(far, c.distanceTo(target)), chunk, far];
    }).filter(([, , far]) => far < reach).sort((a, b) => a[0] - b[0]);
    const wanted = sorted.slice(0, coarsePointer || software ? kFewFine : kMostFine).map(([, chunk]) => chunk);
    const set = new Set(wanted);
    for (const chunk of this.chunks.values()) {
      if (chunk.wanted && !set.has(chunk)) {
        this.tileCount -= chunk.tiles.size;
        chunk.tiles.clear();
        chunk.done = false;
        this.changed.add(chunk);
      }
      chunk.wanted = set.has(chunk);
    }
    const list = wanted.map((chunk) => [chunk.x, chunk.y, chunk.z]);
    const text = JSON.stringify([...list].sort());
    if (text === this.lastWish) return;
    this.lastWish = text;
    this.wish(list);
  }

  /** Called again and again until `drawn`, before each frame; true when something has changed, and a frame is wanted. */
  update(eye, reach) {
    this.uniforms.eye.value.copy(eye);
    this.uniforms.reach.value = reach;
    let different = false;
    if (this.changed.size === 0) return false;
    const start = performance.now(), next = [];
    for (const chunk of this.changed) for (const part of chunk.chosen) if (!chunk.shown.has(part)) next.push([chunk, part.surface]);
    this.buffers.expect(next);
    for (const chunk of this.changed) {
      if (this.buffers.waiting >= kWriting || performance.now() - start > kPreparing) break;
      this.changed.delete(chunk);
      different = this.draw(chunk) || different;
    }
    return different;
  }

  /** A frame was drawn; true when it shows something else than the one before. */
  drawn() { return this.buffers.drawn(); }

  /** Bounds of what is there; null when there is nothing. */
  bounds() {
    const box = new THREE.Box3();
    for (const chunk of this.chunks.values()) {
      for (const part of chunk.coarse ? [chunk.coarse] : chunk.tiles.values()) box.union(this.boxOf(chunk, part));
    }
    return box.isEmpty() ? null : box;
  }

  boxOf(chunk, part) {
    if (!part.extent) {
      const words = new Uint16Array(part.surface.bytes.buffer), low = [65535, 65535, 65535], high = [0, 0, 0];
      for (let w = 0; w < words.length; w += 6) {
        for (let i = 0; i < 3; ++i) {
          if (words[w + i] < low[i]) low[i] = words[w + i];
          if (words[w + i] > high[i]) high[i] = words[w + i];
        }
      }
      part.extent = { low, high };
    }
    const metres = (corner) => new THREE.Vector3(...corner.map((v, i) => this.metres(chunk, part, v, i)));
    return new THREE.Box3(metres(part.extent.low), metres(part.extent.high));
  }

  /** A vertex' coordinate along an axis [m]. */
  metres(chunk, part, value, axis) {
    return this.voxel * ([chunk.x, chunk.y, chunk.z][axis] * kChunkVoxels + 0.5 + (value + part.offset[axis]) / kSteps);
  }

  /** The first point of the surface, below the cut, that the ray meets; null when there is none. */
  hit({ ray }) {
    const cut = this.uniforms.cut.value, points = [0, 1, 2].map(() => new THREE.Vector3()), found = new THREE.Vector3();
    let nearest = Infinity, best = null;
    for (const chunk of this.chunks.values()) {
      for (const part of chunk.shown.keys()) {
        if (!ray.intersectsBox(this.boxOf(chunk, part))) continue;
        const words = new Uint16Array(part.surface.bytes.buffer), { index } = part.surface;
        for (let i = 0; i < index.length; i += 3) {
          points.forEach((point, k) => point.set(...[0, 1, 2].map((axis) => this.metres(chunk, part, words[6 * index[i + k] + axis], axis))));
          if (!ray.intersectTriangle(...points, true, found) || found.z > cut) continue;
          const far = found.distanceToSquared(ray.origin);
          if (far < nearest) [nearest, best] = [far, found.clone()];
        }
      }
    }
    return best;
  }

  dim(share) { this.uniforms.dim.value = share; }
  cutAbove(z) { this.uniforms.cut.value = z; }
}

