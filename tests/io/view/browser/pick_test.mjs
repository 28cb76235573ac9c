// SPDX-License-Identifier: Apache-2.0
// The page of `hapsix bake deformable --pick`: vertices are marked by brush, box, keys and numbers, and
// what is chosen is what is baked.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
let browser, folder, picking;

// A bar of cubes, 8 x 2 x 2 cells of 10 mm along x, as VEGA writes it.
const cells = [8, 2, 2], at = (i, j, k) => 1 + i + 9 * (j + 3 * k);
function bar() {
  const vertices = [], elements = [];
  for (let k = 0; k <= cells[2]; ++k)
    for (let j = 0; j <= cells[1]; ++j)
      for (let i = 0; i <= cells[0]; ++i) vertices.push(`${at(i, j, k)} ${10 * i} ${10 * j} ${10 * k}`);
  for (let k = 0; k < cells[2]; ++k)
    for (let j = 0; j < cells[1]; ++j)
      for (let i = 0; i < cells[0]; ++i)
        elements.push([elements.length + 1, at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k),
          at(i, j, k + 1), at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)].join(' '));
  return `*VERTICES\n${vertices.length} 3 0 0\n${vertices.join('\n')}\n*ELEMENTS\nCUBIC\n${elements.length} 8 0\n${elements.join('\n')}\n`;
}
const material = ['--units', 'mm', '--young', '1e6', '--poisson', '0.4', '--density', '1000', '--modes', '4'];
const bake = ['bake', 'deformable', 'bar.veg', ...material, '-o', 'bar.h5'];

function begin(more = []) {
  const p = { said: '', code: null };
  p.child = spawn(program, [...bake, '--pick', 'fixed.txt', '--no-browser', ...more], { cwd: folder, stdio: ['ignore', 'ignore', 'pipe'] });
  p.child.stderr.on('data', (text) => { p.said += text; });
  p.ended = new Promise((done) => p.child.on('exit', (code) => { p.code = code; done(code); }));
  p.address = until(() => p.said.match(/(http:\/\/\S+)/)?.[1], 'the program prints an address');
  return picking = p;
}
const ready = () => until(() => browser.value("document.getElementById('state')?.textContent === 'choose'"), 'the page shows the part');
const count = () => browser.value("Number(document.getElementById('count').textContent)");
const marked = () => browser.value('window.hapsix.marks().marked().map((v) => v + 1)');
const press = (id) => browser.value(`document.getElementById('${id}').click()`);
const set = (values) => browser.value(`(() => { for (const [id, value] of Object.entries(${JSON.stringify(values)})) {
  const e = document.getElementById(id); e.value = value; e.dispatchEvent(new Event('input')); } })()`);
// Where a place of the part, in its unit, is on the screen [pixel].
const pixel = (x, y, z) => browser.value(`(() => { const s = window.hapsix.solid(), c = s.renderer.domElement.getBoundingClientRect();
  const r = 10 * Math.hypot(8, 2, 2) / 2, p = s.brush.position.clone().set((${x} - 40) / r, (${y} - 10) / r, (${z} - 10) / r);
  s.camera.updateMatrixWorld(); p.project(s.camera);
  return [c.left + (p.x + 1) / 2 * c.width, c.top + (1 - p.y) / 2 * c.height]; })()`);
const click = async ([x, y], more = {}) => {
  for (const type of ['mouseMoved', 'mousePressed', 'mouseReleased']) await browser.mouse(type, x, y, more);
};
const drag = async ([x0, y0], [x1, y1]) => {
  await browser.mouse('mousePressed', x0, y0);
  for (let i = 1; i <= 8; ++i) await browser.mouse('mouseMoved', x0 + (x1 - x0) * i / 8, y0 + (y1 - y0) * i / 8);
  await browser.mouse('mouseReleased', x1, y1);
};
const shift = { modifiers: 8 };

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'hapsix-pick-'));
  writeFileSync(join(folder, 'bar.veg'), bar());
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
}, { timeout: 60000 });
after(async () => {
  picking?.child.kill('SIGTERM');
  await browser?.close();
  if (folder) rmSync(folder, { recursive: true, force: true });
});

