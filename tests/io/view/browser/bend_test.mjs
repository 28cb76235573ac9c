// SPDX-License-Identifier: Apache-2.0
// A body that bends, in the live view and in a report: what is drawn follows the modes.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
let browser, folder, run;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'hapsix-bend-'));
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
}, { timeout: 60000 });

after(async () => {
  run?.kill('SIGTERM');
  await browser?.close();
  if (folder) rmSync(folder, { recursive: true, force: true });
});

// How far the drawn bridge, body 0, is from its shape at rest, downwards at most [m].
const sag = (view) => browser.value(`(() => {
  const bend = ${view}.bending[0], place = bend.shape.getAttribute('position').array;
  let most = 0;
  for (let k = 2; k < place.length; k += 3) most = Math.max(most, bend.rest[k] - place[k]);
  return most;
})()`);

test('live, the bridge sags under the part and comes back', async () => {
  run = spawn(program, ['run', 'bridge-and-dinosaur', '--view', '--no-browser'], { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  await browser.go(await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], 'the run prints an address', 120));
  await until(async () => (await browser.value('window.hapsix?.state()?.contacts ?? 0')) > 20, 'the part rests on the bridge', 60);
  await until(async () => (await sag('window.hapsix.view')) > 2e-3, 'the drawn bridge sags by more than 2 mm', 30);
  await browser.picture(join(pictures, 'bridge-live.png'));
}, { timeout: 240000 });

test('in a report, the shape is that of the shown instant', async () => {
  execFileSync(program, ['run', 'bridge-and-dinosaur', '--virtual-time', '--record', join(folder, 'b.h5')], { stdio: 'ignore' });
  const report = join(folder, 'b.html');
  execFileSync(program, ['report', join(folder, 'b.h5'), '-o', report], { stdio: 'ignore' });
  assert.ok(statSync(report).size < 10e6, `${statSync(report).size} bytes`);
  await browser.go(pathToFileURL(report).href);
  await until(() => browser.value('Boolean(window.hapsix?.ready)'), 'the report is ready');
  const seen = async (t) => {
    await browser.value(`(async () => {
      const scrub = document.getElementById('scrub');
      scrub.value = ${t}; scrub.dispatchEvent(new Event('input'));
      for (let frame = 0; frame < 3; ++frame) await new Promise((done) => requestAnimationFrame(done));
    })()`);
    return sag('window.hapsix.replay.view');
  };
  assert.equal(await seen(0), 0);
  const pressed = await seen(1);
  assert.ok(pressed > 3e-3 && pressed < 0.03, `${pressed} m at 1 s`);
  await browser.value("document.getElementById('space').scrollIntoView()");
  await wait(300);
  await browser.picture(join(pictures, 'bridge-report.png'));
}, { timeout: 120000 });

test('with turns, a mode that turns a body as a whole keeps its shape', async () => {
  // Mode 0 becomes the turn about z at a rate of 1: u = z x p. The drawn points must be the rest turned by q.
  const off = (angle, warped) => browser.value(`(() => {
    const view = window.hapsix.replay.view, bend = { ...view.bending[0] };
    const r = bend.rest, n = bend.count, most = r.reduce((m, v) => Math.max(m, Math.abs(v)), 0);
    bend.step = most / 32767, bend.turnStep = 1 / 32767;
    bend.modes = new Int16Array(r.length * n), bend.turns = ${warped} ? new Int16Array(r.length * n) : null;
    for (let v = 0; v < r.length; v += 3) {
      bend.modes[v * n] = Math.round(-r[v + 1] / bend.step), bend.modes[v * n + 1] = Math.round(r[v] / bend.step);
      if (bend.turns) bend.turns[v * n + 2] = 32767;
    }
    const kept = view.bending, place = bend.shape.getAttribute('position').array, before = place.slice();
    view.bending = [bend];
    view.bends(new Float32Array(n).fill(${angle}, 0, 1));
    view.bending = kept;
    const c = Math.cos(${angle}), s = Math.sin(${angle});
    let worst = 0;
    for (let v = 0; v < r.length; v += 3)
      worst = Math.max(worst, Math.hypot(place[v] - c * r[v] + s * r[v + 1],
        place[v + 1] - s * r[v] - c * r[v + 1], place[v + 2] - r[v + 2]));
    place.set(before);
    return worst / most;
  })()`);
  for (const angle of [0, 1e-3, 0.5, Math.PI, 6]) {
    const worst = await off(angle, true);
    assert.ok(worst < 1e-4 * (1 + angle), `${worst} of the size at ${angle} rad`);
  }
  assert.ok((await off(0.5, false)) > 0.05, 'without turns the body grows');
});
