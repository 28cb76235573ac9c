// SPDX-License-Identifier: Apache-2.0
// Moves the hand with mouse or fingers. A drag that begins on the part or its ghost holds it at the
// point that was picked, and this point stays under the pointer:
//
//   one pointer     moves it in the plane of the screen through that point
//   wheel, pinch    moves it along the line of sight
//   right button, Shift, or two fingers   turn it about the part's centre of mass; a twist rolls it
//
// A drag that begins elsewhere turns the camera.
import * as THREE from 'three';
import type { View3D } from './view3d';

export interface HandMoves {
  begin(): void;
  move(p: THREE.Vector3, q: THREE.Quaternion): void;
  end(): void;
}

const turnPerPixel = 0.006;     // [rad]
const depthPerWheel = 0.0002;   // [radii of the scene a step of the wheel]

export class Drag {
  p = new THREE.Vector3();      // of the hand, world [m]
  q = new THREE.Quaternion();
  private fingers = new Map<number, THREE.Vector2>();  // that hold the part [pixels]
  private turning = false;
  private grip = new THREE.Vector3();   // the picked point, in the hand's frame [m]
  private plane = new THREE.Plane();    // of the screen, through the picked point; of the scene as drawn
  private ray = new THREE.Raycaster();

  constructor(private view: View3D, private com: THREE.Vector3, private moves: HandMoves) {
    const canvas = view.renderer.domElement;
    // Captured before the camera's handlers: a drag on the part must not turn the camera as well.
    canvas.addEventListener('pointerdown', (e) => this.down(e), { capture: true });
    canvas.addEventListener('pointermove', (e) => this.moved(e));
    for (const what of ['pointerup', 'pointercancel'] as const) canvas.addEventListener(what, (e) => this.up(e));
    canvas.addEventListener('wheel', (e) => this.wheel(e), { capture: true, passive: false });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  }

  get held() { return this.fingers.size > 0; }

  // Takes the hand where it is, once.
  take() {
    const ghost = this.view.ghost;
    if (!ghost) return false;
    this.p.copy(ghost.position);
    this.q.copy(ghost.quaternion);
    this.moves.begin();
    return true;
  }

  // Puts the hand somewhere.
  place(p: THREE.Vector3, q: THREE.Quaternion) {
    this.p.copy(p);
    this.q.copy(q);
    this.moves.move(this.p, this.q);
  }

  // Moves the hand along the camera's axes (right, up, towards the eye) [radii of the scene], and
  // turns it about them [rad].
  nudge(move: THREE.Vector3, turn: THREE.Vector3) {
    const axes = this.axes();
    axes.forEach((axis, i) => this.p.addScaledVector(axis, move.getComponent(i) * this.view.radius));
    const all = new THREE.Quaternion();
    axes.forEach((axis, i) => all.premultiply(new THREE.Quaternion().setFromAxisAngle(axis, turn.getComponent(i))));
    this.turnBy(all);
    this.moves.move(this.p, this.q);
  }

  private axes() {
    return [0, 1, 2].map((i) => new THREE.Vector3().setFromMatrixColumn(this.view.camera.matrixWorld, i));
  }

  private turnBy(turn: THREE.Quaternion) {
    const centre = this.com.clone().applyQuaternion(this.q).add(this.p);
    this.q.premultiply(turn).normalize();
    this.p.copy(centre).sub(this.com.clone().applyQuaternion(this.q));
  }

  private aim(x: number, y: number) {
    const box = this.view.renderer.domElement.getBoundingClientRect();
    this.ray.setFromCamera(new THREE.Vector2((2 * (x - box.left)) / box.width - 1, 1 - (2 * (y - box.top)) / box.height), this.view.camera);
  }

  // Where the pointer is in the plane of the drag [m]; null: the plane is seen from its edge.
  private pointed(): THREE.Vector3 | null {
    const middle = this.middle();
    this.aim(middle.x, middle.y);
    const at = this.ray.ray.intersectPlane(this.plane, new THREE.Vector3());
    return at && this.view.root.worldToLocal(at);
  }

