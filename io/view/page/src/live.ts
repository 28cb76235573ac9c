// SPDX-License-Identifier: Apache-2.0
// The page of `hapsix run --view`: shows the messages of the run and sends the user's requests.
import * as THREE from 'three';
import { floats, unpack, type Packet } from './envelope';
import { GaussSphere } from './gauss';
import { drawHistogram, percentile, short } from './histogram';
import { Strips } from './strips';
import { principalAxes } from './stiffness';
import { View3D } from './view3d';
import { Drag } from './drag';
import { inControl, Steer } from './steer';
import { Headset } from './xr';

const $ = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const input = (id: string) => $<HTMLInputElement>(id);

const view = new View3D($('space'));
const gauss = new GaussSphere($<HTMLCanvasElement>('gauss'));
const strips = new Strips($('strips'), ['now'], null);
const width = 6, windowSeconds = 12;
let rows = new Float32Array(0);
let socket: WebSocket;
let scene: any = null;
let newest: Packet | null = null;
let drag: Drag | null = null;
let steer: Steer | null = null;
let headset: Headset | null = null;
let heard = 0;             // when the last state came [ms]
let last = 0, slow = 0;     // the picture before [ms]; mean time between pictures [ms]
const help = matchMedia('(pointer: coarse)').matches
  ? 'Drag the part to move it · two fingers turn, twist and pinch it away · drag elsewhere turns the camera'
  : 'Drag the part to move it · Shift or right button turns it · wheel moves it away · or arrow and page keys, or a gamepad · drag elsewhere turns the camera';
let paused = false, clutched = false;
let recording = false;  // as the program said last; the button shows it when the page draws
let pace = 1;

function send(request: object) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
}

// A move of the hand waits for the next one, so that there are not too many. What is asked after it
// must not overtake it: a late move would undo `back`.
let waits = 0;
function askHand() {
  clearTimeout(waits);
  waits = 0;
  send({ do: 'hand', p: drag!.p.toArray(), q: [drag!.q.w, drag!.q.x, drag!.q.y, drag!.q.z] });
}

function ask(request: object) {
  if (waits) askHand();
  send(request);
}

function chip(id: string, text: string, kind: string) {
  const e = $(id);
  e.textContent = text;
  e.className = `chip ${kind}`;
}

function hint(text: string) { ($('hint').firstElementChild as HTMLElement).textContent = text; }

function load(packet: Packet) {
  if (scene) { location.reload(); return; }  // another run serves the same address now
  scene = packet.head;
  $('scene').textContent = scene.name;
  $('lag-unit').textContent = scene.unit;
  document.title = `hapsix - ${scene.name}`;
  view.load(packet);
  const choice = $<HTMLSelectElement>('method');
  for (const name of scene.methods) choice.add(new Option(name, name));
  const com = scene.hand_body >= 0 ? scene.bodies[scene.hand_body].com : [0, 0, 0];
  drag = new Drag(view, new THREE.Vector3(...(com as [number, number, number])), {
    begin() { ask({ do: 'grab', on: true }); },
    move(p, q) {
      view.handAt([p.x, p.y, p.z, q.w, q.x, q.y, q.z]);
      if (!waits) waits = window.setTimeout(askHand, 12);
    },
    end: askHand,
  });
  steer = new Steer(drag, clutch);
  headset = new Headset(view, drag, (on) => {
    $('headset').setAttribute('aria-pressed', String(on));
    $('headset').classList.toggle('on', on);
    hint(on ? 'Hold a controller\'s grip to take the part' : help);
  });
  void Headset.offered().then((yes) => { $('headset').hidden = !yes; });
  hint(help);
  settings(scene.contact);
  if (view.partHidden()) {
    input('opacity').value = '0.25';
    view.environmentOpacity(0.25);
  }
}

// Shows the settings in force on the controls; another client may have changed them.
function settings(c: any) {
  $<HTMLSelectElement>('method').value = c.method;
  if ($<HTMLSelectElement>('method').value !== c.method) {
    $<HTMLSelectElement>('method').add(new Option(c.method, c.method));
    $<HTMLSelectElement>('method').value = c.method;
  }
  const put = (id: string, value: number, text: string) => {
    if (document.activeElement !== input(id)) input(id).value = String(Math.log10(value));
    $(`${id}-out`).textContent = text;
  };
  put('stiffness', c.stiffness, `${c.stiffness.toPrecision(3)} N/m`);
  put('epsilon', c.epsilon, c.epsilon.toPrecision(2));
  put('hand', c.hand_stiffness, `${c.hand_stiffness.toPrecision(3)} N/m`);
  put('saturation', c.max_depth_voxels, `${c.max_depth_voxels.toPrecision(2)} voxel`);
}

