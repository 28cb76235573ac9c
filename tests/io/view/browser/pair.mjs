// SPDX-License-Identifier: Apache-2.0
// The cost of viewers: the same run with and without three clients, in turn. One client reads, one
// never reads, one is killed during the run. `./dev bench view` runs it.
import { execFileSync, spawn } from 'node:child_process';
import WebSocket from 'ws';

const program = process.env.HAPSIX_PROGRAM, seconds = process.env.HAPSIX_PAIR_SECONDS ?? '8';
const pairs = Number(process.env.HAPSIX_PAIRS ?? '3');
const args = ['run', 'alpha-shortcut', '--duration', seconds, '--json'];

const alone = () => JSON.parse(execFileSync(program, args, { stdio: ['ignore', 'pipe', 'ignore'] }));

function client(address) {
  const url = new URL(address);
  return new WebSocket(`ws://${url.host}/live${url.search}`, { origin: `http://${url.host}` });
}

async function watched() {
  const run = spawn(program, [...args, '--view', '--no-browser'], { stdio: ['ignore', 'pipe', 'pipe'] });
  let out = '', said = '', bytes = 0, messages = 0;
  run.stdout.on('data', (text) => { out += text; });
  await new Promise((done) => run.stderr.on('data', (text) => {
    said += text;
    if (/view: http/.test(said)) done();
  }));
  const address = said.match(/view: (http:\/\/\S+)/)[1];
  const [reads, stalls, dies] = [client(address), client(address), client(address)];
  for (const c of [reads, stalls, dies]) c.on('error', () => {});
  reads.on('message', (data) => { bytes += data.length; ++messages; });
  stalls.on('open', () => stalls.pause());
  setTimeout(() => dies.terminate(), 400 * Number(seconds));
  await new Promise((done) => run.on('close', done));
  reads.terminate(); stalls.terminate();
  return { ...JSON.parse(out), bytes, messages };
}

const rows = [];
for (let i = 0; i < pairs; ++i) {
  rows.push(['alone', alone()]);
  rows.push(['3 clients', await watched()]);
}
console.log('            frame p50     p99     max [us]   wake-up p99   late own / wake-up / stolen   pictures/s   MB/s');
for (const [name, r] of rows) {
  const f = r.frame_us, d = r.deadline;
  console.log(`${name.padEnd(10)} ${f.p50.toFixed(1).padStart(10)} ${f.p99.toFixed(1).padStart(7)} ${f.max.toFixed(1).padStart(7)} ${r.wakeup_us.p99.toFixed(1).padStart(18)} ${`${d.missed_compute} / ${d.missed_wakeup} / ${d.missed_stolen}`.padStart(24)} ${r.messages ? (r.messages / Number(seconds)).toFixed(1).padStart(16) : ''} ${r.bytes ? (1e-6 * r.bytes / Number(seconds)).toFixed(2).padStart(8) : ''}`);
}
const median = (name, of) => { const v = rows.filter(([n]) => n === name).map(([, r]) => of(r)).sort((a, b) => a - b); return v[v.length >> 1]; };
for (const p of ['p50', 'p99'])
  console.log(`${p} with clients over alone, medians: ${(median('3 clients', (r) => r.frame_us[p]) / median('alone', (r) => r.frame_us[p])).toFixed(2)}`);