  private middle() {
    const all = [...this.fingers.values()];
    return all.reduce((sum, f) => sum.add(f), new THREE.Vector2()).divideScalar(all.length);
  }

  // From here on the pointer holds the hand at the place it points to: no move, no jump.
  private regrip() {
    const at = this.pointed();
    if (at) this.grip.copy(at.sub(this.p).applyQuaternion(this.q.clone().invert()));
  }

  private follow() {
    const at = this.pointed();
    if (at) this.p.copy(at).sub(this.grip.clone().applyQuaternion(this.q));
  }

  // Moves the plane of the drag along the line of sight, and the hand with it.
  private away(step: number) {
    this.plane.constant -= step;
    this.follow();
  }

  private down(e: PointerEvent) {
    const body = this.view.bodies[this.view.hand], ghost = this.view.ghost;
    if (!body || !ghost) return;
    if (!this.held) {
      this.aim(e.clientX, e.clientY);
      const hit = this.ray.intersectObjects([body, ghost], true)[0];
      if (!hit) return;
      this.plane.setFromNormalAndCoplanarPoint(this.view.camera.getWorldDirection(new THREE.Vector3()), hit.point);
      this.turning = e.button === 2;
      this.take();
    }
    e.stopImmediatePropagation();
    e.preventDefault();
    this.view.renderer.domElement.focus({ preventScroll: true });
    try { this.view.renderer.domElement.setPointerCapture(e.pointerId); } catch { /* it has gone */ }
    this.fingers.set(e.pointerId, new THREE.Vector2(e.clientX, e.clientY));
    this.regrip();
  }

  private moved(e: PointerEvent) {
    const finger = this.fingers.get(e.pointerId);
    if (!finger) return;
    const before = finger.clone(), now = new THREE.Vector2(e.clientX, e.clientY);
    const other = [...this.fingers.values()].find((f) => f !== finger);
    finger.copy(now);
    if (other) this.twoFingers(before, now, other);
    else if (this.turning || e.shiftKey) this.turnOnScreen(now.x - before.x, now.y - before.y);
    else this.follow();
    this.regrip();
    this.moves.move(this.p, this.q);
  }

  private turnOnScreen(dx: number, dy: number) {
    const [right, up] = this.axes();
    this.turnBy(new THREE.Quaternion().setFromAxisAngle(up, turnPerPixel * dx)
      .multiply(new THREE.Quaternion().setFromAxisAngle(right, turnPerPixel * dy)));
  }

  // One of two fingers moved: both together turn, apart or together moves nearer or away, around one
  // another rolls. A finger that stands still counts for half.
  private twoFingers(before: THREE.Vector2, now: THREE.Vector2, other: THREE.Vector2) {
    this.turnOnScreen(0.5 * (now.x - before.x), 0.5 * (now.y - before.y));
    const old = before.clone().sub(other), fresh = now.clone().sub(other);
    if (old.length() < 8 || fresh.length() < 8) return;
    const twist = Math.atan2(old.x * fresh.y - old.y * fresh.x, old.dot(fresh));
    this.turnBy(new THREE.Quaternion().setFromAxisAngle(this.axes()[2], -twist));
    this.regrip();
    this.away(-0.5 * Math.log(fresh.length() / old.length()));
  }

  private up(e: PointerEvent) {
    if (!this.fingers.delete(e.pointerId)) return;
    const canvas = this.view.renderer.domElement;
    if (canvas.hasPointerCapture(e.pointerId)) canvas.releasePointerCapture(e.pointerId);
    if (this.held) this.regrip();
    else this.moves.end();
  }

  private wheel(e: WheelEvent) {
    if (!this.held) return;
    e.stopImmediatePropagation();
    e.preventDefault();
    this.away(-depthPerWheel * e.deltaY);
    this.moves.move(this.p, this.q);
  }
}
