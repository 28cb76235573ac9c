// SPDX-License-Identifier: Apache-2.0
// The page of `hapsix report`: shows the recordings whose data the page contains.
import { floats, unpack, type Packet } from './envelope';
import { series as colours } from './colours';
import { GaussSphere } from './gauss';
import { short } from './histogram';
import { Strips } from './strips';
import { View3D, type Contacts } from './view3d';

const $ = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

async function data(): Promise<Packet> {
  const text = $('data').textContent!.trim();
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return unpack(await new Response(stream).arrayBuffer());
}

function cell(text: string, tag = 'td') {
  const e = document.createElement(tag);
  e.textContent = text;
  return e;
}

function table(where: HTMLElement, head: string[], lines: (string | HTMLElement)[][]) {
  const t = document.createElement('table');
  const top = t.insertRow();
  head.forEach((h) => top.append(cell(h, 'th')));
  for (const line of lines) {
    const row = t.insertRow();
    for (const value of line) {
      if (typeof value === 'string') row.append(cell(value));
      else { const td = document.createElement('td'); td.append(value); row.append(td); }
    }
  }
  where.append(t);
}

function swatch(i: number, text: string) {
  const e = document.createElement('span');
  const mark = document.createElement('span');
  mark.className = 'swatch';
  mark.style.background = colours[i % colours.length];
  e.append(mark, text);
  return e;
}

// What a reader wants to know first: what was tried, whether it held, and when it came nearest to
// failing.
const verdicts: Record<string, [string, string]> = {
  held: ['good', 'It held: nothing passed through, and the part came to rest.'],
  arrived: ['good', 'The part arrived at its target.'],
  untouched: ['warn', 'Nothing touched.'],
  unheld: ['warn', 'The scene has no hand, so nothing was held.'],
  stuck: ['warn', 'The part did not reach its target.'],
  chatters: ['bad', 'The part did not come to rest: it chatters.'],
  sunk: ['bad', 'The part ended more than three voxels deep.'],
  through: ['bad', 'A point of the part passed through.'],
  unstable: ['bad', 'The motion was unstable.'],
};

interface Moment { time: number; what: string; kind: 'escape' | 'fault' | 'deepest' }

// Causes of the safety chain that end the force, by their names.
const faults = new Set(['not finite', 'device lost', 'overspeed', 'pose jump', 'bad sample', 'frozen', 'watchdog']);

// The escape, else the first fault, else the deepest contact.
function moment(run: any, rows: Float32Array): Moment {
  if (run.through) return { time: run.through.t, what: 'a point passes through', kind: 'escape' };
  const fault = run.events.find((e: any) => faults.has(e.what));
  if (fault) return { time: fault.t, what: fault.what, kind: 'fault' };
  let at = 0;
  for (let i = 0; i < rows.length; i += 6) if (rows[i + 4] > rows[at + 4]) at = i;
  const touched = rows.length > 0 && rows[at + 4] > 0;
  return { time: touched ? rows[at] : 0, what: touched ? `deepest, ${rows[at + 4].toFixed(2)} voxel` : 'start', kind: 'deepest' };
}

function parsed(text: string): any {
  try { return JSON.parse(text); } catch { return {}; }
}

function summary(head: any, moments: Moment[]) {
  // What all runs tried is said once.
  const abouts = head.runs.map((r: any) => parsed(r.config).about ?? '');
  const same = abouts.every((a: string) => a === abouts[0]);
  if (same && abouts[0]) {
    const p = document.createElement('p');
    p.textContent = `Tried: ${abouts[0]}`;
    $('about').append(p);
  }
  head.runs.forEach((r: any, i: number) => {
    const [kind, sentence] = verdicts[r.verdict] ?? ['warn', `Verdict: ${r.verdict}.`];
    const card = document.createElement('article');
    card.className = kind;
    const top = document.createElement('h3');
    top.append(swatch(i, `${r.label}: ${r.verdict}`));
    const line = (text: string) => {
      const p = document.createElement('p');
      p.textContent = text;
      card.append(p);
    };
    card.append(top);
    const scene = parsed(r.config), late = r.late.compute + r.late.wakeup + r.late.stolen;
    line(sentence);
    if (scene.about && !same) line(`Tried: ${scene.about}`);
    line(`Contacts share stiffness by ‘${r.method}’. Up to ${r.contacts_max} at once, ${r.depth_max.toFixed(2)} voxel deep at most, ${r.force_max.toFixed(1)} N in the hand.`);
    line(`What matters most: ${moments[i].what}, at ${moments[i].time.toFixed(2)} s.`);
    const tight = r.tightest;
    if (tight) line(`Tightest place: ‘${tight.part}’ in ‘${tight.other}’ at ${tight.place.map((x: number) => x.toPrecision(4)).join(', ')} ${tight.unit}, at ${tight.t.toFixed(2)} s.`);
    line(late ? `${late} of ${r.frames} frames were late.` : `None of ${r.frames} frames was late.`);
    $('summary').append(card);
  });
}

