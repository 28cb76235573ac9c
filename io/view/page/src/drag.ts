// SPDX-License-Identifier: Apache-2.0
// Moves the hand with the mouse. A drag that begins on the part or its ghost moves the hand in the
// plane of the screen; with the right button or Shift it turns the hand about the part's centre of
// mass; the wheel moves it along the line of sight. A drag that begins elsewhere turns the camera.
import * as THREE from 'three';
import type { View3D } from './view3d';

export interface HandMoves {
  begin(): void;
  move(p: THREE.Vector3, q: THREE.Quaternion): void;
  end(): void;
}

export class Drag {
  held = false;
  private turning = false;
  private ray = new THREE.Raycaster();
  private plane = new THREE.Plane();
  private last = new THREE.Vector3();
  private lastX = 0;
  private lastY = 0;
  p = new THREE.Vector3();
  q = new THREE.Quaternion();

  constructor(private view: View3D, private com: THREE.Vector3, private moves: HandMoves) {
    const canvas = view.renderer.domElement;
    // Captured before the camera's handlers: a drag on the part must not turn the camera as well.
    canvas.addEventListener('pointerdown', (e) => this.down(e), { capture: true });
    canvas.addEventListener('pointermove', (e) => this.moved(e));
    for (const what of ['pointerup', 'pointercancel'] as const) canvas.addEventListener(what, (e) => this.up(e));
    canvas.addEventListener('wheel', (e) => this.wheel(e), { capture: true, passive: false });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  }

  // Takes the hand where it is, once.
  take() {
    const ghost = this.view.ghost;
    if (!ghost) return false;
    this.p.copy(ghost.position);
    this.q.copy(ghost.quaternion);
    this.moves.begin();
    return true;
  }

  // Moves the hand along the camera's axes (right, up, towards the eye) [radii of the scene], and
  // turns it about them [rad].
  nudge(move: THREE.Vector3, turn: THREE.Vector3) {
    const axes = [0, 1, 2].map((i) => new THREE.Vector3().setFromMatrixColumn(this.view.camera.matrixWorld, i));
    axes.forEach((axis, i) => this.p.addScaledVector(axis, move.getComponent(i) * this.view.radius));
    const centre = this.com.clone().applyQuaternion(this.q).add(this.p);
    axes.forEach((axis, i) => this.q.premultiply(new THREE.Quaternion().setFromAxisAngle(axis, turn.getComponent(i))));
    this.q.normalize();
    this.p.copy(centre).sub(this.com.clone().applyQuaternion(this.q));
    this.moves.move(this.p, this.q);
  }

  private aim(e: PointerEvent | WheelEvent) {
    const box = this.view.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (e.clientX - box.left)) / box.width - 1, 1 - (2 * (e.clientY - box.top)) / box.height);
    this.ray.setFromCamera(at, this.view.camera);
  }

  private down(e: PointerEvent) {
    const body = this.view.bodies[this.view.hand], ghost = this.view.ghost;
    if (!body || !ghost) return;
    this.aim(e);
    const hit = this.ray.intersectObjects([body, ghost], true)[0];
    if (!hit) return;
    e.stopImmediatePropagation();
    e.preventDefault();
    this.view.renderer.domElement.setPointerCapture(e.pointerId);
    this.held = true;
    this.turning = e.button === 2 || e.shiftKey;
    this.plane.setFromNormalAndCoplanarPoint(this.view.camera.getWorldDirection(new THREE.Vector3()), hit.point);
    this.last.copy(hit.point);
    this.lastX = e.clientX;
    this.lastY = e.clientY;
    this.take();
  }

  private moved(e: PointerEvent) {
    if (!this.held) return;
    if (this.turning || e.shiftKey) {
      const right = new THREE.Vector3().setFromMatrixColumn(this.view.camera.matrixWorld, 0);
      const up = new THREE.Vector3().setFromMatrixColumn(this.view.camera.matrixWorld, 1);
      const turn = new THREE.Quaternion().setFromAxisAngle(up, 0.006 * (e.clientX - this.lastX))
        .multiply(new THREE.Quaternion().setFromAxisAngle(right, 0.006 * (e.clientY - this.lastY)));
      const centre = this.com.clone().applyQuaternion(this.q).add(this.p);
      this.q.premultiply(turn).normalize();
      this.p.copy(centre).sub(this.com.clone().applyQuaternion(this.q));
    } else {
      this.aim(e);
      const at = this.ray.ray.intersectPlane(this.plane, new THREE.Vector3());
      if (!at) return;
      this.p.add(at.clone().sub(this.last).multiplyScalar(this.view.radius));
      this.last.copy(at);
    }
    this.lastX = e.clientX;
    this.lastY = e.clientY;
    this.moves.move(this.p, this.q);
  }

  private up(e: PointerEvent) {
    if (!this.held) return;
    this.held = false;
    this.view.renderer.domElement.releasePointerCapture(e.pointerId);
    this.moves.end();
  }

  private wheel(e: WheelEvent) {
    if (!this.held) return;
    e.stopImmediatePropagation();
    e.preventDefault();
    const along = this.view.camera.getWorldDirection(new THREE.Vector3());
    this.p.addScaledVector(along, -0.0002 * e.deltaY * this.view.radius);
    this.moves.move(this.p, this.q);
  }
}
