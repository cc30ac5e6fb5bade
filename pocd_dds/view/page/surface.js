// The surface of the map in chunks: coarse everywhere, fine where the camera is near.
import * as THREE from "./three/build/three.module.js";

const kSteps = 15, kTileVoxels = 16, kChunkTiles = 4;
const kChunkVoxels = kTileVoxels * kChunkTiles;
const kPalette = 256;         // side of the texture with one colour per owner
const kRebuilding = 8;        // in each frame [ms]
const kCoarseCell = 8;        // voxels between vertices of a coarse surface
const kLargestCell = 3;       // pixels: where it looks larger, the fine surface is wanted
const kLargestOfSoftware = 12;
const coarsePointer = matchMedia("(pointer: coarse)").matches;
const kMostFine = 400, kFewFine = 96;  // chunks
const kSphere = new THREE.Sphere(new THREE.Vector3().setScalar(kSteps * kChunkVoxels / 2), kSteps * kChunkVoxels);

const vertexShader = `
precision highp float;
attribute vec4 position;  // 1/15 voxel in the chunk, and the owner's place in the palette
attribute vec4 normal;    // w > 0: from an earlier run
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D palette;
varying vec3 world, facing;
varying vec4 owner;
varying float earlier;
void main() {
  vec4 at = modelMatrix * vec4(position.xyz, 1.0);
  world = at.xyz;
  facing = normal.xyz;
  earlier = normal.w > 0.001 ? 1.0 : 0.0;
  float slot = position.w;
  owner = texture2D(palette, (vec2(mod(slot, 256.0), floor(slot / 256.0)) + 0.5) / 256.0);
  gl_Position = projectionMatrix * viewMatrix * at;
}`;
const fragmentShader = `
precision highp float;
uniform vec3 wall, ground, floorColour, eye;
uniform float cut, dim, reach, unlooked;
varying vec3 world, facing;
varying vec4 owner;
varying float earlier;
void main() {
  if (world.z > cut) discard;
  vec3 n = normalize(facing);
  vec3 toEye = normalize(eye - world);
  float sun = max(dot(n, normalize(vec3(0.45, 0.3, 0.84))), 0.0);
  float head = max(dot(n, toEye), 0.0);
  float light = 0.5 + 0.32 * sun + 0.26 * head;
  float flat_ = smoothstep(0.75, 0.95, n.z);
  vec3 base = mix(mix(wall, floorColour, flat_), owner.rgb, owner.a * (1.0 - dim));
  if (earlier + unlooked > 0.5) {
    float stripe = step(0.5, fract((world.x + world.y + world.z) * 3.0));
    base = mix(mix(base, ground, 0.55), ground, 0.35 * stripe);
  }
  float far = smoothstep(0.55 * reach, reach, distance(eye, world));
  gl_FragColor = vec4(mix(base * light, ground, max(0.45 * dim, 0.85 * far)), 1.0);
}`;

const keyOf = (x, y, z) => `${x},${y},${z}`;