function overview(head: any) {
  $('title').textContent = head.title;
  $('about').textContent = head.about;
  table($('runs'), ['run', 'method', 'verdict', 'frames', 'contacts mean', 'max', 'deepest [voxel]', 'force [N]', 'frame p50', 'p99', 'max', 'state hash'],
    head.runs.map((r: any, i: number) => [swatch(i, r.label), r.method, r.verdict, String(r.frames), r.contacts_mean.toFixed(1), String(r.contacts_max), r.depth_max.toFixed(3), r.force_max.toFixed(2),
      short(r.frame_us.p50), short(r.frame_us.p99), short(r.frame_us.max), r.state_hash]));
}

function save(name: string, data: Blob) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(data);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Every run's rows, one table.
function csv(head: any, rows: Float32Array[]): string {
  const lines = ['run,time_s,contacts,force_N,torque_mNm,depth_voxel,frame_us'];
  rows.forEach((all, i) => {
    const name = `"${String(head.runs[i].label).replaceAll('"', '""')}"`;
    for (let k = 0; k < all.length; k += 6)
      lines.push([name, ...Array.from(all.subarray(k, k + 6), (x) => String(Number(x.toPrecision(7))))].join(','));
  });
  return lines.join('\n') + '\n';
}

const stageColours = ['#8dd3c7', '#ffffb3', '#bebada', '#fb8072', '#80b1d3', '#fdb462', '#b3de69', '#fccde5'];

function stages(head: any) {
  head.runs.forEach((r: any, i: number) => {
    const bar = document.createElement('div');
    bar.className = 'bar';
    const total = r.stages.reduce((sum: number, s: any) => sum + s.mean, 0) || 1;
    r.stages.forEach((s: any, k: number) => {
      const part = document.createElement('span');
      part.style.width = `${(100 * s.mean) / total}%`;
      part.style.background = stageColours[k % stageColours.length];
      part.textContent = s.name;
      part.title = `${s.name}: mean ${short(s.mean)}`;
      bar.append(part);
    });
    $('stages').append(swatch(i, `${r.label}: mean ${short(total)}`), bar);
    table($('stages'), ['stage', 'mean', 'p50', 'p99', 'max'],
      r.stages.map((s: any) => [s.name, short(s.mean), short(s.p50), short(s.p99), short(s.max)]));
  });
}

// The first rows are shown, the others fold away.
function long(where: HTMLElement, head: string[], lines: (string | HTMLElement)[][]) {
  if (!lines.length) { where.textContent = 'none'; return; }
  table(where, head, lines.slice(0, 12));
  if (lines.length <= 12) return;
  const fold = document.createElement('details'), top = document.createElement('summary');
  top.textContent = `${lines.length - 12} more`;
  fold.append(top);
  table(fold, head, lines.slice(12));
  where.append(fold);
}

function lists(head: any) {
  const count = document.createElement('div');
  table(count, ['run', 'own computation', 'wake-up', 'stolen by the machine'],
    head.runs.map((r: any, i: number) => [swatch(i, r.label), String(r.late.compute), String(r.late.wakeup), String(r.late.stolen)]));
  const late = head.runs.flatMap((r: any, i: number) => r.late_frames.map((l: any) => [swatch(i, r.label), l.t.toFixed(3), String(l.frame), l.cause, short(l.frame_us), l.again_us === null ? '' : short(l.again_us), short(l.wakeup_us)]));
  if (late.length) { $('late').append(count); const rest = document.createElement('div'); $('late').append(rest); long(rest, ['run', 'time [s]', 'number', 'cause', 'frame', 'stepped again', 'wake-up'], late); }
  else $('late').textContent = 'none';
  // Late frames have a list of their own.
  long($('events'), ['run', 'time [s]', 'what', 'detail'], head.runs.flatMap((r: any, i: number) =>
    r.events.filter((e: any) => !/^late(:|$)/.test(e.what)).map((e: any) => [swatch(i, r.label), e.t.toFixed(3), e.what, e.detail])));
  head.runs.forEach((r: any, i: number) => {
    const fold = document.createElement('details');
    const top = document.createElement('summary');
    top.append(swatch(i, `${r.label} · ${r.program} · ${r.simd_target} · assets ${r.asset_hashes.join(', ') || 'none'}`));
    const pre = document.createElement('pre');
    pre.textContent = r.config;
    fold.append(top, pre);
    $('config').append(fold);
  });
}

