// SPDX-License-Identifier: Apache-2.0
// Opens a report from disk as a person would: without a server, and nothing is fetched.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES ?? '.';
mkdirSync(pictures, { recursive: true });
let browser, folder, report;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'hapsix-report-'));
  const seconds = process.env.HAPSIX_REPORT_SECONDS ?? '8';
  for (const method of ['global', 'robust'])
    execFileSync(program, ['run', 'alpha-shortcut', '--virtual-time', '--duration', seconds, '--method', method, '--record', join(folder, `${method}.h5`)], { stdio: 'ignore' });
  report = join(folder, 'report.html');
  execFileSync(program, ['report', join(folder, 'global.h5'), join(folder, 'robust.h5'), '-o', report], { stdio: 'ignore' });
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
}, { timeout: 240000 });

after(async () => {
  await browser?.close();
  if (folder) rmSync(folder, { recursive: true, force: true });
});

test('one file below 10 MB', () => assert.ok(statSync(report).size < 10e6, `${statSync(report).size} bytes`));

test('it opens from disk and shows both runs', async () => {
  const start = Date.now();
  await browser.go(pathToFileURL(report).href);
  await until(() => browser.value('Boolean(window.hapsix?.ready)'), 'the report is ready');
  console.log(`# open after ${Date.now() - start} ms, ${(statSync(report).size / 1e6).toFixed(2)} MB`);
  const text = await browser.value('document.body.innerText');
  for (const word of ['global', 'robust', 'through', 'held', 'Late frames', 'Configuration'])
    assert.ok(text.includes(word), word);
  // Under `global` the part enters the forbidden region; the report opens there.
  assert.match(text, /What matters most: a point passes through, at [1-9]/);
  assert.match(text, /Tightest place: ‘.+’ in ‘.+’ at (-?[0-9.e-]+, ){2}-?[0-9.e-]+ m?m, at [0-9.]+ s/);
  await wait(800);
  assert.equal(await browser.value('document.getElementById("others").checked'), true, 'both runs in space');
  assert.doesNotMatch(await browser.value('document.getElementById("events").innerText'), /\blate: /, 'late frames have their own list');
  await browser.picture(join(pictures, 'report-top.png'));
});

test('a run that faults opens at its fault, and a held one where it is deepest', async () => {
  const record = (name, device) => execFileSync(program, ['run', 'box-on-wall', '--virtual-time', '--duration', '2', '--device', device, '--record', join(folder, name)], { stdio: 'ignore' });
  record('fault.h5', 'bad-operator?kinds=nan&every=0.5&seed=3');
  record('held.h5', 'simulated');
  for (const [name, kind, what] of [['fault', 'fault', /^bad sample$/], ['held', 'deepest', /^deepest, 0\.[0-9]+ voxel$/]]) {
    const html = join(folder, `${name}.html`);
    execFileSync(program, ['report', join(folder, `${name}.h5`), '-o', html], { stdio: 'ignore' });
    await browser.go(pathToFileURL(html).href);
    await until(() => browser.value(`Boolean(window.hapsix?.ready && window.hapsix.head.runs[0].label === '${name}')`), 'the report is ready');
    const [moment] = await browser.value('window.hapsix.moments');
    assert.equal(moment.kind, kind);
    assert.match(moment.what, what);
    assert.ok(moment.time > 0 && moment.time <= 2, `${moment.time} s`);
    assert.ok(Math.abs(await browser.value('Number(document.getElementById("scrub").value)') - moment.time) < 0.01, 'it opens there');
    assert.equal(await browser.value('document.getElementById("key").textContent'), `to the ${kind}`);
  }
  await browser.go(pathToFileURL(report).href);
  await until(() => browser.value('Boolean(window.hapsix?.ready && window.hapsix.head.runs.length === 2)'), 'the first report is back');
});

test('axe-core has no serious finding in the report, light and dark', async () => {
  assert.deepEqual(await browser.graveFindings(), []);
});

test('the scrubber moves the part, and contacts are there', async () => {
  const seen = async (t) => browser.value(`(async () => {
    const h = window.hapsix, scrub = document.getElementById('scrub');
    scrub.value = ${t}; scrub.dispatchEvent(new Event('input'));
    for (let frame = 0; frame < 3; ++frame) await new Promise((done) => requestAnimationFrame(done));
    const v = h.replay.view; const p = v.bodies[v.hand].position;
    return { x: [p.x, p.y, p.z], contacts: Number(document.getElementById('n-contacts').textContent) };
  })()`);
  const end = await browser.value('window.hapsix.head.duration');
  // The second run, because under `global` the part has popped through by then.
  await browser.value(`(() => { const w = document.getElementById('which'); w.value = '1'; w.dispatchEvent(new Event('change')); })()`);
  const first = await seen(0), later = await seen(0.6 * end);
  assert.notDeepEqual(first.x, later.x);
  assert.ok(later.contacts > 0, `${later.contacts} contacts`);
  const colours = await browser.value(`(() => {
    const c = window.hapsix.replay.view.renderer.domElement, g = document.createElement('canvas');
    g.width = 200; g.height = 120;
    const p = g.getContext('2d'); p.drawImage(c, 0, 0, 200, 120);
    return new Set(new Uint32Array(p.getImageData(0, 0, 200, 120).data.buffer)).size;
  })()`);
  assert.ok(colours > 50, `${colours} colours`);
  await browser.value(`document.getElementById('space').scrollIntoView()`);
  await wait(300);
  await browser.picture(join(pictures, 'report-replay.png'));
});

