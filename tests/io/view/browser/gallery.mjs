// SPDX-License-Identifier: Apache-2.0
// Draws the pictures of io/guide/gallery.md: ./dev gallery; as a test, ./dev test-view. Fails if a scene
// cannot be shown, or if a picture shows next to nothing. Needs HAPSIX_PROGRAM, HAPSIX_CHROMIUM and
// HAPSIX_PICTURES, the folder that gets them.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { copyFileSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM, pictures = process.env.HAPSIX_PICTURES;
mkdirSync(pictures, { recursive: true });
const folder = mkdtempSync(join(tmpdir(), 'hapsix-gallery-'));
const hapsix = (...args) => execFileSync(program, args, { cwd: folder, stdio: 'ignore' });
const browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
// How many colours the parts in space have, by a small copy of what is drawn.
const colours = () => browser.value(`(() => {
  const small = document.createElement('canvas').getContext('2d');
  small.drawImage(document.querySelector('#space canvas'), 0, 0, 200, 120);
  return new Set(new Uint32Array(small.getImageData(0, 0, 200, 120).data.buffer)).size;
})()`);
const shoot = async (name) => {
  const seen = await colours();
  assert.ok(seen > 100, `${name}.png shows next to nothing: ${seen} colours`);
  await browser.picture(join(pictures, `${name}.png`));
  console.log(`${name}.png`);
};

// Runs the program with its view, waits for `contacts` of them and then `after` ms, and does the work. The
// path starts again once the page is there: on a slow machine a short one is over by then. It does so at a
// slow pace, so that its first second lasts 50.
async function live(args, work, { after = 4000, pace = 1, contacts = 1 } = {}) {
  const run = spawn(program, [...args, '--view', '--no-browser'], { cwd: folder, stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  try {
    await browser.go(await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], 'the run prints an address', 120));
    const state = (name) => browser.value(`window.hapsix?.state()?.${name} ?? -1`);
    const ask = (request) => browser.value(`window.hapsix.ask(${JSON.stringify(request)})`);
    await until(async () => (await state('time')) >= 1, 'a second has passed in the view', 120);
    await ask({ do: 'pace', pace: 0.02 });
    await ask({ do: 'reset' });
    await until(async () => (await state('time')) < 1, 'the path starts again', 120);
    await ask({ do: 'pace', pace });
    await until(async () => (await state('contacts')) >= contacts, 'something touches', 120);
    await wait(after);
    await work();
  } finally {
    run.kill('SIGTERM');
    await new Promise((done) => (run.exitCode !== null ? done() : run.on('exit', done)));
  }
}

try {
  await browser.size(1100, 740);
  await browser.scheme('light');
  hapsix('scene', 'export', 'peg-in-hole', 'peg');
  hapsix('scene', 'export', 'box-on-plates', 'plates');
  copyFileSync(join(folder, 'peg/block.stl'), join(folder, 'bay.stl'));
  copyFileSync(join(folder, 'plates/small.stl'), join(folder, 'clip.stl'));
  await live(['new', 'clip.stl', 'bay.stl'], async () => {
    await shoot('new');
  });
  await browser.scheme('dark');
  await live(['run', 'alpha-shortcut'], async () => {
    await shoot('view');
    await browser.value(`(() => { const b = document.getElementById('slice-on'); b.checked = true; b.dispatchEvent(new Event('input')); })()`);
    await wait(2500);
    await shoot('slice');
    await browser.size(360, 740);
    await wait(2500);
    await shoot('phone');
    await browser.size(1100, 740);
  });
  const bends = { 'bridge-and-dinosaur': { after: 1500 }, 'hose-in-bracket': { after: 400 },
    'clip-and-rod': { after: 0, pace: 0.1, contacts: 60 } };
  for (const [scene, when] of Object.entries(bends))
    await live(['run', scene], async () => {
      await browser.value('window.hapsix.ask({ do: "pace", pace: 0.02 })');  // it holds still for the picture
      if (scene !== 'bridge-and-dinosaur')  // all of it, since the part is small or goes far
        await browser.value(`(() => {
          const v = window.hapsix.view, to = v.centre.clone().divideScalar(v.radius);
          v.camera.position.sub(v.orbit.target).setLength(2.6).add(to);
          v.orbit.target.copy(to);
        })()`);
      await wait(2000);
      await shoot(scene.split('-')[0]);
    }, when);
  for (const method of ['global', 'firm'])
    hapsix('run', 'alpha-shortcut', '--virtual-time', '--duration', '8', '--method', method, '--record', `${method}.h5`);
  hapsix('report', 'global.h5', 'firm.h5', '-o', 'report.html');
  await browser.go(pathToFileURL(join(folder, 'report.html')).href);
  await until(() => browser.value('Boolean(window.hapsix?.ready)'), 'the report is ready');
  await wait(3000);
  await shoot('report');
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