class Replay {
  private at = 0;
  private run = 0;
  private playing = false;
  private last = 0;
  private shown = -1;
  private gauss = new GaussSphere($<HTMLCanvasElement>('gauss'));
  private framing = false;

  constructor(private packet: Packet, private view: View3D, private strips: Strips, private moments: Moment[]) {
    view.load(packet);
    view.copies(packet.head.runs.map((_: any, i: number) => colours[i % colours.length]));
    $<HTMLInputElement>('others').disabled = packet.head.runs.length < 2;
    $<HTMLInputElement>('others').checked = packet.head.runs.length > 1;
    $<HTMLInputElement>('others').onchange = () => { this.shown = -1; };
    $('key').onclick = () => this.toMoment();
    const which = $<HTMLSelectElement>('which');
    packet.head.runs.forEach((r: any, i: number) => which.add(new Option(r.label, String(i))));
    which.onchange = () => { this.run = Number(which.value); this.shown = -1; this.name(); };
    $<HTMLInputElement>('opacity').oninput = (e) => view.environmentOpacity(Number((e.target as HTMLInputElement).value));
    const scrub = $<HTMLInputElement>('scrub');
    scrub.max = String(packet.head.duration);
    scrub.oninput = () => this.go(Number(scrub.value));
    $('play').onclick = () => {
      this.playing = !this.playing;
      $('play').textContent = this.playing ? 'pause' : 'play';
    };
    requestAnimationFrame((now) => this.tick(now));
  }

  private name() {
    const m = this.moments[this.run];
    $('moment').textContent = `${this.packet.head.runs[this.run].label}: ${m.what}, at ${m.time.toFixed(2)} s`;
    $('key').textContent = `to the ${m.kind}`;
  }

  // Shows a run at the moment that matters, with the camera on the place.
  toMoment(run = this.run) {
    this.run = run;
    this.shown = -1;
    $<HTMLSelectElement>('which').value = String(run);
    this.name();
    this.framing = true;
    this.go(this.moments[run].time);
  }

  // The samples of contacts are fewer than the frames: the nearest one that has some.
  private frameCamera(k: number) {
    this.framing = false;
    const samples = floats(this.packet, `replay_t${this.run}`).length;
    let c = this.contacts(k);
    for (let away = 1; away < samples && !c.d.length; ++away)
      for (const near of [k - away, k + away])
        if (near >= 0 && near < samples && !c.d.length) c = this.contacts(near);
    const through = this.packet.head.runs[this.run].through;
    let deepest = 0;
    for (let i = 1; i < c.d.length; ++i) if (c.d[i] > c.d[deepest]) deepest = i;
    if (through) this.view.frame(through.place);
    else if (c.d.length) this.view.frame([c.p[3 * deepest], c.p[3 * deepest + 1], c.p[3 * deepest + 2]]);
  }

  go(time: number) {
    this.at = Math.min(this.packet.head.duration, Math.max(0, time));
    $<HTMLInputElement>('scrub').value = String(this.at);
    $('scrub-time').textContent = `${this.at.toFixed(3)} s`;
    this.strips.mark(this.at);
  }

  // Once the shown run has passed through the environment, its first crossing stays marked.
  private markCrossing() {
    const through = this.packet.head.runs[this.run].through;
    this.view.through(through && this.at >= through.t - 1e-6 ? through.place : null);
  }

  // Other runs' parts at the same time, in their colours.
  private showOthers() {
    const all = $<HTMLInputElement>('others').checked;
    this.packet.head.runs.forEach((_: any, i: number) => {
      const k = i !== this.run && all ? this.index(i) : -1;
      this.view.copyAt(i, k < 0 ? null : floats(this.packet, `replay_body${i}`), 7 * k);
    });
  }

