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
