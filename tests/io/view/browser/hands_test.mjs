// SPDX-License-Identifier: Apache-2.0
// The hand in the live view by mouse, by fingers and by a headset's controllers (iwer plays the
// headset); keep and back; and what axe-core says about the page.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
const require = createRequire(import.meta.url);
const iwer = readFileSync(join(dirname(require.resolve('iwer/package.json')), 'build/iwer.min.js'), 'utf8');
let browser, run, address;
const state = () => browser.value('window.hapsix?.state()');

before(async () => {
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
  await browser.send('Page.addScriptToEvaluateOnNewDocument', { source: `${iwer}
    window.device = new IWER.XRDevice(IWER.metaQuest3);
    window.device.installRuntime({ forceInstall: true });
    window.pulses = [];` });
  run = spawn(program, ['run', 'peg-in-hole', '--view', '--no-browser'], { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  address = await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], 'the run prints an address', 120);
  await browser.go(address);
  await until(async () => await browser.value('Boolean(window.hapsix?.state())'), 'a state arrives');
}, { timeout: 180000 });

after(async () => {
  run?.kill('SIGTERM');
  await browser?.close();
});

// The hand's wanted pose: x y z [m], x y z w.
const hand = () => browser.value('window.hapsix.drag().p.toArray().concat(window.hapsix.drag().q.toArray())');
const apart = (a, b, from, to) => Math.hypot(...a.slice(from, to).map((x, i) => x - b[from + i]));
const radius = () => browser.value('window.hapsix.view.radius');

// A place on the screen where the part can be picked.
async function onPart() {
  const at = await browser.value(`(() => {
    const v = window.hapsix.view, box = v.renderer.domElement.getBoundingClientRect(), hit = window.hapsix.pointOn(v.hand);
    return hit && { x: Math.round(box.left + hit.x * box.width), y: Math.round(box.top + hit.y * box.height) };
  })()`);
  assert.ok(at, 'the part can be seen');
  return at;
}

// How far the picked point, fixed to the hand, is from the pointer on the screen [pixels].
const offPointer = (x, y) => browser.value(`(() => {
  const v = window.hapsix.view, d = window.hapsix.drag(), box = v.renderer.domElement.getBoundingClientRect();
  const at = v.root.localToWorld(d.grip.clone().applyQuaternion(d.q).add(d.p)).project(v.camera);
  return Math.hypot(box.left + 0.5 * (1 + at.x) * box.width - ${x}, box.top + 0.5 * (1 - at.y) * box.height - ${y});
})()`);

test('a drag does not jump, and the picked point stays under the pointer, nearer and farther too', async () => {
  const at = await onPart();
  await browser.mouse('mousePressed', at.x, at.y);
  const first = await browser.value('window.hapsix.view.ghost.position.toArray()');
  await browser.mouse('mouseMoved', at.x, at.y);
  assert.ok(apart(first, await hand(), 0, 3) < 1e-3 * await radius(), 'no jump');
  for (let i = 1; i <= 10; ++i) await browser.mouse('mouseMoved', at.x + 7 * i, at.y - 5 * i);
  assert.ok(await offPointer(at.x + 70, at.y - 50) < 1, 'under the pointer');
  const near = await hand();
  await browser.send('Input.dispatchMouseEvent', { type: 'mouseWheel', x: at.x + 70, y: at.y - 50, deltaX: 0, deltaY: -240 });
  await until(async () => apart(near, await hand(), 0, 3) > 0.01 * await radius(), 'the wheel moves it away');
  assert.ok(await offPointer(at.x + 70, at.y - 50) < 1, 'under the pointer, farther away');
  const along = await browser.value('window.hapsix.view.camera.getWorldDirection(window.hapsix.drag().p.clone()).toArray()');
  const far = await hand();
  assert.ok(along.reduce((sum, c, i) => sum + c * (far[i] - near[i]), 0) > 0, 'away from the eye');
  // Shift turns; let go, the pointer holds on where it is.
  await browser.mouse('mouseMoved', at.x + 90, at.y - 50, { modifiers: 8 });
  const turned = await hand();
  assert.ok(apart(far, turned, 3, 7) > 0.02, 'Shift turns');
  await browser.mouse('mouseMoved', at.x + 90, at.y - 50);
  assert.ok(apart(turned, await hand(), 0, 3) < 1e-9, 'no jump after Shift');
  await browser.mouse('mouseReleased', at.x + 90, at.y - 50);
});