class Chunk {
  constructor(x, y, z) {
    Object.assign(this, { x, y, z, coarse: null, tiles: new Map(), fine: null, wanted: false, done: false, dirty: false });
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
    const material = (unlooked) => new THREE.RawShaderMaterial({ uniforms: { ...this.uniforms, unlooked: { value: unlooked } }, vertexShader, fragmentShader, side: THREE.FrontSide });
    this.material = material(0);
    this.unlooked = material(1);  // of chunks that nobody has looked at since the restart
    this.sectors = new Map();     // "x/y/z" -> keys of such chunks
    // A triangle without area: the shader is made ready while the first surfaces are on their way.
    const nothing = new THREE.BufferGeometry();
    for (const name of ["position", "normal"]) nothing.setAttribute(name, new THREE.BufferAttribute(new Float32Array(12), 4));
    this.first = new THREE.Mesh(nothing, this.material);
    this.first.frustumCulled = false;
    this.group.add(this.first);
    this.lastWish = "";
    this.tileCount = 0;
    this.triangles = 0;
  }

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
      for (const chunk of this.chunks.values()) this.place(chunk);
    }
    if (run === this.run) return;
    this.run = run;
    for (const chunk of this.chunks.values()) chunk.dirty = true;
  }

  /** Chunks [x, y, z, last look] of a sector that nobody has looked at since the node was started. */
  useLooks({ sector, not_looked_at: list }) {
    const keys = new Map(list.map(([x, y, z, stamp]) => [keyOf(x, y, z), stamp]));
    const changed = new Set([...keys.keys(), ...(this.sectors.get(sector)?.keys() ?? [])]);
    this.sectors.set(sector, keys);
    for (const key of changed) if (this.chunks.has(key)) this.dress(this.chunks.get(key));
  }

  /** Stamp of the last look at a chunk that nobody has looked at since the restart; undefined for others. */
  lastLook(chunk) {
    const sector = [chunk.x, chunk.y, chunk.z].map((v) => v >> 3).join("/");
    return this.sectors.get(sector)?.get(keyOf(chunk.x, chunk.y, chunk.z));
  }

  dress(chunk) {
    const material = this.lastLook(chunk) === undefined ? this.material : this.unlooked;
    for (const mesh of [chunk.coarse, chunk.fine]) if (mesh) mesh.material = material;
  }

  end() {
    this.clear();
    this.group.parent.remove(this.group);
    this.palette.dispose();
  }

  clear() {
    this.sectors.clear();
    for (const chunk of this.chunks.values()) {
      this.show(chunk, "coarse", null);
      this.show(chunk, "fine", null);
    }
    this.chunks.clear();
    this.tileCount = 0;
  }

  chunk(x, y, z) {
    const key = keyOf(x, y, z);
    if (!this.chunks.has(key)) this.chunks.set(key, new Chunk(x, y, z));
    return this.chunks.get(key);
  }

  use(piece) {
    if (piece.kind === "chunk") {
      const chunk = this.chunk(piece.x, piece.y, piece.z);
      this.show(chunk, "coarse", piece.surface ? this.merged([{ ...piece, dx: 0, dy: 0, dz: 0 }]) : null);
    } else if (piece.kind === "tile") {
      const [cx, cy, cz] = [piece.x, piece.y, piece.z].map((v) => Math.floor(v / kChunkTiles));
      const chunk = this.chunk(cx, cy, cz);
      chunk.wanted = true;  // it was asked for; what is not wanted any more goes with the next choice
      const key = keyOf(piece.x, piece.y, piece.z);
      this.tileCount -= chunk.tiles.has(key) ? 1 : 0;
      if (piece.surface) {
        chunk.tiles.set(key, { ...piece, dx: piece.x - 4 * cx, dy: piece.y - 4 * cy, dz: piece.z - 4 * cz });
        this.tileCount += 1;
      } else {
        chunk.tiles.delete(key);
      }
      chunk.dirty = true;
    } else if (piece.kind === "done") {
      const chunk = this.chunk(piece.x, piece.y, piece.z);
      chunk.done = chunk.wanted;
    }
  }

  /** One geometry of several surfaces; owners become places in the palette. */
  merged(parts) {
    let vertices = 0, indices = 0;
    for (const { surface } of parts) {
      vertices += surface.vertices;
      indices += surface.index.length;
    }
    const position = new Uint16Array(4 * vertices), normal = new Int8Array(4 * vertices);
    const index = vertices > 65535 ? new Uint32Array(indices) : new Uint16Array(indices);
    const box = new THREE.Box3(), corner = new THREE.Vector3();
    let v = 0, i = 0;
    for (const { surface, run, dx, dy, dz } of parts) {
      const slots = [...surface.owners].map((owner) => this.slotOf(run, owner));
      const words = new Uint16Array(surface.bytes.buffer), bytes = new Int8Array(surface.bytes.buffer);
      const [ox, oy, oz] = [dx, dy, dz].map((tiles) => tiles * kTileVoxels * kSteps);
      const old = run !== this.run ? 1 : 0;
      for (let n = 0; n < surface.vertices; ++n) {
        const to = 4 * (v + n), from = 6 * n;
        position[to] = words[from] + ox;
        position[to + 1] = words[from + 1] + oy;
        position[to + 2] = words[from + 2] + oz;
        position[to + 3] = slots[words[from + 3]] ?? 0;
        box.expandByPoint(corner.set(position[to], position[to + 1], position[to + 2]));
        normal[to] = bytes[12 * n + 8];
        normal[to + 1] = bytes[12 * n + 9];
        normal[to + 2] = bytes[12 * n + 10];
        normal[to + 3] = old || bytes[12 * n + 11] ? 127 : 0;
      }
      for (let n = 0; n < surface.index.length; ++n) index[i + n] = surface.index[n] + v;
      v += surface.vertices;
      i += surface.index.length;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 4));
    geometry.setAttribute("normal", new THREE.BufferAttribute(normal, 4, true));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    geometry.boundingBox = box;
    geometry.boundingSphere = kSphere;
    return geometry;
  }

  show(chunk, level, geometry) {
    if (chunk[level]) {
      this.group.remove(chunk[level]);
      this.triangles -= chunk[level].geometry.index.count / 3;
      chunk[level].geometry.dispose();
      chunk[level] = null;
    }
    if (geometry) {
      this.group.remove(this.first);
      chunk[level] = new THREE.Mesh(geometry, this.material);
      this.triangles += geometry.index.count / 3;
      this.group.add(chunk[level]);
      this.dress(chunk);
      this.place(chunk);
    }
    this.choose(chunk);
  }

  choose(chunk) {
    const fine = chunk.wanted && chunk.fine && (chunk.done || !chunk.coarse);
    if (chunk.fine) chunk.fine.visible = Boolean(fine);
    if (chunk.coarse) chunk.coarse.visible = !fine;
  }

  place(chunk) {
    for (const mesh of [chunk.coarse, chunk.fine]) {
      if (!mesh) continue;
      mesh.scale.setScalar(this.voxel / kSteps);
      mesh.position.set(chunk.x, chunk.y, chunk.z).multiplyScalar(kChunkVoxels).addScalar(0.5).multiplyScalar(this.voxel);
      mesh.updateMatrixWorld(true);
    }
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
        chunk.done = chunk.dirty = false;
        chunk.wanted = false;
        this.show(chunk, "fine", null);
      }
      chunk.wanted = set.has(chunk);
    }
    const list = wanted.map((chunk) => [chunk.x, chunk.y, chunk.z]);
    const text = JSON.stringify([...list].sort());
    if (text === this.lastWish) return;
    this.lastWish = text;
    this.wish(list);
  }

  /** Called before each frame; true when something has changed. */
  update(eye, reach) {
    this.uniforms.eye.value.copy(eye);
    this.uniforms.reach.value = reach;
    let rebuilt = 0;
    const start = performance.now();
    for (const chunk of this.chunks.values()) {
      // One that is shown coarsely waits until all of its tiles are there.
      if (!chunk.dirty || (chunk.coarse && !chunk.done && !chunk.fine)) continue;
      if (performance.now() - start > kRebuilding) break;
      chunk.dirty = false;
      ++rebuilt;
      const parts = [...chunk.tiles.values()];
      this.show(chunk, "fine", parts.length > 0 ? this.merged(parts) : null);
    }
    for (const chunk of this.chunks.values()) this.choose(chunk);
    return rebuilt > 0;
  }

  /** Bounds of what is there; null when there is nothing. */
  bounds() {
    const box = new THREE.Box3();
    for (const chunk of this.chunks.values()) {
      for (const mesh of [chunk.coarse, chunk.fine]) {
        if (!mesh) continue;
        box.union(mesh.geometry.boundingBox.clone().applyMatrix4(mesh.matrixWorld));
      }
    }
    return box.isEmpty() ? null : box;
  }

  /** The first point of the surface, below the cut, that the ray meets; null when there is none. */
  hit(raycaster) {
    const meshes = this.group.children.filter((mesh) => mesh.visible);
    const cut = this.uniforms.cut.value;
    const found = raycaster.intersectObjects(meshes).find((one) => one.point.z <= cut);
    return found ? found.point : null;
  }

  dim(share) { this.uniforms.dim.value = share; }
  cutAbove(z) { this.uniforms.cut.value = z; }
}

