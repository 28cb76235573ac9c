// SPDX-License-Identifier: Apache-2.0
// Steers the hand in six degrees of freedom with keys and with a gamepad.
//
//   keys      arrows: left, right, up, down; Page Up, Page Down: away, nearer; with Shift they turn;
//             Q, E roll
//   gamepad   left stick moves, triggers go away and nearer; right stick turns, shoulders roll; the
//             first button is the clutch
import * as THREE from 'three';
import type { Drag } from './drag';

const speed = 0.25, turnSpeed = 0.9;  // [radii of the scene/s], [rad/s]
const deadZone = 0.12;
const keys: Record<string, [number, number]> = {  // axis 0 .. 2 (right, up, towards the eye), sign
  ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, -1], PageDown: [2, 1],
};

// Keys belong to a control that has the focus.
export const inControl = (e: Event) => e.target instanceof HTMLElement && /^(INPUT|SELECT|BUTTON|TEXTAREA|SUMMARY|A)$/.test(e.target.tagName);

export class Steer {
  private down = new Set<string>();
  private shift = false;
  private holding = false;
  private clutch = false;

  constructor(private drag: Drag, private onClutch: (on: boolean) => void) {
    addEventListener('keydown', (e) => {
      this.shift = e.shiftKey;
      if (inControl(e) || e.ctrlKey || e.metaKey || e.altKey) return;
      const key = e.key.length === 1 ? e.key.toLowerCase() : e.key;
      if (!(key in keys) && key !== 'q' && key !== 'e') return;
      e.preventDefault();
      this.down.add(key);
    });
    addEventListener('keyup', (e) => {
      this.shift = e.shiftKey;
      this.down.delete(e.key.length === 1 ? e.key.toLowerCase() : e.key);
    });
    addEventListener('blur', () => this.down.clear());
  }

  // Once a picture, `seconds` after the last one.
  tick(seconds: number) {
    if (this.drag.held) { this.holding = false; return; }
    const move = new THREE.Vector3(), turn = new THREE.Vector3();
    this.fromKeys(move, turn);
    this.fromGamepad(move, turn);
    if (move.lengthSq() === 0 && turn.lengthSq() === 0) { this.holding = false; return; }
    if (!this.holding && !this.drag.take()) return;
    this.holding = true;
    const step = Math.min(0.1, seconds);
    this.drag.nudge(move.multiplyScalar(speed * step), turn.multiplyScalar(turnSpeed * step));
  }

  private fromKeys(move: THREE.Vector3, turn: THREE.Vector3) {
    for (const key of this.down) {
      if (key === 'q' || key === 'e') { turn.z += key === 'q' ? 1 : -1; continue; }
      const [axis, sign] = keys[key];
      if (!this.shift) move.setComponent(axis, move.getComponent(axis) + sign);
      else if (axis === 0) turn.y += sign;   // as if the part were dragged that way
      else if (axis === 1) turn.x -= sign;
      else turn.z -= sign;
    }
  }

  private fromGamepad(move: THREE.Vector3, turn: THREE.Vector3) {
    const pad = navigator.getGamepads?.().find((p) => p?.connected && p.axes.length >= 4);
    if (!pad) return;
    const stick = (i: number) => {
      const x = pad.axes[i] ?? 0;
      return Math.abs(x) < deadZone ? 0 : (x - Math.sign(x) * deadZone) / (1 - deadZone);
    };
    const button = (i: number) => pad.buttons[i]?.value ?? 0;
    move.x += stick(0);
    move.y -= stick(1);
    move.z += button(6) - button(7);  // the right trigger pushes away
    turn.y += stick(2);
    turn.x += stick(3);
    turn.z += button(4) - button(5);
    const clutch = pad.buttons[0]?.pressed ?? false;
    if (clutch !== this.clutch) this.onClutch(this.clutch = clutch);
  }
}
