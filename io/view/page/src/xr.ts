// SPDX-License-Identifier: Apache-2.0
// A headset's controllers as the hand (WebXR). The scene stands in front of the person, and moves
// there as it would on a table.
//
//   grip       is the clutch: held, the part follows the controller as if it were fixed to it; let
//              go, the controller moves alone and the hand stays where it is
//   rumble     the force in the hand, as a share of the most that the coupling gives; a new contact
//              is a short knock
//
// Controllers render no force: the part stops at an obstacle, and the ghost shows how far the hand is
// ahead. A controller that is lost from sight lets go.
import * as THREE from 'three';
import type { View3D } from './view3d';
import type { Drag } from './drag';

const sceneRadius = 0.3;             // of the scene on the table [m]
const table = new THREE.Vector3(0, 1.1, -0.6);  // its middle, from where the person stands [m]
const knock = 60, hum = 50;          // length of a pulse [ms]

export interface Felt { force: number; most: number; contacts: number }  // [N]

export class Headset {
  private session: XRSession | null = null;
  private by = -1;                   // the controller that holds the part; -1: none
  private from = { p: new THREE.Vector3(), q: new THREE.Quaternion(), hand: new THREE.Vector3(), turned: new THREE.Quaternion() };
  private touched = false;
  private at = 0;                    // when the last pulse began [ms]

  constructor(private view: View3D, private drag: Drag, private changed: (on: boolean) => void) {}

  static async offered(): Promise<boolean> {
    try { return await navigator.xr?.isSessionSupported('immersive-vr') ?? false; } catch { return false; }
  }

  get holds() { return this.by >= 0; }

  async toggle() {
    if (this.session) { await this.session.end(); return; }
    const session = await navigator.xr!.requestSession('immersive-vr', { requiredFeatures: ['local-floor'] });
    session.addEventListener('end', () => this.leave());
    this.view.renderer.xr.enabled = true;
    this.view.renderer.xr.setReferenceSpaceType('local-floor');
    await this.view.renderer.xr.setSession(session);
    this.session = session;
    this.view.putOn(table, sceneRadius);
    this.changed(true);
  }

  private leave() {
    this.release();
    this.session = null;
    this.view.renderer.xr.enabled = false;
    this.view.putOn(null, 1);
    this.changed(false);
  }

  private release() {
    this.by = -1;
    this.touched = false;
  }

  // Once a picture.
  tick(frame: XRFrame | undefined, felt: Felt | null) {
    const space = this.view.renderer.xr.getReferenceSpace();
    if (!this.session || !frame || !space) return;
    const sources = [...this.session.inputSources];
    sources.forEach((source, i) => {
      const pose = source.gripSpace ? frame.getPose(source.gripSpace, space) : undefined;
      const closed = source.gamepad?.buttons[1]?.pressed ?? false;  // of the mapping 'xr-standard'
      if (this.by === i && (!pose || !closed)) this.release();
      if (pose && closed && this.by < 0) this.grab(i, pose.transform);
      if (pose && this.by === i) this.follow(pose.transform);
    });
    if (this.by >= sources.length) this.release();
    if (felt && this.by >= 0) this.rumble(sources[this.by], felt);
  }

  // A controller's pose in the scene [m].
  private inScene(t: XRRigidTransform) {
    const p = this.view.root.worldToLocal(new THREE.Vector3(t.position.x, t.position.y, t.position.z));
    const q = this.view.root.getWorldQuaternion(new THREE.Quaternion()).invert()
      .multiply(new THREE.Quaternion(t.orientation.x, t.orientation.y, t.orientation.z, t.orientation.w));
    return { p, q };
  }

  private grab(i: number, t: XRRigidTransform) {
    if (!this.drag.take()) return;
    this.by = i;
    const at = this.inScene(t);
    this.from.p.copy(at.p);
    this.from.q.copy(at.q);
    this.from.hand.copy(this.drag.p);
    this.from.turned.copy(this.drag.q);
  }

  private follow(t: XRRigidTransform) {
    const at = this.inScene(t);
    const turn = at.q.clone().multiply(this.from.q.clone().invert());
    const p = this.from.hand.clone().sub(this.from.p).applyQuaternion(turn).add(at.p);
    this.drag.place(p, turn.multiply(this.from.turned).normalize());
  }

  private rumble(source: XRInputSource, felt: Felt) {
    const motor = (source.gamepad as any)?.hapticActuators?.[0] ?? source.gamepad?.vibrationActuator;
    if (!motor?.pulse) return;
    const now = performance.now(), fresh = felt.contacts > 0 && !this.touched;
    this.touched = felt.contacts > 0;
    const share = felt.most > 0 ? Math.min(1, felt.force / felt.most) : 0;
    if (fresh) { motor.pulse(Math.max(0.5, share), knock); this.at = now; return; }
    // Pulses are short: where the page stops, so does the rumble.
    if (share < 0.02 || now - this.at < hum) return;
    this.at = now;
    motor.pulse(share, hum);
  }
}