test('CSV has a row for each moment of each run, and PNG is the picture', async () => {
  // The page saves by a link; the link is kept and not followed.
  await browser.value(`window.saved = {}; HTMLAnchorElement.prototype.click = function () {
    const name = this.download;
    window.saved[name] = fetch(this.href).then((r) => r.arrayBuffer()).then((b) => Array.from(new Uint8Array(b)));
  }`);
  const saved = async (button, ending) => {
    await browser.value(`document.getElementById('${button}').click()`);
    const name = await until(() => browser.value(`Object.keys(window.saved).find((n) => n.endsWith('${ending}'))`), `${button} saves`, 20);
    return Buffer.from(await browser.value(`window.saved[${JSON.stringify(name)}]`));
  };
  const rows = (await saved('csv', '.csv')).toString().trim().split('\n');
  const columns = rows[0].split(',');
  assert.ok(columns.length >= 5 && rows.length > 100, `${rows.length} rows of ${rows[0]}`);
  for (const row of rows.slice(1)) {
    assert.equal(row.split(',').length, columns.length, row);
    assert.ok(row.split(',').slice(1).every((x) => Number.isFinite(Number(x))), row);
  }
  for (const run of ['global', 'robust']) assert.ok(rows.some((row) => row.startsWith(run) || row.startsWith(`"${run}`)), run);
  const png = await saved('png', '.png');
  assert.equal(png.subarray(1, 4).toString(), 'PNG');
  assert.ok(png.readUInt32BE(16) > 300 && png.length > 5000, `${png.readUInt32BE(16)} wide, ${png.length} bytes`);
});

test('on a telephone nothing is cut off, and on paper there are no controls', async () => {
  await browser.size(375, 812);
  await until(async () => await browser.value('innerWidth === 375'), 'the size is in force');
  await wait(1000);
  assert.ok(await browser.value('document.documentElement.scrollWidth <= 375'), 'nothing beside the page');
  const space = await browser.value('document.getElementById("space").getBoundingClientRect().width');
  assert.ok(space > 300 && space <= 375, `${space} pixels for the parts`);
  await browser.picture(join(pictures, 'report-375.png'));
  await browser.size(1280, 860);
  await browser.send('Emulation.setEmulatedMedia', { media: 'print' });
  const shown = (id) => browser.value(`document.getElementById('${id}').offsetParent !== null`);
  for (const id of ['csv', 'png', 'scrub']) assert.equal(await shown(id), false, `${id} is not printed`);
  assert.ok((await browser.value('document.body.innerText')).includes('Late frames'));
  const { data } = await browser.send('Page.printToPDF', { printBackground: true });
  const pdf = Buffer.from(data, 'base64');
  assert.equal(pdf.subarray(0, 4).toString(), '%PDF');
  assert.ok(pdf.length > 20000, `${pdf.length} bytes`);
  await browser.send('Emulation.setEmulatedMedia', { media: '' });
});

test('nothing was fetched and no error occurred', async () => {
  assert.deepEqual(browser.problems, []);
  assert.equal(await browser.value('performance.getEntriesByType("resource").filter((r) => r.name.startsWith("http")).length'), 0);
});

test('a browser without WebGL says so, and shows all but the parts', async () => {
  const poor = await Browser.open(process.env.HAPSIX_CHROMIUM, { webgl: false });
  try {
    await poor.go(pathToFileURL(report).href);
    await until(() => poor.value('Boolean(window.hapsix?.ready)'), 'the report is ready');
    const space = await poor.value('document.getElementById("space").innerText');
    assert.match(space, /no WebGL/);
    assert.doesNotMatch(space, /share of stiffness/, 'no legend lies over it');
    const text = await poor.value('document.body.innerText');
    for (const word of ['global', 'robust', 'Late frames', 'Configuration']) assert.ok(text.includes(word), word);
    await poor.picture(join(pictures, 'report-no-webgl.png'));
  } finally {
    await poor.close();
  }
});
