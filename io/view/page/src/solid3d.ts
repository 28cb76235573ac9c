// SPDX-License-Identifier: Apache-2.0
// A solid mesh in space: its surface, its vertices, those that are marked, and the brush. Lengths are
// parts of the mesh's radius.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { css, onTheme } from './colours';

const free = new THREE.Color('#8795ab'), fixed = new THREE.Color('#ff5a4d');

// Paints how far a place is from the camera, in two bytes.
const farthest = 24;  // the camera stays within 20
const depthPaint = new THREE.ShaderMaterial({
  side: THREE.DoubleSide,
  vertexShader: `varying float z; void main() { vec4 p = modelViewMatrix * vec4(position, 1.0);
    z = -p.z / ${farthest}.0; gl_Position = projectionMatrix * p; }`,
  fragmentShader: `varying float z; void main() { float q = clamp(z, 0.0, 1.0) * 255.0;
    gl_FragColor = vec4(floor(q) / 255.0, fract(q), 0.0, 1.0); }`,
});

export class Solid3D {
  readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 100);
  readonly renderer: THREE.WebGLRenderer;
  readonly orbit: OrbitControls;
  readonly brush: THREE.Mesh;
  private scene = new THREE.Scene();
  private surface = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial({
    vertexColors: true, roughness: 0.7, metalness: 0.05, flatShading: true, side: THREE.DoubleSide,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  }));
  private paint = new Float32Array(0);
  private inside = new THREE.Points(new THREE.BufferGeometry(),
    new THREE.PointsMaterial({ color: '#ffe14d', size: 4, sizeAttenuation: false, transparent: true, opacity: 0.35, depthTest: false }));
  private outside = new THREE.Points(new THREE.BufferGeometry(),
    new THREE.PointsMaterial({ color: '#ffe14d', size: 8, sizeAttenuation: false }));
  private all = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: '#10141b', size: 3, sizeAttenuation: false }));
  private ray = new THREE.Raycaster();
  private drawn = true;  // since something changed

  constructor(private where: HTMLElement, readonly place: Float32Array, index: Uint32Array) {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    where.appendChild(this.renderer.domElement);
    const ground = () => {
      this.scene.background = new THREE.Color(css('ground'));
      this.changed();
    };
    ground();
    onTheme(ground);
    this.paint = new Float32Array(place.length);
    const shape = this.surface.geometry, points = new THREE.BufferAttribute(place, 3);
    shape.setAttribute('position', points);
    shape.setAttribute('color', new THREE.BufferAttribute(this.paint, 3));
    shape.setIndex(new THREE.BufferAttribute(index, 1));
    for (const cloud of [this.all, this.inside, this.outside]) {
      cloud.geometry.setAttribute('position', points);
      if (cloud !== this.all) cloud.geometry.setIndex([]);
      cloud.frustumCulled = false;
    }
    this.brush = new THREE.Mesh(new THREE.SphereGeometry(1, 18, 9),
      new THREE.MeshBasicMaterial({ color: '#e08a3c', wireframe: true, transparent: true, opacity: 0.35, depthTest: false }));
    this.brush.visible = false;
    [this.outside, this.all, this.inside, this.brush].forEach((o, i) => { o.renderOrder = 1 + i; });
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(1.2, -1.9, 1.3).multiplyScalar(1.25 * Math.max(1, this.size().h / this.size().w));
    this.camera.add(new THREE.DirectionalLight('#ffffff', 0.9));
    const sky = new THREE.HemisphereLight('#eef3fa', '#5a606c', 2.4);
    sky.position.set(0, 0, 1);
    this.scene.add(sky, this.camera, this.surface, this.all, this.inside, this.outside, this.brush);
    this.orbit = new OrbitControls(this.camera, this.renderer.domElement);
    this.orbit.mouseButtons.RIGHT = THREE.MOUSE.ROTATE;
    this.orbit.touches.TWO = THREE.TOUCH.DOLLY_ROTATE;
    this.orbit.addEventListener('change', () => this.changed());
    new ResizeObserver(() => this.resize()).observe(where);
    this.resize();
  }

  // Whether the left button or the first finger turns the camera. Controls that are switched off would
  // not know of that finger when the second comes.
  firstTurns(turns: boolean) {
    this.orbit.mouseButtons.LEFT = turns ? THREE.MOUSE.ROTATE : null;
    this.orbit.touches.ONE = turns ? THREE.TOUCH.ROTATE : null;
  }

  changed() { this.drawn = false; }

  // Colours the surface and shows the marked vertices as points.
  show(marks: Uint8Array) {
    const list: number[] = [];
    for (let v = 0; v < marks.length; ++v) {
      (marks[v] ? fixed : free).toArray(this.paint, 3 * v);
      if (marks[v]) list.push(v);
    }
    this.surface.geometry.getAttribute('color').needsUpdate = true;
    const index = new THREE.BufferAttribute(new Uint32Array(list), 1);
    this.inside.geometry.setIndex(index);
    this.outside.geometry.setIndex(index);
    this.changed();
  }

  // Where the line of sight through a place of the canvas [pixel] meets the surface.
  hit(x: number, y: number): THREE.Vector3 | null {
    const size = this.size();
    this.ray.setFromCamera(new THREE.Vector2(2 * x / size.w - 1, 1 - 2 * y / size.h), this.camera);
    return this.ray.intersectObject(this.surface)[0]?.point ?? null;
  }

  ball(centre: THREE.Vector3, radius: number): number[] {
    const found: number[] = [], p = this.place, r2 = radius * radius;
    for (let v = 0, k = 0; k < p.length; ++v, k += 3) {
      const x = p[k] - centre.x, y = p[k + 1] - centre.y, z = p[k + 2] - centre.z;
      if (x * x + y * y + z * z <= r2) found.push(v);
    }
    return found;
  }

  // Vertices that are seen within a rectangle of the canvas [pixel]; hidden ones only on demand.
  rectangle(x0: number, y0: number, x1: number, y1: number, hidden: boolean): number[] {
    const size = this.size(), found: number[] = [], at = new THREE.Vector3(), p = this.place;
    const distance = hidden ? () => Infinity : this.surfaceDistance();
    this.camera.updateMatrixWorld();
    for (let v = 0, k = 0; k < p.length; ++v, k += 3) {
      at.set(p[k], p[k + 1], p[k + 2]).applyMatrix4(this.camera.matrixWorldInverse);
      const away = -at.z;
      at.applyMatrix4(this.camera.projectionMatrix);
      const x = (at.x + 1) / 2 * size.w, y = (1 - at.y) / 2 * size.h;
      if (at.z < 1 && x >= Math.min(x0, x1) && x <= Math.max(x0, x1) && y >= Math.min(y0, y1) && y <= Math.max(y0, y1) &&
          away < distance(x, y) + 0.01) found.push(v);
    }
    return found;
  }
  // How far the surface is at a place of the canvas, as the camera sees it now; very far where there is
  // none.
  private surfaceDistance(): (x: number, y: number) => number {
    const { w, h } = this.size(), target = new THREE.WebGLRenderTarget(w, h);
    const clear = this.scene.background, shown = [this.all, this.inside, this.outside, this.brush].filter((o) => o.visible);
    for (const o of shown) o.visible = false;
    this.scene.background = new THREE.Color('#ffffff'), this.scene.overrideMaterial = depthPaint;
    this.renderer.setRenderTarget(target);
    this.renderer.render(this.scene, this.camera);
    const bytes = new Uint8Array(4 * w * h);
    this.renderer.readRenderTargetPixels(target, 0, 0, w, h, bytes);
    this.renderer.setRenderTarget(null);
    target.dispose();
    this.scene.background = clear, this.scene.overrideMaterial = null;
    for (const o of shown) o.visible = true;
    this.changed();
    return (x, y) => {
      const i = 4 * (Math.min(w - 1, Math.floor(x)) + w * Math.max(0, h - 1 - Math.floor(y)));
      return farthest * (bytes[i] + bytes[i + 1] / 255) / 255;
    };
  }

  showBrush(at: THREE.Vector3 | null, radius: number) {
    this.brush.visible = at !== null;
    if (at) this.brush.position.copy(at);
    this.brush.scale.setScalar(radius);
    this.changed();
  }

  // Turns around the middle by angles [rad], and goes away by a factor.
  turn(along: number, up: number, away = 1) {
    const from = new THREE.Spherical().setFromVector3(
      this.camera.position.clone().sub(this.orbit.target).applyAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2));
    from.theta += along;
    from.phi = Math.min(Math.PI - 0.01, Math.max(0.01, from.phi + up));
    from.radius = Math.min(20, Math.max(0.05, from.radius * away));
    this.camera.position.setFromSpherical(from).applyAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI / 2).add(this.orbit.target);
    this.orbit.update();
    this.changed();
  }

  render() {
    if (this.drawn) return;
    this.drawn = true;
    this.renderer.render(this.scene, this.camera);
  }

  size() { return { w: Math.max(64, this.where.clientWidth), h: Math.max(64, this.where.clientHeight) }; }
  private resize() {
    const { w, h } = this.size();
    this.renderer.setSize(w, h);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.changed();
  }
}
