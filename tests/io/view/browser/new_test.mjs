// SPDX-License-Identifier: Apache-2.0
// From two meshes to contact in the view with one command; then the view's layout in six sizes and
// the hand by keys and by a gamepad. Takes real meshes where $HAPSIX_TEST_DATA has them.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
const folder = mkdtempSync(join(tmpdir(), 'hapsix-new-'));
const env = { ...process.env, HAPSIX_CACHE: join(folder, 'cache') };
const real = process.env.HAPSIX_TEST_DATA;
let browser, run;
const state = () => browser.value('window.hapsix?.state()');

function meshes() {
  if (real && existsSync(join(real, 'gears')))
    return ['gears/factory_gear_medium_space_5e-4.obj', 'gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj'].map((f) => join(real, f));
  const hapsix = (...args) => execFileSync(program, args, { cwd: folder, env, stdio: 'ignore' });
  hapsix('scene', 'export', 'peg-in-hole', 'peg');
  hapsix('scene', 'export', 'box-on-plates', 'plates');
  copyFileSync(join(folder, 'peg/block.stl'), join(folder, 'bay.stl'));
  copyFileSync(join(folder, 'plates/small.stl'), join(folder, 'clip.stl'));
  return ['clip.stl', 'bay.stl'];
}

// Opens the view of a new scene and waits for contact; returns how long that took [s].
async function touch(files) {
  const start = Date.now();
  run = spawn(program, ['new', ...files, '--view', '--no-browser'], { cwd: folder, env, stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  const address = await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], `new prints an address: ${said}`, 120);
  const shown = (Date.now() - start) / 1000;
  await browser.go(address);
  await until(async () => ((await state())?.contacts ?? 0) > 0, 'the part touches', 120);
  return { shown, touched: (Date.now() - start) / 1000 };
}

async function end() {
  run.kill('SIGTERM');
  await new Promise((done) => (run.exitCode !== null || run.signalCode !== null ? done() : run.on('exit', done)));
}

