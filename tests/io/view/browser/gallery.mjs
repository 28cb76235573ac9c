// SPDX-License-Identifier: Apache-2.0
// Draws the pictures of io/guide/gallery.md: ./dev gallery. Needs HAPSIX_PROGRAM, HAPSIX_CHROMIUM
// and HAPSIX_PICTURES, the folder that gets them.
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
const shoot = async (name) => { await browser.picture(join(pictures, `${name}.png`)); console.log(`${name}.png`); };

async function live(args, work, after = 4000) {
  const run = spawn(program, [...args, '--view', '--no-browser'], { cwd: folder, stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  try {
    await browser.go(await until(() => said.match(/view: (http:\/\/\S+)/)?.[1], 'the run prints an address', 120));
    await until(async () => (await browser.value('window.hapsix?.state()?.contacts ?? 0')) > 0, 'something touches', 120);
    await wait(after);
    await work();
  } finally {
    run.kill('SIGTERM');
    await new Promise((done) => (run.exitCode !== null ? done() : run.on('exit', done)));
  }
}

try {
  await browser.size(1100, 740);
  hapsix('scene', 'export', 'peg-in-hole', 'peg');
  hapsix('scene', 'export', 'box-on-plates', 'plates');
  copyFileSync(join(folder, 'peg/block.stl'), join(folder, 'bay.stl'));
  copyFileSync(join(folder, 'plates/small.stl'), join(folder, 'clip.stl'));
  await live(['new', 'clip.stl', 'bay.stl'], async () => {
    await shoot('new');
    await browser.scheme('light');
    await wait(1500);
    await shoot('light');
    await browser.scheme('dark');
  });
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
  for (const [scene, after] of [['bridge-and-dinosaur', 1500], ['hose-in-bracket', 400], ['clip-and-rod', 0]])
    await live(['run', scene], async () => {
      await browser.value('window.hapsix.ask({ do: "pace", pace: 0.05 })');  // it holds still for the picture
      if (scene !== 'bridge-and-dinosaur')  // all of it, since the part is small or goes far
        await browser.value(`(() => {
          const v = window.hapsix.view, to = v.centre.clone().divideScalar(v.radius);
          v.camera.position.sub(v.orbit.target).setLength(2.6).add(to);
          v.orbit.target.copy(to);
        })()`);
      await wait(2000);
      await shoot(scene.split('-')[0]);
    }, after);
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
