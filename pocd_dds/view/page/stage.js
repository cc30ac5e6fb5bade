// Camera, controls and frames: what is drawn from where, and where a click leads.
import * as THREE from "./three/build/three.module.js";
import { OrbitControls } from "./three/examples/jsm/controls/OrbitControls.js";
import { context } from "./gl.js";

THREE.Object3D.DefaultUp.set(0, 0, 1);
const kFlight = 650;  // [ms]
const kDataFrame = 80;  // between frames that show new data only [ms]
const kSlow = 100;      // a frame that takes longer is too slow for a flight [ms]
const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

export class Stage {
  /** `frame(camera, rect)` is called before each frame is drawn, once, or once per half. */
  constructor() {
    const { canvas, gl, software } = context();
    this.canvas = canvas;
    this.gl = gl;
    this.software = software;
    this.renderer = new THREE.WebGLRenderer({ canvas, context: gl });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, software ? 1 : 2));
    this.renderer.autoClear = false;
    this.renderer.debug.checkShaderErrors = false;  // to ask is to wait for the graphics
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.1, 2000);
    this.camera.position.set(-9, -9, 10);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enableKeys: false, screenSpacePanning: false, maxPolarAngle: 1.54, minDistance: 0.5, maxDistance: 900,
      zoomSpeed: 1.1, rotateSpeed: 0.7 });
    this.controls.addEventListener("change", () => this.ask());
    this.controls.addEventListener("start", () => {
      this.touched = true;
      this.flight = null;
    });
    this.touched = false;  // a person has moved the camera
    this.split = false;
    this.asked = true;
    this.askedSoon = false;
    this.drawnAt = 0;
    this.cost = 0;         // of the last frame, until it was really drawn [ms]
    this.underWay = null;  // a fence behind the frame that is being drawn
    this.finished = [];    // called when a frame was really drawn
    this.before = [];      // called before a frame; true: another frame is wanted
    this.halves = [];      // called with "whole", "left" or "right" before that part is drawn
    this.after = [];
    this.resizers = [];
    this.top = false;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    requestAnimationFrame((now) => this.frame(now));
  }

  /** A frame as soon as there can be one: the camera moves. */
  ask() { this.asked = true; }
  /** A frame soon: new data, of which a few pictures per second are enough. */
  askSoon() { this.askedSoon = true; }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0 || (width === this.width && height === this.height)) return;
    this.width = width;
    this.height = height;
    this.renderer.setSize(width, height, false);
    this.ask();
  }

  /** Pixels of a length of one metre at a distance of one metre. */
  get focal() { return this.height / 2 / Math.tan(THREE.Math.degToRad(this.camera.fov / 2)); }
  get partWidth() { return this.split ? this.width / 2 : this.width; }

  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    if (document.hidden) return;
    // One frame is under way at most: a slow machine stays usable.
    const ready = this.isDrawn();
    if (ready && this.flight) this.fly(now);
    let more = false;
    for (const step of this.before) more = step(now) || more;
    if (more) this.ask();
    if (!ready) return;
    // New data alone takes half of the time.
    const due = this.askedSoon && performance.now() - this.drawnAt > Math.max(kDataFrame, 2 * this.cost);
    if (!this.asked && !due) return;
    this.asked = false;
    this.askedSoon = false;
    this.drawnAt = performance.now();
    this.camera.aspect = this.partWidth / this.height;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    const parts = this.split ? ["left", "right"] : ["whole"];
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, this.width, this.height);
    this.renderer.clear();
    for (const step of this.resizers) step(this.partWidth, this.height, 1);
    parts.forEach((part, i) => {
      this.renderer.setViewport(i * this.partWidth, 0, this.partWidth, this.height);
      this.renderer.setScissor(i * this.partWidth, 0, this.partWidth, this.height);
      this.renderer.setScissorTest(true);
      for (const step of this.halves) step(part);
      this.renderer.render(this.scene, this.camera);
    });
    for (const step of this.after) step();
    if (this.gl.fenceSync) {
      this.underWay = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      this.gl.flush();
    } else {
      for (const step of this.finished) step();
    }
  }

  /** The last frame is no longer under way. */
  isDrawn() {
    if (!this.underWay) return true;
    if (this.gl.clientWaitSync(this.underWay, 0, 0) === this.gl.TIMEOUT_EXPIRED) return false;
    this.gl.deleteSync(this.underWay);
    this.underWay = null;
    this.cost = performance.now() - this.drawnAt;
    for (const step of this.finished) step();
    return true;
  }

  fly(now) {
    const flight = this.flight;
    flight.start ??= now;
    const t = still || this.cost > kSlow ? 1 : Math.min(1, (now - flight.start) / kFlight);
    const s = t * t * (3 - 2 * t);
    this.camera.position.lerpVectors(flight.fromEye, flight.toEye, s);
    this.controls.target.lerpVectors(flight.fromTarget, flight.toTarget, s);
    this.controls.update();
    this.ask();
    if (t >= 1) this.flight = null;
  }

  flyTo(eye, target) {
    this.flight = { fromEye: this.camera.position.clone(), toEye: eye.clone(), fromTarget: this.controls.target.clone(), toTarget: target.clone() };
    this.ask();
  }

  /** Looks at a place from where the camera is, from about `distance` metres. */
  look(at, distance) {
    const target = new THREE.Vector3(...at);
    const away = this.camera.position.clone().sub(this.controls.target).normalize();
    if (!this.top && away.z < 0.35) away.setZ(0.35).normalize();
    this.flyTo(target.clone().addScaledVector(away, distance), target);
  }

  /** The whole box in the picture. */
  fit(box, at_once = false) {
    const target = box.getCenter(new THREE.Vector3());
    target.z = Math.min(target.z, box.min.z + 1);
    const away = this.top ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(-0.5, -0.72, 0.82).normalize();
    away.normalize();
    // As far as it takes for all corners, and 4 % more.
    const right = new THREE.Vector3(0, 0, 1).cross(away).normalize(), up = away.clone().cross(right);
    const half = Math.tan(THREE.Math.degToRad(this.camera.fov / 2)), aspect = this.partWidth / this.height;
    const ahead = this.top ? new THREE.Vector3(0, 1, 0) : up.clone().setZ(0).normalize();
    let distance = 2;
    for (let turn = 0; turn < 3; ++turn) {
      const corners = Array.from({ length: 8 }, (_, i) => new THREE.Vector3(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z).sub(target));
      distance = Math.max(2, ...corners.map((c) => 1.04 * Math.max(Math.abs(c.dot(right)) / aspect, Math.abs(c.dot(up))) / half + c.dot(away)));
      if (turn === 2) break;
      // What is near looks larger: the middle of the picture is not the middle of the box.
      const middle = (axis) => {
        const seen = corners.map((c) => c.dot(axis) / (distance - c.dot(away)));
        return distance * (Math.max(...seen) + Math.min(...seen)) / 2;
      };
      target.addScaledVector(right, middle(right)).addScaledVector(ahead, middle(up) / ahead.dot(up));
    }
    const eye = target.clone().addScaledVector(away, distance);
    if (!at_once) return this.flyTo(eye, target);
    this.flight = null;
    this.camera.position.copy(eye);
    this.controls.target.copy(target);
    this.controls.update();
    this.ask();
  }

  setTop(top) {
    this.top = top;
    this.controls.enableRotate = !top;
    const target = this.controls.target.clone();
    const distance = this.camera.position.distanceTo(target);
    const away = top ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(-0.5, -0.72, 0.82);
    this.flyTo(target.clone().addScaledVector(away.normalize(), distance), target);
  }

  /** Moves with what has moved from one place to another. */
  follow(from, to) {
    const by = new THREE.Vector3(to[0] - from[0], to[1] - from[1], 0);
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
    this.ask();
  }

  /** An arrow's key moves over the ground, + and - go nearer and farther. */
  step(key) {
    const { target } = this.controls, reach = this.camera.position.distanceTo(target);
    const ahead = target.clone().sub(this.camera.position).setZ(0);
    if (ahead.lengthSq() < 1e-6) ahead.set(0, 1, 0);
    ahead.normalize().multiplyScalar(0.12 * reach);
    const by = { ArrowUp: [ahead.x, ahead.y], ArrowDown: [-ahead.x, -ahead.y], ArrowLeft: [-ahead.y, ahead.x], ArrowRight: [ahead.y, -ahead.x] }[key];
    if (by) return this.follow([0, 0], by);
    this.camera.position.sub(target).multiplyScalar(key === "+" || key === "=" ? 0.8 : 1.25).add(target);
    this.controls.update();
  }

  /** A ray through a point of the canvas, and the part that it lies in. */
  rayAt(clientX, clientY) {
    const rect = this.canvas.getBoundingClientRect();
    const x = clientX - rect.left, part = this.split ? (x < this.partWidth ? "left" : "right") : "whole";
    const inPart = part === "right" ? x - this.partWidth : x;
    const raycaster = new THREE.Raycaster();
    raycaster.setFromCamera({ x: 2 * inPart / this.partWidth - 1, y: 1 - 2 * (clientY - rect.top) / this.height }, this.camera);
    return { raycaster, part };
  }

  /** Pixels of a point [x, y, z] in its part; null when it is behind the camera. */
  project(point) {
    const p = new THREE.Vector3(...point).applyMatrix4(this.camera.matrixWorldInverse);
    if (p.z > -this.camera.near) return null;
    const distance = p.length();
    p.applyMatrix4(this.camera.projectionMatrix);
    return { x: (p.x + 1) / 2 * this.partWidth, y: (1 - p.y) / 2 * this.height, distance, inside: Math.abs(p.x) < 1 && Math.abs(p.y) < 1 };
  }
}

/** Distance along a ray at which it enters a box [x, y, z, yaw, along, across, up]; null when it misses. */
export function rayBox(ray, [x, y, z, yaw, along, across, up]) {
  const c = Math.cos(yaw), s = Math.sin(yaw);
  const turn = (v) => [c * v.x + s * v.y, -s * v.x + c * v.y, v.z];
  const from = turn({ x: ray.origin.x - x, y: ray.origin.y - y, z: ray.origin.z - z }), to = turn(ray.direction);
  let near = 0, far = Infinity;
  for (const [i, half] of [along / 2, across / 2, up / 2].entries()) {
    if (Math.abs(to[i]) < 1e-9) {
      if (Math.abs(from[i]) > half) return null;
      continue;
    }
    const a = (-half - from[i]) / to[i], b = (half - from[i]) / to[i];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : null;
}