test('a click fixes the vertices within the radius, Shift frees them, and undo brings them back', async () => {
  await browser.go(await begin().address);
  await ready();
  assert.equal(await browser.value("document.getElementById('use').disabled"), true);
  await set({ radius: Math.log10(12 / (5 * Math.hypot(8, 2, 2))) });  // 12 mm
  await click(await pixel(60, 10, 20));
  // The middle of the top at x = 60, its four neighbours there, and the one below.
  assert.deepEqual(await marked(), [at(6, 1, 1), at(6, 0, 2), at(5, 1, 2), at(6, 1, 2), at(7, 1, 2), at(6, 2, 2)].sort((a, b) => a - b));
  await browser.picture(join(pictures, 'pick-brush.png'));
  await click(await pixel(60, 10, 20), shift);
  assert.equal(await count(), 0);
  await press('undo');
  assert.equal(await count(), 6);
  await browser.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'z', ctrlKey: true }))");
  assert.equal(await count(), 0);
  await press('redo');
  assert.equal(await count(), 6);
}, { timeout: 120000 });

test('a drag beside the part turns it and fixes nothing', async () => {
  const before = await browser.value('window.hapsix.solid().camera.position.toArray()');
  await drag([60, 700], [200, 640]);
  assert.notDeepEqual(await browser.value('window.hapsix.solid().camera.position.toArray()'), before);
  assert.equal(await count(), 6);
}, { timeout: 60000 });

test('one finger fixes vertices; a second takes that back, and both turn it and come nearer', async () => {
  const touch = (type, points) => browser.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const camera = () => browser.value('window.hapsix.solid().camera.position.length()');
  await press('clear');
  await press('undo');
  const [x, y] = await pixel(40, 10, 20), before = await marked(), far = await camera();
  await touch('touchStart', [[x, y]]);
  await touch('touchEnd', []);
  assert.ok((await count()) > before.length);
  await press('undo');
  await touch('touchStart', [[x - 30, y]]);
  await touch('touchStart', [[x - 30, y], [x + 30, y]]);
  for (let i = 1; i <= 6; ++i) await touch('touchMove', [[x - 30 - 10 * i, y], [x + 30 + 10 * i, y]]);
  await touch('touchEnd', []);
  await wait(100);
  assert.deepEqual(await marked(), before);
  assert.ok((await camera()) < 0.8 * far, `${await camera()} of ${far}`);
  await browser.value(`(() => { const s = window.hapsix.solid(); s.camera.position.setLength(${far}); s.orbit.update(); })()`);
}, { timeout: 60000 });

test('a rectangle takes all vertices behind it, or only those that are seen', async () => {
  await press('clear');
  await press('tool-box');
  const whole = async () => {
    const box = await browser.value("(() => { const r = document.querySelector('#space canvas').getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; })()");
    await drag([box[0] + 2, box[1] + 2], [box[2] - 2, box[3] - 2]);
  };
  await whole();
  assert.equal(await count(), 81);
  await press('clear');
  await press('through');
  await whole();
  const seen = await count(), fixed = new Set(await marked());
  assert.ok(seen > 20 && seen < 60, `${seen} are seen`);
  assert.equal(fixed.has(at(4, 1, 1)), false);  // inside
  await press('undo');
  assert.equal(await count(), 0);
  await press('tool-brush');
}, { timeout: 60000 });

test('keys alone do all of it: a cross, Space, and boxes by numbers', async () => {
  await browser.value("document.querySelector('#space canvas').focus()");
  await set({ radius: -0.7 });
  await browser.key('keyDown', ' ');
  const first = await count();
  assert.ok(first > 0, 'Space fixes at the cross, which begins in the middle');
  await browser.key('keyDown', ' ', shift);
  assert.equal(await count(), 0);
  for (let i = 0; i < 60; ++i) await browser.key('keyDown', 'ArrowUp');
  await browser.key('keyDown', ' ');
  assert.equal(await count(), 0, 'the cross has left the part');
  await set({ x0: 0, x1: 0, y0: 0, y1: 20, z0: 0, z1: '' });
  await press('box-add');
  assert.match(await browser.value("document.getElementById('hint').textContent"), /two numbers for z/);
  await set({ z1: 20 });
  await press('box-add');
  assert.deepEqual(await marked(), [0, 1, 2].flatMap((k) => [0, 1, 2].map((j) => at(0, j, k))));
}, { timeout: 60000 });