test('one finger moves the part, two turn it, roll it and move it away', async () => {
  const touch = (type, points) => browser.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const { x, y } = await onPart(), size = await radius();
  await touch('touchStart', [[x, y]]);
  const first = await hand();
  for (let i = 1; i <= 5; ++i) await touch('touchMove', [[x + 6 * i, y]]);
  // The browser gives a page its events when it draws next.
  await until(async () => await offPointer(x + 30, y) < 1, 'the picked point is under the finger', 20);
  const moved = await hand();
  assert.ok(apart(first, moved, 0, 3) > 0.01 * size && apart(first, moved, 3, 7) < 1e-9, 'one finger moves');
  await touch('touchStart', [[x + 30, y], [x + 130, y]]);
  await wait(500);
  assert.ok(apart(moved, await hand(), 0, 7) < 1e-9, 'the second finger moves nothing');
  for (let i = 1; i <= 5; ++i) await touch('touchMove', [[x + 30, y + 8 * i], [x + 130, y + 8 * i]]);
  await until(async () => apart(moved, await hand(), 3, 7) > 0.05, 'two fingers turn', 20);
  await wait(1000);
  const turned = await hand();
  const camera = await browser.value('window.hapsix.view.camera.position.toArray()');
  for (let i = 1; i <= 5; ++i) await touch('touchMove', [[x + 30 + 6 * i, y + 40], [x + 130 - 6 * i, y + 40]]);
  await wait(1000);
  const pinched = await hand();
  const along = await browser.value('window.hapsix.view.camera.getWorldDirection(window.hapsix.drag().p.clone()).toArray()');
  assert.ok(along.reduce((sum, c, i) => sum + c * (pinched[i] - turned[i]), 0) > 0.01 * size, 'a pinch moves it away');
  assert.deepEqual(await browser.value('window.hapsix.view.camera.position.toArray()'), camera, 'the camera stands still');
  await touch('touchEnd', []);
  assert.equal(await browser.value('window.hapsix.drag().held'), false);
});

test('a headset shows the scene on a table; the grip of a controller takes the part, and contact rumbles', async () => {
  await until(async () => !(await browser.value('document.getElementById("headset").hidden')), 'the button is offered');
  await browser.send('Runtime.evaluate', { expression: 'document.getElementById("headset").click()', userGesture: true });
  await until(async () => await browser.value('document.getElementById("headset").getAttribute("aria-pressed") === "true"'), 'the session begins');
  await until(async () => await browser.value('window.device.activeSession?.inputSources.length === 2'), 'two controllers');
  // iwer's motors do nothing: what they are asked for is kept.
  await browser.value(`(() => {
    const c = window.device.controllers.right;
    c.position.set(0.2, 1.2, -0.5);
    for (const s of window.device.activeSession.inputSources)
      for (const m of s.gamepad.hapticActuators) m.pulse = async (value, ms) => { window.pulses.push([value, ms]); return true; };
  })()`);
  await wait(500);
  const scale = (await radius()) / 0.3;  // metres of the scene for one of the room
  const rest = await browser.value('window.hapsix.view.ghost.position.toArray()');
  await browser.value('window.device.controllers.right.position.set(0.25, 1.2, -0.5)');
  await wait(400);
  assert.equal(await browser.value('window.hapsix.headset().holds'), false, 'without the grip the controller moves alone');
  await browser.value('window.device.controllers.right.updateButtonValue("squeeze", 1)');
  await until(async () => await browser.value('window.hapsix.headset().holds'), 'the grip takes the part');
  const taken = await hand();
  assert.ok(apart(rest, taken, 0, 3) < 0.05 * scale, 'where it was');
  await browser.value('window.device.controllers.right.position.set(0.25, 1.3, -0.5)');  // up by 0.1 m
  await until(async () => Math.abs(apart(taken, await hand(), 0, 3) - 0.1 * scale) < 0.002 * scale, 'the part is moved as the controller is');
  const high = await hand();
  await browser.value('window.device.controllers.right.quaternion.set(0, Math.SQRT1_2, 0, Math.SQRT1_2)');
  await until(async () => Math.abs(apart(high, await hand(), 3, 7) - 0.765) < 0.01, 'and turned by a quarter');
  await browser.value('window.device.controllers.right.quaternion.set(0, 0, 0, 1)');
  await until(async () => apart(high, await hand(), 3, 7) < 1e-3, 'and back');
  // Down into the plates: the part follows, stays behind in contact, and the motor is asked to run.
  const plain = await browser.value('window.pulses.length');
  let s;
  for (let i = 0; i <= 20; ++i) {
    await browser.value(`window.device.controllers.right.position.set(0.25, ${1.3 - 0.02 * i}, -0.5)`);
    await wait(100);
    s = await state();
    if (s.contacts > 0 && s.lag > 0 && await browser.value('window.pulses.length') > plain + 2) break;
  }
  const pulses = await browser.value('window.pulses');
  assert.ok(s.contacts > 0 && s.lag > 0, 'the part touches and stays behind the hand');
  assert.ok(pulses.length > plain, 'contact is felt');
  for (const [value, ms] of pulses) assert.ok(value >= 0 && value <= 1 && ms > 0 && ms <= 100, `${value} for ${ms} ms`);
  await browser.picture(join(pictures, 'headset.png'));
  await browser.value('window.device.controllers.right.updateButtonValue("squeeze", 0)');
  await until(async () => !(await browser.value('window.hapsix.headset().holds')), 'let go');
  const left = await hand();
  await browser.value('window.device.controllers.right.position.set(0, 1.5, -0.3)');
  await wait(300);
  assert.ok(apart(left, await hand(), 0, 7) < 1e-9, 'the hand stays where it is');
  await browser.value('document.getElementById("headset").click()');
  await until(async () => await browser.value('document.getElementById("headset").getAttribute("aria-pressed") === "false"'), 'the session ends');
});

