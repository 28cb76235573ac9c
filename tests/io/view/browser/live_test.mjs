// SPDX-License-Identifier: Apache-2.0
// Uses the live view as a person would. Run by node --test with HAPSIX_PROGRAM, HAPSIX_CHROMIUM and
// HAPSIX_PICTURES (a folder for screenshots) set; `./dev test-view` does that.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
let browser, run, folder;
const state = () => browser.value('window.hapsix.state()');

before(async () => {
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
  folder = mkdtempSync(join(tmpdir(), 'hapsix-view-run-'));
  run = spawn(program, ['demo', '--view', '--no-browser', '--duration', '0.5', '-o', folder], { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  const address = await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], 'the demo prints an address', 120);
  await browser.go(address);
}, { timeout: 180000 });

after(async () => {
  run?.kill('SIGTERM');
  await browser?.close();
  if (folder) rmSync(folder, { recursive: true, force: true });
});

// Takes the hand and moves it until there is a contact.
async function push() {
  // The part's place on the screen.
  const at = await browser.value(`(() => {
    const v = window.hapsix.view, part = v.bodies[v.hand];
    const box = v.renderer.domElement.getBoundingClientRect();
    const hit = window.hapsix.pointOn(v.hand);
    return hit && { x: box.left + hit.x * box.width, y: box.top + hit.y * box.height };
  })()`);
  assert.ok(at, 'the part can be seen');
  await browser.mouse('mousePressed', at.x, at.y);
  for (const [dx, dy] of [[1, 0], [0, 1], [-1, 0], [0, -1]]) {
    for (let i = 1; i <= 30; ++i) {
      await browser.mouse('mouseMoved', at.x + 6 * i * dx, at.y + 6 * i * dy);
      await wait(20);
    }
    await wait(400);
    const s = await state();
    if (s.contacts > 0 && s.lag > 0) return { x: at.x + 180 * dx, y: at.y + 180 * dy, state: s };
  }
  return null;
}

test('the page loads and draws the scene', async () => {
  await until(async () => await browser.value('Boolean(window.hapsix?.state())'), 'a state arrives');
  await wait(1500);
  // More than one colour: the canvas shows something.
  const colours = await browser.value(`(() => {
    const c = window.hapsix.view.renderer.domElement, g = document.createElement('canvas');
    g.width = 200; g.height = 120;
    const p = g.getContext('2d'); p.drawImage(c, 0, 0, 200, 120);
    return new Set(new Uint32Array(p.getImageData(0, 0, 200, 120).data.buffer)).size;
  })()`);
  assert.ok(colours > 50, `${colours} colours`);
  await browser.picture(join(pictures, 'live-path.png'));
});

test('pictures follow one another, and time goes on', async () => {
  const first = (await state()).time;
  await wait(1000);
  const second = (await state()).time;
  assert.ok(second > first, `${first} then ${second}`);
});

test('dragging the part into the obstacle makes contacts, and the part lags behind the hand', async () => {
  const pushed = await push();
  assert.ok(pushed, 'some drag touches');
  await wait(600);
  await browser.picture(join(pictures, 'live-contact.png'));
  const robust = await browser.value(`window.hapsix.deepest(${(await state()).time - 0.4})`);
  const touches = (s) => s?.contacts > 0 && s.lag > 0;
  await until(async () => touches(await state()), 'the part touches and stays behind the hand');
  // At the same hand pose global scaling penetrates deeper.
  const switched = (await state()).time;
  await browser.value(`window.hapsix.ask({ do: 'contact', method: 'global' })`);
  await until(async () => (await state()).contact.method === 'global', 'global is in force');
  await wait(900);
  await browser.picture(join(pictures, 'live-global.png'));
  const global = await browser.value(`window.hapsix.deepest(${switched})`);
  assert.ok(global > 1.5 * robust, `${global} voxels deep, ${robust} before`);
  await browser.mouse('mouseReleased', pushed.x, pushed.y);
});

