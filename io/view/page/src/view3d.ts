// SPDX-License-Identifier: Apache-2.0
// The scene in space: environment, part, the hand's ghost, contacts as arrows, the deepest point,
// the net-stiffness ellipsoid, a slice of the field. The world frame is in metres; `root` scales it
// by the scene's size, so that the camera's depth range fits any part.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Packet } from './envelope';
import { floats } from './envelope';
import { css, onTheme, weightColour } from './colours';
import { principalAxes } from './stiffness';

export interface BodyHead {
  name: string;
  fixed: boolean;
  pose: number[];      // p, q (w x y z)
  com: number[];
  origin?: number[];   // of quantised positions [m]
  step?: number;
  modes?: number;      // of a body that bends
  mode_step?: number;
  turn_step?: number;  // where its displacements are warped
}

// The drawn vertices of a body that bends.
interface Bend {
  shape: THREE.BufferGeometry;
  rest: Float32Array;   // (3 n) [m]
  modes: Int16Array;    // (n r 3), in steps of `step`
  count: number;        // r
  step: number;
  turns: Int16Array | null;  // likewise [rad], of a body whose displacements are warped
  turnStep: number;
}

// One vertex: q, from `at` on, times its modes, from `first` on.
function sumModes(modes: Int16Array, first: number, q: Float32Array, at: number, count: number, step: number,
                  out: THREE.Vector3): THREE.Vector3 {
  let x = 0, y = 0, z = 0;
  for (let j = 0, m = first; j < count; ++j, m += 3) {
    const s = q[at + j];
    x += s * modes[m], y += s * modes[m + 1], z += s * modes[m + 2];
  }
  return out.set(step * x, step * y, step * z);
}

// Turns the displacement u by the mean of the rotations up to the turn w (Choi & Ko 2005, Eq. 11).
function warp(u: THREE.Vector3, w: THREE.Vector3) {
  const s = w.lengthSq(), angle = Math.sqrt(s), small = s < 1e-4;
  const a = small ? 1 - s / 6 : Math.sin(angle) / angle;
  const b = small ? 0.5 - s / 24 : (1 - Math.cos(angle)) / s;
  const c = small ? 1 / 6 - s / 120 : (1 - a) / s;
  const along = c * w.dot(u);
  side.crossVectors(w, u);
  u.multiplyScalar(a).addScaledVector(side, b).addScaledVector(w, along);
}
const side = new THREE.Vector3();

export interface Contacts {
  p: Float32Array;  // (3 n) world [m]
  n: Float32Array;
  t: Float32Array;
  w: Float32Array;  // share of the stiffness
  d: Float32Array;  // depth [m]
}

const maxArrows = 2000;

function setPose(object: THREE.Object3D, pose: ArrayLike<number>, at = 0) {
  object.position.set(pose[at], pose[at + 1], pose[at + 2]);
  object.quaternion.set(pose[at + 4], pose[at + 5], pose[at + 6], pose[at + 3]);
}

function arrowShape(): THREE.BufferGeometry {
  // Along +z, tip at 1: a shaft and a head as one lathe.
  const line = [[0, 0], [0.035, 0], [0.035, 0.68], [0.1, 0.68], [0, 1]];
  const shape = new THREE.LatheGeometry(line.map(([x, y]) => new THREE.Vector2(x, y)), 8);
  shape.rotateX(Math.PI / 2);
  return shape;
}