before(async () => { browser = await Browser.open(process.env.HAPSIX_CHROMIUM); }, { timeout: 120000 });
after(async () => {
  run?.kill('SIGKILL');
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

test('from two meshes to contact in the view: one command, cold and from the cache', async () => {
  const files = meshes();
  const cold = await touch(files);
  await wait(3000);
  await browser.picture(join(pictures, 'new-contact.png'));
  await end();
  const again = await touch(files);
  console.log(`# view after ${cold.shown.toFixed(1)} s cold, ${again.shown.toFixed(1)} s from the cache; contact after ${cold.touched.toFixed(1)} and ${again.touched.toFixed(1)} s`);
  // The part may leave the other between two states: wait for one in which they touch.
  await until(async () => typeof (await state())?.deepest?.with === 'string', 'a state names the deepest contact and its part');
  await until(async () => /^deepest at.*triangle \d+/s.test(await browser.value('document.getElementById("deepest").textContent')),
    'the deepest contact is named with its triangle');
});

test('in six sizes, light and dark, the parts, the figures and the strips are on the page', async () => {
  for (const [width, height, scheme] of [[360, 740, 'dark'], [768, 1024, 'light'], [900, 640, 'dark'], [1280, 860, 'light'], [1920, 1080, 'dark'], [3840, 2160, 'dark']]) {
    await browser.size(width, height);
    await browser.scheme(scheme);
    await until(async () => await browser.value(`innerWidth === ${width}`), 'the size is in force');
    const fills = `Math.abs(document.querySelector('#space canvas').getBoundingClientRect().width - document.querySelector('#space').getBoundingClientRect().width) <= 1.5`;
    await until(async () => await browser.value(fills), 'the canvas fills its place');  // when the page draws next
    await wait(1500);
    const seen = JSON.parse(await browser.value(`JSON.stringify((() => {
      const box = (s) => { const r = document.querySelector(s).getBoundingClientRect(); return { left: r.left, right: r.right, top: r.top, bottom: r.bottom, width: r.width, height: r.height }; };
      const plots = [...document.querySelectorAll('#strips .u-wrap')].map((e) => { const r = e.getBoundingClientRect(); return { right: r.right, bottom: r.bottom, height: r.height }; });
      return { space: box('#space'), canvas: box('#space canvas'), strips: box('#strips'), header: box('header'), plots, wide: document.documentElement.scrollWidth, ground: getComputedStyle(document.body).backgroundColor };
    })())`));
    const what = `${width} x ${height}: ${JSON.stringify(seen)}`;
    assert.ok(seen.wide <= width, `nothing beside the page, ${what}`);
    assert.ok(seen.canvas.width >= 0.4 * width && seen.canvas.height >= 0.3 * height, `the parts are large enough, ${what}`);
    assert.ok(Math.abs(seen.canvas.width - seen.space.width) <= 1.5, `the canvas fills its place, ${what}`);
    assert.equal(seen.plots.length, 4);
    for (const plot of seen.plots) assert.ok(plot.right <= width + 1 && plot.bottom <= seen.strips.bottom + 1 && plot.height >= 40, `no strip is cut off, ${what}`);
    const light = Number(/\d+/.exec(seen.ground)[0]) > 127;
    assert.equal(light, scheme === 'light', what);
    await browser.picture(join(pictures, `size-${width}.png`));
  }
  await browser.size(1280, 860);
  await browser.scheme('dark');
});

const hand = () => browser.value('window.hapsix.view.ghost.position.toArray().concat(window.hapsix.view.ghost.quaternion.toArray())');
const apart = (a, b, from, to) => Math.hypot(...a.slice(from, to).map((x, i) => x - b[from + i]));

test('arrow keys move the hand, with Shift they turn it, and Space presses the button in focus', async () => {
  await browser.value('document.querySelector("#space canvas").focus()');
  const first = await hand(), size = await browser.value('window.hapsix.view.radius');
  const start = (await browser.follow()).place;
  for (const key of ['ArrowUp', 'PageDown']) {
    const before = await hand();
    await browser.key('rawKeyDown', key);
    await until(async () => apart(before, await hand(), 0, 3) > 0.01 * size, `${key} moves the hand`);
    await browser.key('keyUp', key);
  }
  const moved = await hand();
  assert.ok(apart(first, moved, 3, 7) < 1e-6);
  await until(async () => apart(start, (await browser.follow()).place, 0, 3) > 0.005 * size, 'the part follows');
  await browser.key('rawKeyDown', 'ArrowRight', { modifiers: 8 });
  await until(async () => apart(moved, await hand(), 3, 7) > 0.02, 'Shift turns the hand');
  await browser.key('keyUp', 'ArrowRight', { modifiers: 8 });
  // Down until the part meets the wall that the path led it to.
  await browser.key('rawKeyDown', 'ArrowDown');
  await browser.meetsWall(() => wait(150), 'by keys');
  await browser.key('keyUp', 'ArrowDown');
  // Space on a button is that button's, not pause.
  const time = (await state()).time;
  await browser.value('document.getElementById("clutch").focus()');
  await browser.key('keyDown', ' ', { text: ' ' });
  await browser.key('keyUp', ' ');
  await until(async () => await browser.value('document.getElementById("clutch").getAttribute("aria-pressed") === "true"'), 'the clutch is down');
  await until(async () => (await state()).time > time, 'time goes on');
  await browser.value('document.getElementById("clutch").click()');
});

test('a gamepad moves and turns the hand', async () => {
  await browser.value(`(() => {
    window.pad = { connected: true, axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ value: 0, pressed: false })) };
    navigator.getGamepads = () => [window.pad];
  })()`);
  const first = await hand();
  const size = await browser.value('window.hapsix.view.radius');
  await browser.value('window.pad.axes[1] = -1');
  await until(async () => apart(first, await hand(), 0, 3) > 0.02 * size, 'the stick moves the hand');
  await browser.value('window.pad.axes[1] = 0.05');  // inside the dead zone
  await wait(2000);
  const rest = await hand();
  await wait(1000);
  assert.ok(apart(rest, await hand(), 0, 3) < 1e-9, 'the dead zone holds still');
  await browser.value('window.pad.axes[2] = 1');
  await until(async () => apart(rest, await hand(), 3, 7) > 0.02, 'the other stick turns it');
  await browser.value('window.pad.axes[2] = 0');
  await browser.value('window.pad.axes[1] = -1');
  const low = await browser.follow();
  await until(async () => apart(low.place, (await browser.follow()).place, 0, 3) > 0.02 * size, 'up: the part follows');
  await browser.value('window.pad.axes[1] = 1');
  await browser.meetsWall(() => wait(150), 'by a gamepad');
  await browser.value('window.pad.axes[1] = 0');
});

test('a program that stands still is seen to be stale, and recovers', async () => {
  process.kill(run.pid, 'SIGSTOP');
  await until(async () => /no news for/.test(await browser.value('document.getElementById("state").textContent')), 'the page says that it is stale');
  assert.ok(await browser.value('document.getElementById("safety").classList.contains("stale")'));
  process.kill(run.pid, 'SIGCONT');
  await until(async () => !(await browser.value('document.getElementById("safety").classList.contains("stale")')), 'news comes again');
});

test('the browser reports no error', async () => {
  assert.deepEqual(browser.problems, []);
  await end();
});