function show(packet: Packet) {
  const h = packet.head;
  view.poses(floats(packet, 'poses'));
  view.bends(floats(packet, 'bends'));
  const hand = floats(packet, 'hands');
  if (!drag?.held && !headset?.holds) view.handAt(hand);
  const contacts = {
    p: floats(packet, 'contact_p'), n: floats(packet, 'contact_n'), t: floats(packet, 'contact_t'),
    w: floats(packet, 'contact_w'), d: floats(packet, 'contact_d'),
  };
  view.contacts(contacts, scene.voxel);
  view.stiffness(h.stiffness, h.contact.stiffness, input('ellipsoid').checked);
  $('ellipsoid-out').textContent = stiffest(h.stiffness);
  gauss.draw(contacts.n, contacts.t, contacts.w, view.camera.quaternion);
  $('n-contacts').textContent = String(h.contacts);
  $('n-depth').textContent = h.depth_voxels.toFixed(2);
  $('n-force').textContent = h.force.toFixed(2);
  $('n-lag').textContent = h.lag * scene.per_metre < 1e-3 ? '0' : (h.lag * scene.per_metre).toPrecision(3);
  const frame = packet.arrays.get('frame_bins')!, wake = packet.arrays.get('wake_bins')!;
  drawHistogram($<HTMLCanvasElement>('frame-bins'), frame, '#e08a3c', h.budget_us);
  drawHistogram($<HTMLCanvasElement>('wake-bins'), wake, '#53a6d6', h.budget_us);
  $('frame-text').textContent = `p50 ${short(percentile(frame, 0.5))}, p99 ${short(percentile(frame, 0.99))}`;
  const late = h.late;
  $('wake-text').textContent = `p99 ${short(percentile(wake, 0.99))}, late ${late.compute} / ${late.wakeup} / ${late.stolen}`;
  $('wake-text').title = 'late frames by cause: own computation / late wake-up / time stolen by the machine';
  $('safety').innerHTML = '';
  const chips: [string, string][] = h.fault !== 'none' ? [[`fault: ${h.fault}`, 'bad']] : [];
  if (h.cause !== 'none') chips.push([h.cause, 'warn']);
  for (const bit of h.status) chips.push([bit, 'warn']);
  if (!chips.length) chips.push(['output as asked', 'good']);
  chips.push([`device ${h.device}`, h.device === 'active' || h.device === 'armed' ? 'good' : 'warn']);
  for (const [text, kind] of chips) {
    const e = document.createElement('span');
    e.textContent = text;
    e.className = `chip ${kind}`;
    $('safety').append(e, ' ');
  }
  freshness(h.time);
  showDeepest(h);
  settings(h.contact);
  $('record').classList.toggle('on', h.recording);
  $('record').setAttribute('aria-pressed', String(h.recording));
}

// The largest principal value, in words.
function stiffest(m: number[]) {
  const most = Math.max(...principalAxes(m).values);
  return most > 0 ? `${most.toPrecision(2)} N/m` : 'free';
}

// Says when what is shown is old, or when this page is too slow to follow.
function freshness(time?: number) {
  const age = performance.now() - heard;
  const stale = heard > 0 && age > 1000 && !paused;
  for (const id of ['safety', 'strips', 'n-contacts', 'n-depth', 'n-force', 'n-lag']) $(id).classList.toggle('stale', stale);
  if (stale) return chip('state', `no news for ${(age / 1000).toFixed(0)} s`, 'bad');
  if (time === undefined) return;
  if (paused) return chip('state', 'paused', 'warn');
  chip('state', `${time.toFixed(1)} s${slow > 250 ? `, draws ${(1000 / slow).toFixed(1)}/s` : ''}`, slow > 250 ? 'warn' : 'good');
}

function showDeepest(h: any) {
  const d = h.deepest;
  $('deepest').textContent = !d ? 'nothing touches'
    : `deepest at ${d.with}${d.part && d.part !== d.with ? ` / ${d.part}` : ''}${d.triangle >= 0 ? `, triangle ${d.triangle}` : ''}`;
}

function keep(packet: Packet) {
  const fresh = floats(packet, 'rows');
  if (!fresh.length) return;
  const end = fresh[fresh.length - width];
  if (rows.length && end < rows[rows.length - width]) rows = new Float32Array(0);  // the run was reset
  const all = new Float32Array(rows.length + fresh.length);
  all.set(rows);
  all.set(fresh, rows.length);
  let first = 0;
  while (first < all.length && all[first] < end - windowSeconds) first += width;
  rows = all.slice(first);
}