test('it is readable in light and dark, at every size, and clean by axe-core', async () => {
  for (const [w, h] of [[360, 740], [900, 640], [1280, 860], [3840, 2160]]) {
    await browser.size(w, h);
    for (const scheme of ['light', 'dark']) {
      await browser.scheme(scheme);
      await wait(300);
      assert.ok(await browser.value('document.documentElement.scrollWidth <= window.innerWidth'), `${w} px is wide enough`);
      await browser.picture(join(pictures, `pick-${w}-${scheme}.png`));
    }
    const r = await browser.value("(() => { const r = document.getElementById('use').getBoundingClientRect(); return [r.left, r.right, r.top]; })()");
    assert.ok(r[0] >= 0 && r[1] <= w && r[2] >= 0 && r[2] < h, `the button is there at ${w} px: ${r}`);
  }
  await browser.size(1280, 860);
  assert.deepEqual(await browser.graveFindings(), []);
}, { timeout: 120000 });

test('a list that no page would send is refused, and the page goes on', async () => {
  const said = await browser.value(`(async () => {
    const socket = new WebSocket('ws://' + location.host + '/live' + location.search), heard = [];
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (m) => { const text = new TextDecoder().decode(m.data); heard.push(/"text":"([^"]*)"/.exec(text)?.[1] ?? ''); };
    await new Promise((done) => { socket.onopen = done; });
    for (const text of ['{', '[]', '{"do":"use"}', '{"do":"use","vertices":[]}', '{"do":"use","vertices":[81]}', '{"do":"use","vertices":[-1]}',
      '{"do":"use","vertices":[1.5]}', '{"do":"use","vertices":["0"]}', '{"do":"format"}']) {
      socket.send(text);
      await new Promise((done) => setTimeout(done, 150));
    }
    socket.close();
    return heard.filter((text) => text);
  })()`);
  assert.ok(said.length >= 8, JSON.stringify(said));
  assert.equal(picking.code, null);
  assert.equal(await count(), 9);
}, { timeout: 60000 });

test('only who has the token gets the page, and only from this machine by its name', async () => {
  const address = new URL(await picking.address), open = `${address.origin}/`;
  assert.equal((await fetch(address)).status, 200);
  assert.equal((await fetch(open)).status, 403);
  assert.equal((await fetch(`${open}?token=${'0'.repeat(32)}`)).status, 403);
  assert.equal((await fetch(`${open}fixed.txt${address.search}`)).status, 404);
  assert.equal((await fetch(address, { method: 'POST' })).status, 405);
  assert.equal(picking.code, null);
}, { timeout: 60000 });

test('what is chosen is written, baked, and can be baked again from the list', async () => {
  await browser.picture(join(pictures, 'pick-chosen.png'));
  await press('use');
  assert.equal(await picking.ended, 0, picking.said);
  await until(() => browser.value("document.getElementById('state').textContent.includes('can be closed')"), 'the page says that it is done');
  const list = readFileSync(join(folder, 'fixed.txt'), 'utf8').split('\n').filter((line) => line && !line.startsWith('#')).map(Number);
  assert.deepEqual(list, [0, 1, 2].flatMap((k) => [0, 1, 2].map((j) => at(0, j, k))));
  const again = (more) => JSON.parse(spawnSync(program, [...bake, '--json', ...more], { cwd: folder, encoding: 'utf8' }).stdout);
  const by_list = again(['--fix-list', 'fixed.txt']), by_box = again(['--fix-box=0,0,0,0,20,20']);
  assert.equal(by_list.fixed, 9);
  assert.deepEqual(by_list.frequencies, by_box.frequencies);
  assert.deepEqual(browser.problems, []);
}, { timeout: 60000 });

test('a page that is closed without a choice ends the program with one sentence', async () => {
  rmSync(join(folder, 'fixed.txt'));
  rmSync(join(folder, 'bar.h5'));
  for (const leave of [() => press('cancel'), () => browser.go('about:blank')]) {
    await browser.go(await begin(['--fix', '1,2,3']).address);
    await ready();
    assert.deepEqual(await marked(), [1, 2, 3]);  // what is fixed already is shown
    await leave();
    assert.equal(await picking.ended, 1);
    assert.match(picking.said, /closed before 'Use these' was pressed, so nothing was written/);
    assert.ok(!existsSync(join(folder, 'fixed.txt')) && !existsSync(join(folder, 'bar.h5')));
  }
  await browser.go(await begin().address);
  await ready();
  await browser.go(await picking.address);  // loaded again: the program still waits
  await ready();
  await wait(3500);
  assert.equal(picking.code, null);
  picking.child.kill('SIGINT');
  assert.notEqual(await picking.ended, 0);
}, { timeout: 60000 });