export class View3D {
  readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 100);
  readonly renderer: THREE.WebGLRenderer;
  orbit: OrbitControls;
  readonly root = new THREE.Group();
  readonly bodies: THREE.Group[] = [];
  ghost: THREE.Object3D | null = null;
  hand = -1;                                // the body that the first hand moves
  radius = 1;
  private reach = 1;                        // how long marks are: the scene's radius, or the part's size
  private scene = new THREE.Scene();
  private sky = new THREE.HemisphereLight('#dfe8f5', '#3a3f4a', 1.6);
  private sun = new THREE.DirectionalLight('#ffffff', 1.8);
  private arrows: THREE.InstancedMesh;
  private deepest: THREE.Mesh;
  private crossing: THREE.Mesh;
  private ellipsoid: THREE.Mesh;
  private slice: THREE.Mesh | null = null;
  private environment: THREE.MeshStandardMaterial[] = [];
  private matrix = new THREE.Matrix4();
  private colour = new THREE.Color();
  private heads: BodyHead[] = [];
  private others: THREE.Object3D[] = [];
  private bending: Bend[] = [];
  private centre = new THREE.Vector3();     // of the scene, world [m]
  private up = 'z';
  private seat: THREE.Matrix4 | null = null; // the camera's place, while a headset moves it

  constructor(private where: HTMLElement) {
    try {
      this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    } catch (error) {
      const sentence = document.createElement('p');
      sentence.textContent = 'This browser offers no WebGL, so the parts cannot be drawn here. Allow hardware'
        + ' acceleration, or WebGL by software, in its settings, or use another browser.';
      where.replaceChildren(sentence);  // a legend of nothing would lie over it
      throw error;
    }
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    where.appendChild(this.renderer.domElement);
    this.scene.background = new THREE.Color(css('ground'));
    onTheme(() => { this.scene.background = new THREE.Color(css('ground')); });
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'application');
    canvas.setAttribute('aria-label', 'the parts in space; drag the part, or use arrow keys and page keys; with Shift they turn it');
    this.camera.add(new THREE.DirectionalLight('#ffffff', 0.7));
    this.scene.add(this.sky, this.sun, this.camera, this.root);
    this.arrows = new THREE.InstancedMesh(arrowShape(), new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }), maxArrows);
    this.arrows.frustumCulled = false;
    this.arrows.renderOrder = 5;
    this.arrows.count = 0;
    this.deepest = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12),
      new THREE.MeshBasicMaterial({ color: '#ff3b30', depthTest: false, transparent: true }));
    this.deepest.renderOrder = 6;
    this.deepest.visible = false;
    this.crossing = new THREE.Mesh(new THREE.OctahedronGeometry(1),
      new THREE.MeshBasicMaterial({ color: '#ff4fd8', depthTest: false, transparent: true, wireframe: true }));
    this.crossing.renderOrder = 7;
    this.crossing.visible = false;
    this.ellipsoid = new THREE.Mesh(new THREE.SphereGeometry(1, 24, 16),
      new THREE.MeshBasicMaterial({ color: '#9fe8ff', wireframe: true, transparent: true, opacity: 0.22 }));
    this.ellipsoid.visible = false;
    this.ellipsoid.matrixAutoUpdate = false;
    this.root.add(this.arrows, this.deepest, this.crossing, this.ellipsoid);
    this.orbit = this.controls();
    new ResizeObserver(() => this.resize()).observe(where);
    this.resize();
  }

  // OrbitControls reads the camera's up once, when it is made.
  private controls(): OrbitControls {
    const orbit = new OrbitControls(this.camera, this.renderer.domElement);
    orbit.enableDamping = true;
    return orbit;
  }

  // Turns a direction of a world with z up into the scene's, whose up is another axis.
  private upright(v: THREE.Vector3, up: string): THREE.Vector3 {
    return up === 'y' ? new THREE.Vector3(v.x, v.z, -v.y) : up === 'x' ? new THREE.Vector3(v.z, v.x, v.y) : v;
  }

  load(packet: Packet) {
    this.heads = packet.head.bodies;
    const up = this.up = packet.head.up ?? 'z';
    this.camera.up.copy(this.upright(new THREE.Vector3(0, 0, 1), up));
    this.sun.position.copy(this.upright(new THREE.Vector3(2, -3, 4), up));
    this.sky.position.copy(this.camera.up);
    this.orbit.dispose();
    this.orbit = this.controls();
    this.hand = packet.head.hand_body ?? -1;
    const box = new THREE.Box3(), part = new THREE.Box3();
    this.heads.forEach((head, i) => {
      const group = new THREE.Group();
      setPose(group, head.pose);
      const shape = this.shapeOf(packet, head, i);
      if (shape) {
        const paint = new THREE.MeshStandardMaterial({
          color: head.fixed ? '#8795ab' : '#e08a3c', roughness: 0.65, metalness: 0.1, flatShading: true,
          side: THREE.DoubleSide,
        });
        if (head.fixed) this.environment.push(paint);
        group.add(new THREE.Mesh(shape, paint));
        shape.computeBoundingBox();
        group.updateMatrix();
        const here = shape.boundingBox!.clone().applyMatrix4(group.matrix);
        box.union(here);
        if (i === this.hand) part.union(here);
      } else {
        const points = floats(packet, `points${i}`);
        if (points.length) {
          const cloud = new THREE.BufferGeometry();
          cloud.setAttribute('position', new THREE.BufferAttribute(points, 3));
          group.add(new THREE.Points(cloud, new THREE.PointsMaterial({ color: '#e08a3c', size: 2, sizeAttenuation: false })));
          cloud.computeBoundingBox();
          group.updateMatrix();
          box.union(cloud.boundingBox!.clone().applyMatrix4(group.matrix));
        }
      }
      this.bodies.push(group);
      this.root.add(group);
    });
    const moved = this.bodies[this.hand];
    if (moved) {
      this.ghost = moved.clone();
      this.ghost.traverse((o) => {
        if (o instanceof THREE.Mesh)
          o.material = new THREE.MeshBasicMaterial({ color: '#53d6ff', transparent: true, opacity: 0.16, depthWrite: false, wireframe: o.geometry.index ? o.geometry.index.count < 120000 : false });
      });
      this.root.add(this.ghost);
    }
    if (box.isEmpty()) box.set(new THREE.Vector3(-0.05, -0.05, -0.05), new THREE.Vector3(0.05, 0.05, 0.05));
    this.radius = 0.5 * box.getSize(new THREE.Vector3()).length();
    this.root.scale.setScalar(1 / this.radius);
    box.getCenter(this.centre);
    this.reach = part.isEmpty() ? this.radius : Math.min(this.radius, 0.8 * part.getSize(new THREE.Vector3()).length());
    // Near enough to see the part, far enough to see its surroundings.
    const focus = (part.isEmpty() ? box : part).getCenter(new THREE.Vector3()).divideScalar(this.radius);
    const near = part.isEmpty() ? 1 : Math.max(0.3, 0.7 * part.getSize(new THREE.Vector3()).length() / this.radius);
    this.orbit.target.copy(focus);
    const place = (scale: number) => this.camera.position.copy(focus).add(this.upright(new THREE.Vector3(1.2, -1.9, 1.3), up).multiplyScalar(1.25 * scale));
    place(near);
    if (this.partHidden()) place(1);  // the part is deep inside: look at the whole scene
    this.orbit.update();
  }

  private shapeOf(packet: Packet, head: BodyHead, i: number): THREE.BufferGeometry | null {
    const stored = packet.arrays.get(`position${i}`), index = packet.arrays.get(`index${i}`);
    if (!stored || !index || !head.origin || !head.step) return null;
    const position = new Float32Array(stored.length);
    for (let k = 0; k < stored.length; ++k) position[k] = head.origin[k % 3] + head.step * (stored[k] + 32768);
    const shape = new THREE.BufferGeometry();
    shape.setAttribute('position', new THREE.BufferAttribute(position, 3));
    shape.setIndex(new THREE.BufferAttribute(index, 1));
    const modes = packet.arrays.get(`modes${i}`);
    const turns = packet.arrays.get(`turns${i}`);
    if (modes instanceof Int16Array && head.modes && head.mode_step)
      this.bending.push({
        shape, rest: position.slice(), modes, count: head.modes, step: head.mode_step,
        turns: turns instanceof Int16Array ? turns : null, turnStep: head.turn_step ?? 0 });
    return shape;
  }

  // Bends bodies: `q` has their coordinates from `at` on, one body after another.
  bends(q: Float32Array, at = 0) {
    const u = new THREE.Vector3(), w = new THREE.Vector3();
    for (const { shape, rest, modes, count, step, turns, turnStep } of this.bending) {
      if (at + count > q.length) return;
      const place = shape.getAttribute('position') as THREE.BufferAttribute;
      const out = place.array as Float32Array;
      for (let v = 0; v < rest.length; v += 3) {
        sumModes(modes, v * count, q, at, count, step, u);
        if (turns) warp(u, sumModes(turns, v * count, q, at, count, turnStep, w));
        out[v] = rest[v] + u.x, out[v + 1] = rest[v + 1] + u.y, out[v + 2] = rest[v + 2] + u.z;
      }
      place.needsUpdate = true;
      at += count;
    }
  }

  // How many coordinates all bodies that bend have together.
  bendCount(): number { return this.bending.reduce((sum, b) => sum + b.count, 0); }

  poses(all: Float32Array) {
    this.bodies.forEach((body, i) => { if (7 * i + 6 < all.length) setPose(body, all, 7 * i); });
  }
  handAt(pose: ArrayLike<number>, at = 0) {
    if (this.ghost && pose.length >= at + 7) setPose(this.ghost, pose, at);
  }

  contacts(c: Contacts, voxel: number) {
    const n = Math.min(maxArrows, c.w.length);
    const from = new THREE.Vector3(), along = new THREE.Vector3(), z = new THREE.Vector3(0, 0, 1);
    const turn = new THREE.Quaternion(), size = new THREE.Vector3();
    let deepest = -1;
    for (let i = 0; i < n; ++i) {
      from.set(c.p[3 * i], c.p[3 * i + 1], c.p[3 * i + 2]);
      along.set(c.n[3 * i], c.n[3 * i + 1], c.n[3 * i + 2]);
      const length = this.reach * (0.05 + 0.1 * Math.min(1, c.d[i] / voxel));
      turn.setFromUnitVectors(z, along);
      size.setScalar(length);
      this.matrix.compose(from, turn, size);
      this.arrows.setMatrixAt(i, this.matrix);
      this.arrows.setColorAt(i, this.colour.setRGB(...weightColour(c.w[i])));
      if (deepest < 0 || c.d[i] > c.d[deepest]) deepest = i;
    }
    this.arrows.count = n;
    this.arrows.instanceMatrix.needsUpdate = true;
    if (this.arrows.instanceColor) this.arrows.instanceColor.needsUpdate = true;
    this.deepest.visible = deepest >= 0;
    if (deepest >= 0) {
      this.deepest.position.set(c.p[3 * deepest], c.p[3 * deepest + 1], c.p[3 * deepest + 2]);
      this.deepest.scale.setScalar(0.012 * this.reach);
    }
  }

  // Copies of the hand's body in other colours, for other runs.
  copies(colours: string[]) {
    const body = this.bodies[this.hand];
    if (!body) return;
    this.others = colours.map((colour) => {
      const copy = body.clone();
      copy.traverse((o) => {
        if (o instanceof THREE.Mesh)
          o.material = new THREE.MeshStandardMaterial({ color: colour, transparent: true, opacity: 0.45, depthWrite: false, side: THREE.DoubleSide });
      });
      copy.visible = false;
      this.root.add(copy);
      return copy;
    });
  }
  copyAt(i: number, pose: Float32Array | null, at: number) {
    const copy = this.others[i];
    if (!copy) return;
    copy.visible = pose !== null;
    if (pose) setPose(copy, pose, at);
  }

  // Turns the camera to a place in the world, from where it stands but near enough to see the place
  // among its surroundings.
  frame(place: number[]) {
    const at = new THREE.Vector3(place[0], place[1], place[2]).divideScalar(this.radius);
    const from = this.camera.position.clone().sub(this.orbit.target);
    this.root.updateMatrixWorld(true);
    const body = this.bodies[this.hand];
    const size = body ? new THREE.Box3().setFromObject(body).getSize(new THREE.Vector3()).length() : 1;
    from.setLength(Math.min(from.length(), Math.max(0.25, 1.1 * size)));
    this.orbit.target.copy(at);
    this.camera.position.copy(at).add(from);
    this.orbit.update();
  }

  // Marks the place where a point passed through the environment; null: none.
  through(place: number[] | null) {
    this.crossing.visible = place !== null;
    if (!place) return;
    this.crossing.position.set(place[0], place[1], place[2]);
    this.crossing.scale.setScalar(0.03 * this.reach);
  }

  // Draws the net stiffness (xx yy zz xy xz yz). An axis is 0.12 of `reach` at `full`, at most
  // three times that.
  stiffness(m: ArrayLike<number>, full: number, shown: boolean) {
    const body = this.bodies[this.hand];
    this.ellipsoid.visible = shown && !!body && m.length === 6 && m[0] + m[1] + m[2] > 0;
    if (!this.ellipsoid.visible || !body) return;
    const { values, axes } = principalAxes(m);
    const size = values.map((v) => 0.12 * this.reach * Math.min(3, Math.max(0.01, v / full)));
    const com = new THREE.Vector3(...(this.heads[this.hand].com as [number, number, number]));
    com.applyQuaternion(body.quaternion).add(body.position);
    this.ellipsoid.matrix.makeTranslation(com).multiply(axes)
      .multiply(new THREE.Matrix4().makeScale(size[0], size[1], size[2]));
  }

  // Draws a slice through a field. Values are 128 + 2 d with d in voxels, in rows along v. Outside
  // is blue, inside red, the surface white, with a line every eight voxels.
  showSlice(packet: Packet | null) {
    if (this.slice) {
      this.root.remove(this.slice);
      (this.slice.material as THREE.MeshBasicMaterial).map?.dispose();
      this.slice = null;
    }
    if (!packet) return;
    const { width, height, corner, u, v } = packet.head;
    const values = packet.arrays.get('values')!;
    const pixels = new Uint8Array(4 * width * height);
    for (let i = 0; i < width * height; ++i) {
      const d = (values[i] - 128) / 2;  // voxels
      const right = i % width + 1 < width ? values[i + 1] : values[i], up = i + width < values.length ? values[i + width] : values[i];
      const step = (value: number) => Math.floor((value - 128) / 16), here = step(values[i]);
      const surface = (values[i] < 128) !== (right < 128) || (values[i] < 128) !== (up < 128);
      const line = surface ? 1 : step(right) !== here || step(up) !== here ? 0.2 : 0;
      const near = Math.exp(-Math.abs(d) / 20);
      const base = d < 0 ? [0.85, 0.32, 0.2] : [0.2, 0.45, 0.85];
      for (let k = 0; k < 3; ++k)
        pixels[4 * i + k] = 255 * Math.min(1, base[k] * (0.25 + 0.6 * near) + line);
      pixels[4 * i + 3] = 235;
    }
    const map = new THREE.DataTexture(pixels, width, height);
    map.magFilter = THREE.LinearFilter;
    map.colorSpace = THREE.SRGBColorSpace;
    map.needsUpdate = true;
    const shape = new THREE.BufferGeometry();
    const at = [[0, 0], [1, 0], [1, 1], [0, 1]].flatMap(([a, b]) => [0, 1, 2].map((k) => corner[k] + a * u[k] + b * v[k]));
    shape.setAttribute('position', new THREE.Float32BufferAttribute(at, 3));
    shape.setAttribute('uv', new THREE.Float32BufferAttribute([0, 0, 1, 0, 1, 1, 0, 1], 2));
    shape.setIndex([0, 1, 2, 0, 2, 3]);
    this.slice = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ map, side: THREE.DoubleSide, transparent: true, depthWrite: false }));
    this.root.add(this.slice);
  }

  // Whether the environment stands between the camera and the part.
  partHidden(): boolean {
    const part = this.bodies[this.hand];
    if (!part) return false;
    this.camera.updateMatrixWorld();
    this.root.updateMatrixWorld(true);
    const to = new THREE.Box3().setFromObject(part).getCenter(new THREE.Vector3());
    const from = this.camera.position, ray = new THREE.Raycaster(from, to.clone().sub(from).normalize());
    const others = this.bodies.filter((_, i) => i !== this.hand);
    const hit = ray.intersectObjects(others, true)[0];
    return hit !== undefined && hit.distance < from.distanceTo(to);
  }

  hasSlice() { return this.slice !== null; }

  // A place on the canvas (0 .. 1) where the body can be pointed at; null: none.
  visiblePoint(body: number): { x: number; y: number } | null {
    const ray = new THREE.Raycaster(), n = 40;
    this.camera.updateMatrixWorld();
    this.root.updateMatrixWorld(true);
    const hits: { x: number; y: number }[] = [];
    for (let i = 1; i < n; ++i)
      for (let j = 1; j < n; ++j) {
        ray.setFromCamera(new THREE.Vector2((2 * i) / n - 1, 1 - (2 * j) / n), this.camera);
        if (ray.intersectObject(this.bodies[body], true).length) hits.push({ x: i / n, y: j / n });
      }
    return hits.length ? hits[hits.length >> 1] : null;
  }

  // 1: solid; below 1: transparent.
  environmentOpacity(value: number) {
    for (const paint of this.environment) {
      paint.transparent = value < 1;
      paint.opacity = value;
      paint.depthWrite = value >= 0.999;
      paint.needsUpdate = true;
    }
  }

  // Puts the scene on a table: its centre at `at`, its up axis up (y), its radius as given [m].
  // Null: back to where the page shows it, with the camera where it was.
  putOn(at: THREE.Vector3 | null, radius: number) {
    if (at) this.seat ??= this.camera.matrix.clone();
    this.root.scale.setScalar(radius / this.radius);
    this.root.position.set(0, 0, 0);
    this.root.quaternion.identity();
    if (at) {
      const up = this.upright(new THREE.Vector3(0, 0, 1), this.up);
      this.root.quaternion.setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
      this.root.position.copy(this.centre).multiplyScalar(-radius / this.radius).applyQuaternion(this.root.quaternion).add(at);
    } else if (this.seat) {
      this.seat.decompose(this.camera.position, this.camera.quaternion, new THREE.Vector3());
      this.seat = null;
      this.resize();
    }
    this.root.updateMatrixWorld(true);
  }

  // A ghost that coincides with the part would only flicker through its surface.
  private showGhost() {
    const body = this.bodies[this.hand];
    if (!this.ghost || !body) return;
    this.ghost.visible = this.ghost.position.distanceTo(body.position) > 0.004 * this.reach
      || this.ghost.quaternion.angleTo(body.quaternion) > 0.01;
  }

  render() {
    this.showGhost();
    if (!this.renderer.xr.isPresenting) this.orbit.update();
    this.renderer.render(this.scene, this.camera);
  }

  private resize() {
    if (this.renderer.xr.isPresenting) return;
    const w = Math.max(64, this.where.clientWidth), h = Math.max(64, this.where.clientHeight);
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
  }
}