test('at 900 x 640 nothing moves or is cut off while the part is dragged', async () => {
  await browser.size(900, 640);
  await wait(600);
  const boxes = () => browser.value(`['header', '#space canvas', 'aside', '#strips'].map((name) => {
    const b = document.querySelector(name).getBoundingClientRect();
    return [name, Math.round(b.left), Math.round(b.top), Math.round(b.width), Math.round(b.height)].join(' ');
  })`);
  const before = await boxes(), seen = new Set();
  const at = await browser.value(`(() => {
    const v = window.hapsix.view, box = v.renderer.domElement.getBoundingClientRect(), hit = window.hapsix.pointOn(v.hand);
    return hit && { x: box.left + hit.x * box.width, y: box.top + hit.y * box.height };
  })()`);
  assert.ok(at, 'the part can be seen');
  await browser.mouse('mousePressed', at.x, at.y);
  for (let i = 1; i <= 12; ++i) {
    await browser.mouse('mouseMoved', at.x + 5 * i, at.y + 3 * i);
    await wait(60);
    seen.add(JSON.stringify(await boxes()));
  }
  await browser.picture(join(pictures, 'live-900x640.png'));
  await browser.mouse('mouseReleased', at.x + 60, at.y + 36);
  assert.deepEqual([...seen], [JSON.stringify(before)]);
  // The header has one row of buttons, and each strip lies in the window.
  const rows = await browser.value(`[...new Set([...document.querySelectorAll('header button')].map((b) => Math.round(b.getBoundingClientRect().top)))].length`);
  assert.equal(rows, 1);
  // Once the part is let go, nothing is wrong, and each chip can be read.
  await until(async () => await browser.value(`(() => { const w = document.querySelector('header .what'); return w.scrollWidth <= w.clientWidth + 1; })()`), 'no chip is cut off', 20);
  const cut = await browser.value(`[...document.querySelectorAll('#strips canvas')].filter((c) => c.getBoundingClientRect().bottom > innerHeight + 1).length`);
  assert.equal(cut, 0);
  assert.ok(await browser.value(`document.querySelector('#space canvas').getBoundingClientRect().height`) > 150, 'room for the scene');
  await browser.size(1280, 860);
  await wait(400);
});

test('what is drawn is explained: arrows, sphere, ellipsoid, units of the strips', async () => {
  const text = await browser.value('document.body.textContent');
  for (const words of ['contacts: share of stiffness 0', 'length by depth', 'where the hand is', 'deepest point', 'normals N',
    'torque directions T', 'along a long axis the part is stopped', 'force [N]', 'torque [mN·m]', 'depth [voxel]'])
    assert.ok(text.includes(words), words);
  await browser.size(360, 740);  // what is drawn has its name at any width
  await wait(300);
  assert.match(await browser.value('document.getElementById("legend").innerText'), /net stiffness/);
  await browser.size(1280, 860);
  assert.ok(await browser.value('document.querySelectorAll("#strips .u-title").length') >= 4, 'each strip has its title');
});

test('Space does what the focused button says, and pauses elsewhere', async () => {
  const pressed = (id) => browser.value(`document.getElementById('${id}').getAttribute('aria-pressed')`);
  const space = async () => {
    for (const type of ['rawKeyDown', 'char', 'keyUp'])
      await browser.send('Input.dispatchKeyEvent', { type, key: ' ', code: 'Space', text: ' ', windowsVirtualKeyCode: 32 });
    await wait(300);
  };
  await browser.value(`document.getElementById('clutch').focus()`);
  await space();
  assert.deepEqual([await pressed('clutch'), await pressed('pause')], ['true', 'false']);
  await space();
  assert.equal(await pressed('clutch'), 'false');
  await browser.value('document.activeElement.blur()');
  await space();
  assert.equal(await pressed('pause'), 'true');
  await space();
  assert.equal(await pressed('pause'), 'false');
});

test('pause stands still, reset begins again, recording leaves a file', async () => {
  await browser.value(`document.getElementById('pause').click()`);
  await wait(500);
  const first = (await state()).time;
  await wait(700);
  assert.equal((await state()).time, first);
  await browser.value(`document.getElementById('pause').click()`);
  await browser.value(`document.getElementById('record').click()`);
  await until(async () => (await state()).recording, 'it records');
  assert.ok((await state()).time < first);
  await wait(800);
  await browser.value(`document.getElementById('record').click()`);
  await until(async () => !(await state()).recording, 'it does not record any more');
});

test('a run that begins again keeps the pace of the page, and does not stay paused', async () => {
  const setPace = (pace) => browser.value(`(() => {
    const slider = document.getElementById('pace'); slider.value = ${pace}; slider.dispatchEvent(new Event('input'));
  })()`);
  await until(async () => (await state()).time > 1, 'the first second has passed');
  await setPace(0.1);
  await browser.value(`document.getElementById('pause').click()`);
  await browser.value(`document.getElementById('reset').click()`);
  await until(async () => (await state()).time < 1, 'the run begins again');
  const first = (await state()).time, begun = Date.now();
  await wait(3000);
  await until(async () => (await state()).time > first, 'time goes on');
  const went = (await state()).time - first, passed = (Date.now() - begun) / 1000;
  assert.ok(went < 0.5 * passed, `${went} s of ${passed} at a pace of 0.1`);
  await setPace(1);
});

test('a slice of the field is shown', async () => {
  await browser.value(`(() => { const b = document.getElementById('slice-on'); b.checked = true; b.dispatchEvent(new Event('input')); })()`);
  await wait(1200);
  assert.ok(await browser.value('window.hapsix.view.hasSlice()'));
  await browser.picture(join(pictures, 'live-slice.png'));
});

test('the browser reports no error', () => assert.deepEqual(browser.problems, []));
