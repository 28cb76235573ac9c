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

function overview(head: any) {
  $('title').textContent = head.title;
  $('about').textContent = head.about;
  table($('runs'), ['run', 'method', 'verdict', 'frames', 'contacts mean', 'max', 'deepest [voxel]', 'force [N]', 'frame p50', 'p99', 'max', 'late own', 'wake-up', 'stolen', 'state hash'],
    head.runs.map((r: any, i: number) => [swatch(i, r.label), r.method, r.verdict, String(r.frames), r.contacts_mean.toFixed(1), String(r.contacts_max), r.depth_max.toFixed(3), r.force_max.toFixed(2),
      short(r.frame_us.p50), short(r.frame_us.p99), short(r.frame_us.max), String(r.late.compute), String(r.late.wakeup), String(r.late.stolen), r.state_hash]));
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

function lists(head: any) {
  const late = head.runs.flatMap((r: any, i: number) => r.late_frames.map((l: any) => [swatch(i, r.label), l.t.toFixed(3), String(l.frame), l.cause, short(l.frame_us), short(l.wakeup_us)]));
  if (late.length) table($('late'), ['run', 'time [s]', 'frame', 'cause', 'frame', 'wake-up'], late);
  else $('late').textContent = 'none';
  const events = head.runs.flatMap((r: any, i: number) => r.events.map((e: any) => [swatch(i, r.label), e.t.toFixed(3), e.what, e.detail]));
  if (events.length) table($('events'), ['run', 'time [s]', 'what', 'detail'], events);
  else $('events').textContent = 'none';
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

  constructor(private packet: Packet, private view: View3D, private strips: Strips) {
    view.load(packet);
    const which = $<HTMLSelectElement>('which');
    packet.head.runs.forEach((r: any, i: number) => which.add(new Option(r.label, String(i))));
    which.onchange = () => { this.run = Number(which.value); this.shown = -1; };
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

  // The last replay sample at or before the shown time; -1: there is none.
  private index(): number {
    const t = floats(this.packet, `replay_t${this.run}`);
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
      this.view.contacts(c, this.packet.head.voxel);
      $('n-contacts').textContent = String(c.w.length);
      $('n-depth').textContent = c.d.length ? (Math.max(...c.d) / this.packet.head.voxel).toFixed(2) : '0';
    }
    this.markCrossing();
    this.gauss.draw(c.n, c.t, c.w, this.view.camera.quaternion);
    this.view.render();
    requestAnimationFrame((t) => this.tick(t));
  }
}

async function start() {
  const packet = await data();
  const head = packet.head;
  overview(head);
  stages(head);
  lists(head);
  $('replay-about').textContent = head.replay_about;
  let replay: Replay | null = null;
  const strips = new Strips($('strips'), head.runs.map((r: any) => r.label), 190, (t) => replay?.go(t));
  strips.show(head.runs.map((_: any, i: number) => ({ rows: floats(packet, `rows${i}`), width: 6 })));
  strips.flag(head.runs.flatMap((r: any, i: number) => r.through ? [{ time: r.through.t, colour: colours[i % colours.length] }] : []));
  let view: View3D | null = null;
  try {
    view = new View3D($('space'));
  } catch (error) {
    console.error(error);  // View3D shows a sentence in its place; the rest of the report works.
  }
  if (view) {
    replay = new Replay(packet, view, strips);
    replay.go(0.6 * head.duration);
  }
  (window as any).hapsix = { ready: true, head, replay };
}
void start();
