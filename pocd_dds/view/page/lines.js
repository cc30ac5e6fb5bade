// Lines of a width in pixels, whole or dashed: WebGL's own are one pixel wide everywhere.
import * as THREE from "./three/build/three.module.js";

const vertexShader = `
precision highp float;
attribute vec3 position, other;
attribute vec4 colour;
attribute vec4 shape;  // side (-1, 1), which end (0, 1), width in pixels, length of a dash [m] or 0
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec2 size;
uniform float pixels;
varying vec4 tint;
varying vec2 dash;
void main() {
  vec4 here = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  vec4 there = projectionMatrix * modelViewMatrix * vec4(other, 1.0);
  // An end behind the eye is moved to where the line comes into view.
  float near = 0.02;
  if (here.w < near && there.w > near) here = mix(here, there, (near - here.w) / (there.w - here.w));
  if (there.w < near && here.w > near) there = mix(there, here, (near - there.w) / (here.w - there.w));
  vec2 along = (there.xy / there.w - here.xy / here.w) * size;
  if (shape.y > 0.5) along = -along;
  float length_ = max(length(along), 1e-4);
  vec2 across = vec2(-along.y, along.x) / length_;
  here.xy += across * shape.x * shape.z * pixels / size * here.w;
  here.z -= 0.0004 * here.w;  // before the surface that it lies on
  tint = colour;
  dash = vec2(shape.y * distance(position, other), shape.w);
  gl_Position = here;
}`;
const fragmentShader = `
precision highp float;
varying vec4 tint;
varying vec2 dash;
void main() {
  if (dash.y > 0.0 && fract(dash.x / dash.y) > 0.58) discard;
  gl_FragColor = tint;
}`;

export class Lines {
  constructor(parent, onTop = false) {
    this.uniforms = { size: { value: new THREE.Vector2(1, 1) }, pixels: { value: 1 } };
    this.material = new THREE.RawShaderMaterial({ uniforms: this.uniforms, vertexShader, fragmentShader, transparent: true,
      depthTest: !onTop, depthWrite: false, side: THREE.DoubleSide });
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = onTop ? 3 : 2;
    this.mesh.visible = false;
    parent.add(this.mesh);
    this.begin();
  }

  resize(width, height, pixels) {
    this.uniforms.size.value.set(width, height);
    this.uniforms.pixels.value = pixels;
  }

  begin() { this.segments = []; }

  /** From a to b ([x, y, z]); rgb in [0, 255]; `dash` in metres, 0 for a whole line. */
  add(a, b, rgb, width = 1.5, alpha = 1, dash = 0) { this.segments.push([a, b, rgb, width, alpha, dash]); }

  end() {
    const count = this.segments.length;
    this.mesh.visible = count > 0;
    if (count === 0) return;
    const position = new Float32Array(12 * count), other = new Float32Array(12 * count);
    const colour = new Float32Array(16 * count), shape = new Float32Array(16 * count);
    const index = new Uint32Array(6 * count);
    this.segments.forEach(([a, b, rgb, width, alpha, dash], s) => {
      for (let corner = 0; corner < 4; ++corner) {
        const v = 4 * s + corner, end = corner >> 1;
        position.set(end ? b : a, 3 * v);
        other.set(end ? a : b, 3 * v);
        colour.set([rgb[0] / 255, rgb[1] / 255, rgb[2] / 255, alpha], 4 * v);
        shape.set([corner & 1 ? 1 : -1, end, width, dash], 4 * v);
      }
      index.set([0, 1, 2, 2, 1, 3].map((i) => 4 * s + i), 6 * s);
    });
    this.mesh.geometry.dispose();
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("other", new THREE.BufferAttribute(other, 3));
    geometry.setAttribute("colour", new THREE.BufferAttribute(colour, 4));
    geometry.setAttribute("shape", new THREE.BufferAttribute(shape, 4));
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    this.mesh.geometry = geometry;
  }
}

/** The twelve edges of a box [x, y, z, yaw, along, across, up]. */
export function boxEdges(box) {
  const corners = boxCorners(box);
  return [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]]
    .map(([i, j]) => [corners[i], corners[j]]);
}

export function boxCorners([x, y, z, yaw, along, across, up]) {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  const corners = [];
  for (let i = 0; i < 8; ++i) {
    const a = ((i & 1) - 0.5) * along, b = ((i >> 1 & 1) - 0.5) * across, h = ((i >> 2) - 0.5) * up;
    corners.push([x + c * a - s * b, y + s * a + c * b, z + h]);
  }
  return corners;
}

/** How high the arrow from a to b rises over both [m]. */
export const arrowRise = (a, b) => Math.min(0.5 * Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]), 1.2);

/** An arc from a to b that ends in an arrow's head, as segments. */
export function arrow(a, b) {
  const reach = Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
  if (reach < 1e-3) return [];
  const points = [], steps = 16, rise = arrowRise(a, b);
  for (let i = 0; i <= steps; ++i) {
    const t = i / steps;
    points.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]) + 4 * t * (1 - t) * rise]);
  }
  const segments = points.slice(1).map((p, i) => [points[i], p]);
  const tip = points[steps], tail = points[steps - 3];
  const d = [tip[0] - tail[0], tip[1] - tail[1], tip[2] - tail[2]];
  const length = Math.hypot(...d), head = Math.min(0.3, 0.45 * reach);
  const side = Math.hypot(d[0], d[1]) > 1e-6 ? [-d[1], d[0]] : [1, 0];
  const norm = Math.hypot(...side);
  for (const sign of [-1, 1]) {
    const wing = [0, 1, 2].map((i) => tip[i] - head * d[i] / length + (i < 2 ? sign * 0.55 * head * side[i] / norm : 0));
    segments.push([tip, wing]);
  }
  return segments;
}