// Lifts the part out of its hole, which it follows, and presses it on the block beside the hole: there
// it stays behind the hand.
async function touches(press, move, release) {
  await browser.go(address);  // without what the tests before left in the page
  await until(async () => await browser.value('Boolean(window.hapsix?.state())'), 'a state arrives');
  await browser.value('window.hapsix.ask({ do: "reset" })');
  await until(async () => (await state()).time < 2 && (await state()).time > 0.1, 'a new run');
  await browser.value('window.hapsix.ask({ do: "pace", pace: 0.02 })');  // its hand presses it ever deeper
  const place = () => browser.value('window.hapsix.view.bodies[window.hapsix.view.hand].position.toArray()');
  const { x, y } = await onPart(), size = await radius(), before = await place();
  let at = [x, y];
  const to = async (dx, dy) => { at = [at[0] + dx, at[1] + dy]; await move(...at); await wait(60); };
  await press(x, y);
  await to(0, -5);
  await browser.value('window.hapsix.ask({ do: "pace", pace: 1 })');
  // How far it has to go depends on how deep it was pressed until the pace fell.
  for (let i = 0; at[1] > 20 && (i < 40 || (await state()).contacts > 0); ++i) await to(0, -5);
  await until(async () => (await state()).contacts === 0, 'it is free');
  assert.ok((await place())[2] - before[2] > 0.1 * size, 'the part follows');
  for (let i = 0; i < 15; ++i) await to(5, 0);
  let touched = null;
  while (!touched && at[1] < 840) {
    await to(0, 4);
    const s = await state();
    if (s.contacts > 0 && s.lag > 0.02 * size) touched = s;
  }
  const part = await place(), wanted = await hand();
  await release(...at);
  assert.ok(touched, 'it touches and stays behind');
  assert.ok(part[2] - wanted[2] > 0.01 * size, 'the hand is below the part');
}

test('the mouse leads the part into contact', () => touches(
  (x, y) => browser.mouse('mousePressed', x, y), (x, y) => browser.mouse('mouseMoved', x, y),
  (x, y) => browser.mouse('mouseReleased', x, y)));

test('a finger leads the part into contact', () => {
  const touch = (type) => (x, y) => browser.send('Input.dispatchTouchEvent', { type, touchPoints: type === 'touchEnd' ? [] : [{ x, y, id: 0 }] });
  return touches(touch('touchStart'), touch('touchMove'), touch('touchEnd'));
});

test('a kept place is come back to, with the hand where it was; the stiffness of the hand is set', async () => {
  await browser.go(address);  // a finger of a test that failed may still be down
  await until(async () => await browser.value('Boolean(window.hapsix?.state())'), 'a state arrives');
  await browser.value('window.hapsix.ask({ do: "reset" })');
  await until(async () => (await state()).time < 2 && (await state()).time > 0.2, 'a new run');
  const at = await onPart();
  await browser.mouse('mousePressed', at.x, at.y);
  await browser.mouse('mouseMoved', at.x + 20, at.y - 15);
  const place = () => browser.value('window.hapsix.view.bodies[window.hapsix.view.hand].position.toArray()');
  const size = await radius();
  let before = await place();
  await until(async () => { await wait(1000); const was = before; before = await place(); return apart(was, before, 0, 3) < 0.0005 * size; }, 'it is at rest');
  await browser.value('document.getElementById("keep").click()');
  const kept = await place();
  for (let i = 1; i <= 8; ++i) await browser.mouse('mouseMoved', at.x + 20 + 10 * i, at.y - 15 - 10 * i);
  await until(async () => apart(kept, await place(), 0, 3) > 0.03 * size, 'it is elsewhere');
  // A last move, let go, and back in one breath: the move waits to be sent, and must not undo `back`.
  await browser.value(`(() => {
    const canvas = window.hapsix.view.renderer.domElement;
    for (const type of ['pointermove', 'pointerup'])
      canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX: ${at.x + 140}, clientY: ${at.y - 130} }));
    document.getElementById('back').click();
  })()`);
  await browser.mouse('mouseReleased', at.x + 140, at.y - 130);
  await until(async () => apart(kept, await place(), 0, 3) < 0.003 * size, 'it is back');
  await wait(1500);
  assert.ok(apart(kept, await place(), 0, 3) < 0.003 * size, 'and stays');
  const soft = (await state()).contact.hand_stiffness;
  await browser.value(`(() => { const r = document.getElementById('hand'); r.value = ${Math.log10(soft) - 0.5}; r.dispatchEvent(new Event('change')); })()`);
  await until(async () => Math.abs((await state()).contact.hand_stiffness / soft - 10 ** -0.5) < 0.06, 'a softer hand is in force');
});

test('axe-core has no serious finding, light and dark', async () => {
  assert.deepEqual(await browser.graveFindings(), []);
});

test('the browser reports no error', () => assert.deepEqual(browser.problems, []));
