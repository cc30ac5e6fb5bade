// Objects as they are known, and the drawing of boxes, ghosts and arrows.
import * as THREE from "./three/build/three.module.js";
import { colourOfScore, rgbOf } from "./colours.js";
import { Lines, arrow, arrowRise, boxCorners, boxEdges } from "./lines.js";
import { nameOf } from "./words.js";
import { rayBox } from "./stage.js";

const kGlide = 500;  // a box that moves is seen to move [ms]

/** Faces of boxes, see-through: [[box, rgb, alpha], ...] as one geometry. */
function facesOf(list) {
  const position = new Float32Array(24 * list.length), colour = new Float32Array(32 * list.length);
  const index = [];
  const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  list.forEach(([box, rgb, alpha], b) => {
    boxCorners(box).forEach((corner, i) => {
      position.set(corner, 3 * (8 * b + i));
      colour.set([rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, alpha], 4 * (8 * b + i));
    });
    for (const [p, q, r, s] of quads) index.push(...[p, q, r, p, r, s].map((i) => 8 * b + i));
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
  geometry.setAttribute("colour", new THREE.BufferAttribute(colour, 4));
  geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(index), 1));
  return geometry;
}

/** One picture of objects: the present one, or that of another time. */
export class ObjectLayer {
  constructor(scene) {
    this.group = new THREE.Group();
    scene.add(this.group);
    this.lines = new Lines(this.group);
    this.top = new Lines(this.group, true);
    this.material = new THREE.RawShaderMaterial({
      vertexShader: `attribute vec3 position; attribute vec4 colour; uniform mat4 modelViewMatrix, projectionMatrix; varying lowp vec4 tint;
        void main() { tint = colour; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); gl_Position.z -= 0.0002 * gl_Position.w; }`,
      fragmentShader: "precision mediump float; varying lowp vec4 tint; void main() { gl_FragColor = tint; }",
      transparent: true, depthWrite: false, side: THREE.FrontSide,
    });
    this.faces = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.faces.frustumCulled = false;
    this.faces.renderOrder = 1;
    this.group.add(this.faces);
    this.labels = [];  // {at, text, kind, id}
    this.shown = [];   // {id, box}: what can be clicked
  }

  resize(width, height, pixels) {
    this.lines.resize(width, height, pixels);
    this.top.resize(width, height, pixels);
  }

  /** `objects`: {id, class, number, box, belief, condition}; `changes`: newest event of each changed object. */
  draw(objects, changes, theme, selected) {
    this.lines.begin();
    this.top.begin();
    this.labels = [];
    this.shown = [];
    const faces = [];
    const changed = new Map(changes.map((event) => [event.id, event]));
    const colours = { moved: rgbOf(theme.moved), added: rgbOf(theme.added), ghost: rgbOf(theme.ghost), unknown: rgbOf(theme.unknown), selected: rgbOf(theme.selected) };
    for (const object of objects) {
      const chosen = object.id === selected;
      const unknown = object.condition === "unknown";
      const rgb = unknown ? colours.unknown : colourOfScore(object.belief.v);
      const kind = changed.get(object.id)?.kind;
      const accent = kind === "MOVED" ? colours.moved : kind === "ADDED" ? colours.added : null;
      for (const [a, b] of boxEdges(object.box)) {
        this.lines.add(a, b, chosen ? colours.selected : accent ?? rgb, chosen ? 3.5 : accent ? 2.6 : 1.7, 1, unknown ? 0.14 : 0);
        if (chosen) this.top.add(a, b, colours.selected, 1.2, 0.5);
      }
      faces.push([object.box, rgb, chosen ? 0.34 : unknown ? 0.10 : 0.20]);
      this.shown.push({ id: object.id, box: object.box });
      // Over the arrow of what moved, whose head is on the box.
      const over = kind === "MOVED" ? 0.15 + 1.6 * arrowRise(changed.get(object.id).previous, changed.get(object.id).box) : 0.1;
      this.labels.push({ id: object.id, at: [object.box[0], object.box[1], object.box[2] + object.box[6] / 2 + over],
        text: `${kind ? `${kind.toLowerCase()}: ` : ""}${nameOf(object)}${unknown ? " ?" : ""}`,
        kind: unknown ? "unknown" : kind === "MOVED" ? "moved" : kind === "ADDED" ? "added" : "", rank: chosen ? 0 : kind ? 1 : 2 });
    }
    for (const event of changes) this.ghost(event, colours, selected, faces);
    this.lines.end();
    this.top.end();
    this.faces.geometry.dispose();
    this.faces.geometry = facesOf(faces);
    this.faces.visible = faces.length > 0;
  }

  /** Where it was: of what moved with an arrow to where it is, of what is gone. */
  ghost(event, colours, selected, faces) {
    const box = event.kind === "MOVED" ? event.previous : event.kind === "REMOVED" ? event.box : null;
    if (!box) return;
    const rgb = event.kind === "MOVED" ? colours.moved : colours.ghost;
    for (const [a, b] of boxEdges(box)) this.lines.add(a, b, rgb, event.id === selected ? 3 : 2, 0.95, 0.16);
    if (event.kind === "MOVED") {
      const lift = (b) => [b[0], b[1], b[2] + b[6] / 2 + 0.05];
      for (const [a, b] of arrow(lift(box), lift(event.box))) this.top.add(a, b, rgb, 4);
      return;
    }
    faces.push([box, rgb, 0.10]);
    this.shown.push({ id: event.id, box });
    this.labels.push({ id: event.id, at: [box[0], box[1], box[2] + box[6] / 2 + 0.1], text: `removed: ${nameOf(event)}`, kind: "removed",
      rank: event.id === selected ? 0 : 1 });
  }

  /** The object under a ray, nearer than `limit`; null when there is none. */
  pick(ray, limit) {
    let best = null, nearest = limit;
    for (const { id, box } of this.shown) {
      const distance = rayBox(ray, box);
      if (distance !== null && distance < nearest + 0.15 && (best === null || distance < nearest)) {
        best = id;
        nearest = distance;
      }
    }
    return best;
  }
}

/** What is known: by uuid, with boxes that glide when they move. */
export class ObjectStore {
  constructor() {
    this.clear();
  }

  clear() {
    this.objects = new Map();  // present and unknown
    this.gone = new Map();
    this.gliding = new Map();
  }

  use(json, now) {
    if (json.condition === "gone") {
      this.objects.delete(json.id);
      this.gone.set(json.id, json);
      return;
    }
    const before = this.objects.get(json.id);
    if (before) {
      const shift = Math.hypot(json.box[0] - before.box[0], json.box[1] - before.box[1]);
      if (shift > 0.05) this.gliding.set(json.id, { from: before.box, start: now });
    }
    this.objects.set(json.id, json);
  }

  find(id) { return this.objects.get(id) ?? this.gone.get(id); }

  /** As they are to be drawn now. */
  list(now) {
    return [...this.objects.values()].map((object) => {
      const glide = this.gliding.get(object.id);
      if (!glide) return object;
      const t = Math.min(1, (now - glide.start) / kGlide), s = t * t * (3 - 2 * t);
      if (t >= 1) this.gliding.delete(object.id);
      return { ...object, box: object.box.map((value, i) => i === 3 ? value : glide.from[i] + s * (value - glide.from[i])) };
    });
  }
}