  // The last replay sample at or before the shown time; -1: there is none.
  private index(run = this.run): number {
    const t = floats(this.packet, `replay_t${run}`);
    let low = 0, high = t.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (t[middle] <= this.at + 1e-6) low = middle; else high = middle - 1;
    }
    return t.length ? low : -1;
  }

  private contacts(k: number): Contacts {
    const get = (name: string) => this.packet.arrays.get(`${name}${this.run}`);
    const starts = get('contact_at'), stored = get('contacts');
    const none = new Float32Array(0);
    if (!starts || !stored || k < 0) return { p: none, n: none, t: none, w: none, d: none };
    const { contact_origin: o, contact_step: step, voxel } = this.packet.head;
    const first = starts[k], n = starts[k + 1] - first;
    const c = { p: new Float32Array(3 * n), n: new Float32Array(3 * n), t: new Float32Array(3 * n), w: new Float32Array(n), d: new Float32Array(n) };
    for (let i = 0; i < n; ++i) {
      const at = 11 * (first + i);
      for (let a = 0; a < 3; ++a) {
        c.p[3 * i + a] = o[a] + step * stored[at + a];
        c.n[3 * i + a] = stored[at + 3 + a] / 32767;
        c.t[3 * i + a] = stored[at + 6 + a] / 32767;
      }
      c.w[i] = stored[at + 9] / 32767;
      c.d[i] = (stored[at + 10] / 1000) * voxel;
    }
    return c;
  }

  private tick(now: number) {
    if (this.playing) {
      const next = this.at + Math.min(0.1, (now - this.last) / 1000);
      this.go(next >= this.packet.head.duration ? 0 : next);
    }
    this.last = now;
    const k = this.index();
    const c = this.contacts(k);
    if (k >= 0 && (k !== this.shown)) {
      this.shown = k;
      const bodies = floats(this.packet, `replay_body${this.run}`), hands = floats(this.packet, `replay_hand${this.run}`);
      const body = this.view.bodies[this.view.hand];
      if (body) {
        body.position.set(bodies[7 * k], bodies[7 * k + 1], bodies[7 * k + 2]);
        body.quaternion.set(bodies[7 * k + 4], bodies[7 * k + 5], bodies[7 * k + 6], bodies[7 * k + 3]);
      }
      this.view.handAt(hands, 7 * k);
      this.view.bends(floats(this.packet, `replay_bends${this.run}`), k * this.view.bendCount());
      this.view.contacts(c, this.packet.head.voxel);
      this.showOthers();
      if (this.framing) this.frameCamera(k);
      $('n-contacts').textContent = String(c.w.length);
      $('n-depth').textContent = c.d.length ? (Math.max(...c.d) / this.packet.head.voxel).toFixed(2) : '0';
    }
    this.markCrossing();
    this.gauss.draw(c.n, c.t, c.w, this.view.camera.quaternion);
    this.view.render();
    requestAnimationFrame((t) => this.tick(t));
  }
}

// The run that went worst is shown first.
function worst(head: any): number {
  const rank = (r: any) => ['unstable', 'through', 'sunk', 'chatters', 'stuck'].indexOf(r.verdict);
  let best = 0;
  head.runs.forEach((r: any, i: number) => {
    const a = rank(r), b = rank(head.runs[best]);
    if (a >= 0 && (b < 0 || a < b)) best = i;
    else if (a < 0 && b < 0 && r.depth_max > head.runs[best].depth_max) best = i;
  });
  return best;
}

async function start() {
  const packet = await data();
  const head = packet.head;
  const rows: Float32Array[] = head.runs.map((_: any, i: number) => floats(packet, `rows${i}`));
  const moments = head.runs.map((r: any, i: number) => moment(r, rows[i]));
  overview(head);
  summary(head, moments);
  stages(head);
  lists(head);
  $('replay-about').textContent = head.replay_about;
  let replay: Replay | null = null;
  const strips = new Strips($('strips'), head.runs.map((r: any) => r.label), 210, (t) => replay?.go(t));
  strips.show(rows.map((all) => ({ rows: all, width: 6 })));
  strips.flag(head.runs.flatMap((r: any, i: number) => r.through ? [{ time: r.through.t, colour: colours[i % colours.length] }] : []));
  const name = String(head.name || 'hapsix').replace(/[^\w-]+/g, '_');
  $('csv').onclick = () => save(`${name}.csv`, new Blob([csv(head, rows)], { type: 'text/csv' }));
  let view: View3D | null = null;
  try {
    view = new View3D($('space'));
  } catch (error) {
    console.error(error);  // View3D shows a sentence in its place; the rest of the report works.
  }
  if (view) {
    replay = new Replay(packet, view, strips, moments);
    replay.toMoment(worst(head));
    $('png').onclick = () => view!.renderer.domElement.toBlob((blob) => { if (blob) save(`${name}.png`, blob); });
  }
  (window as any).hapsix = { ready: true, head, replay, moments, csv: () => csv(head, rows) };
}
void start();
