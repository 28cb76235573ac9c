// SPDX-License-Identifier: Apache-2.0
// A scene from a stranger: its names are shown as text, on the live page and in the report.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { Browser, until, wait } from './browser.mjs';

const program = process.env.HAPSIX_PROGRAM;
const evil = `<img src=x onerror="window.pwned=1"><script>window.pwned=2</script></script><!--`;
let browser, run, folder, scene;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'hapsix-evil-'));
  execFileSync(program, ['scene', 'export', 'box-on-wall', folder], { stdio: 'ignore' });
  scene = join(folder, 'scene.json');
  const file = JSON.parse(readFileSync(scene, 'utf8'));
  file.name = evil;
  const before = JSON.stringify(file);
  for (const list of [file.bodies, file.shells, file.fields, file.hands])
    for (const part of list ?? []) if (typeof part.name === 'string') renamed(file, part.name);
  writeFileSync(scene, JSON.stringify(file));
  assert.notEqual(JSON.stringify(file), before, 'no part has a name');
  browser = await Browser.open(process.env.HAPSIX_CHROMIUM);
}, { timeout: 180000 });

// Replaces one name wherever it stands.
function renamed(at, name) {
  for (const key of Object.keys(at))
    if (at[key] === name && key !== 'file') at[key] = name + evil;
    else if (at[key] && typeof at[key] === 'object') renamed(at[key], name);
}

after(async () => {
  run?.kill('SIGTERM');
  await browser?.close();
  if (folder) rmSync(folder, { recursive: true, force: true });
});

async function harmless(shown) {
  await wait(1000);
  assert.equal(await browser.value('window.pwned ?? 0'), 0);
  assert.equal(await browser.value('document.images.length'), 0);
  assert.ok((await browser.value('document.body.innerText')).includes(shown), 'it is shown as text');
}

test('the live page shows hostile names and notes as text', async () => {
  run = spawn(program, ['run', scene, '--view', '--no-browser'], { stdio: ['ignore', 'ignore', 'pipe'], cwd: folder });
  let said = '';
  run.stderr.on('data', (text) => { said += text; });
  const address = await until(() => said.match(/view: (http:\/\/\S+)/)?.[1] ?? (run.exitCode !== null && assert.fail(said)),
    'the run prints an address', 120);
  await browser.go(address);
  await until(() => browser.value('Boolean(window.hapsix?.state())'), 'a state arrives');
  await harmless('onerror');
  // The program quotes what it did not understand.
  await browser.value(`window.hapsix.ask({ do: '<img src=x onerror=window.pwned=3>' })`);
  await until(() => browser.value(`document.getElementById('hint').textContent.includes('onerror')`), 'the note arrives');
  await harmless('window.pwned=3');
});

test('the report shows hostile names as text', async () => {
  const recorded = join(folder, 'run.h5'), report = join(folder, 'report.html');
  execFileSync(program, ['run', scene, '--virtual-time', '--duration', '1', '--record', recorded], { stdio: 'ignore' });
  execFileSync(program, ['report', recorded, '-o', report], { stdio: 'ignore' });
  await browser.go(pathToFileURL(report).href);
  await until(() => browser.value('Boolean(window.hapsix?.ready)'), 'the report is ready');
  await harmless('onerror');
});