function connect() {
  const url = new URL(location.href);
  socket = new WebSocket(`ws://${url.host}/live?token=${url.searchParams.get('token')}`);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (event) => {
    const packet = unpack(event.data as ArrayBuffer);
    if (packet.head.kind === 'scene') load(packet);
    else if (packet.head.kind === 'slice') view.showSlice(input('slice-on').checked ? packet : null);
    else if (packet.head.kind === 'state') { keep(packet); newest = packet; heard = performance.now(); recording = packet.head.recording; }
    else if (packet.head.kind === 'note') hint(packet.head.text);
  };
  socket.onclose = () => { heard = 0; chip('state', 'the program has ended', 'bad'); };
}

function changeContact(change: object) { ask({ do: 'contact', ...change }); }
function setPace(value: number) { ask({ do: 'pace', pace: value }); }
function pause() {
  paused = !paused;
  $('pause').setAttribute('aria-pressed', String(paused));
  $('pause').textContent = paused ? 'go on' : 'pause';
  $('pause').classList.toggle('on', paused);
  setPace(paused ? 0 : pace);
}
// These requests begin a new run, which keeps the pace. Of a paused one nothing would be seen.
function again(request: object) {
  if (paused) pause();
  ask(request);
}
function clutch(on: boolean) {
  clutched = on;
  $('clutch').classList.toggle('on', on);
  $('clutch').setAttribute('aria-pressed', String(on));
  ask({ do: 'clutch', on });
}
function askSlice() {
  if (!input('slice-on').checked) { view.showSlice(null); return; }
  ask({ do: 'slice', axis: Number($<HTMLSelectElement>('slice-axis').value), at: Number(input('slice-at').value) });
}

$('method').onchange = () => changeContact({ method: $<HTMLSelectElement>('method').value });
for (const [id, key] of [['stiffness', 'stiffness'], ['epsilon', 'epsilon'], ['saturation', 'max_depth_voxels'], ['hand', 'hand_stiffness']])
  input(id).onchange = () => changeContact({ [key]: 10 ** Number(input(id).value) });
$('path').onclick = () => ask({ do: 'grab', on: false });
$('clutch').onclick = () => clutch(!clutched);
$('pause').onclick = pause;
input('pace').oninput = () => { pace = Number(input('pace').value); if (!paused) setPace(pace); };
$('reset').onclick = () => again({ do: 'reset' });
$('keep').onclick = () => ask({ do: 'keep' });
$('back').onclick = () => again({ do: 'back' });
$('headset').onclick = () => headset?.toggle().catch((e) => hint(`the headset cannot be used: ${e.message}`));
$('record').onclick = () => again({ do: 'record', on: !recording });
input('opacity').oninput = () => view.environmentOpacity(Number(input('opacity').value));
for (const id of ['slice-on', 'slice-axis', 'slice-at']) $(id).oninput = askSlice;
addEventListener('keydown', (e) => {
  if (e.repeat || e.target instanceof HTMLSelectElement) return;
  if (e.key === ' ' && !inControl(e)) { e.preventDefault(); pause(); }
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  if (e.key === 'c') clutch(true);
  if (e.key === 'k') ask({ do: 'keep' });
  if (e.key === 'u') again({ do: 'back' });
});
addEventListener('keyup', (e) => { if (e.key === 'c') clutch(false); });

let drawn: Packet | null = null, strips_at = 0;
function tick(now: number, frame?: XRFrame) {
  const passed = now - last;
  last = now;
  if (passed < 5000) slow = 0.9 * slow + 0.1 * passed;
  steer?.tick(passed / 1000);
  if (scene && newest && newest !== drawn) {
    drawn = newest;
    show(newest);
    if (socket.readyState === WebSocket.OPEN) socket.send('seen');
    if (now - strips_at > 90) {
      strips_at = now;
      strips.show([{ rows, width }]);
    }
  }
  if (newest === drawn) freshness();
  const h = newest?.head;
  headset?.tick(frame, h && performance.now() - heard < 1000 ? { force: h.force, most: h.contact.max_force, contacts: h.contacts } : null);
  view.render();
}
connect();
view.renderer.setAnimationLoop(tick);  // a headset calls it at its own rate
// The browser tests read numbers here instead of pixels.
(window as any).hapsix = {
  view, ask, state: () => newest?.head, drag: () => drag, headset: () => headset,
  // The greatest penetration depth since a time of the run [voxel].
  deepest(since: number) {
    let most = 0;
    for (let i = 0; i < rows.length; i += width) if (rows[i] >= since) most = Math.max(most, rows[i + 4]);
    return most;
  },
  pointOn: (body: number) => view.visiblePoint(body),
};
