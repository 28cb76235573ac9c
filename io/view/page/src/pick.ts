// SPDX-License-Identifier: Apache-2.0
// The page of `hapsix bake deformable --pick`: the user marks vertices of a solid mesh.
import { floats, unpack, type Packet } from './envelope';
import { Marks } from './marks';
import { Solid3D } from './solid3d';

const $ = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;
const input = (id: string) => $<HTMLInputElement>(id);
const touch = matchMedia('(pointer: coarse)').matches;

let socket: WebSocket;
let solid: Solid3D, marks: Marks;
let origin = [0, 0, 0], radius = 1, perUnit = 1, unit = 'm';  // of the mesh [m]; metres of its unit
let ended = '';              // why the page has nothing more to do
const cross = { x: 0, y: 0, shown: false };  // of the keyboard [pixel]

function chip(text: string, kind: string) {
  $('state').textContent = text;
  $('state').className = `chip ${kind}`;
}
function hint(text: string) { $('hint').firstElementChild!.textContent = text; }
const brush = () => 10 ** Number(input('radius').value);  // [radius of the mesh]
const adds = (event?: { shiftKey: boolean }) => input('does-add').checked !== Boolean(event?.shiftKey);
const number = (metres: number) => `${Number((metres / perUnit).toPrecision(3))} ${unit}`;

function tell() {
  solid.show(marks.on);
  $('count').textContent = String(marks.count);
  const use = $<HTMLButtonElement>('use');
  use.textContent = `Use these ${marks.count}`;
  use.disabled = marks.count === 0 || ended !== '';
  $<HTMLButtonElement>('undo').disabled = !marks.mayUndo;
  $<HTMLButtonElement>('redo').disabled = !marks.mayRedo;
}
function put(vertices: number[], marked: boolean, what: string) {
  const before = marks.count;
  marks.put(vertices, marked);
  const change = marks.count - before;
  hint(change > 0 ? `${change} more fixed ${what}` : change < 0 ? `${-change} freed ${what}` : `nothing changes ${what}`);
  tell();
}
function step(what: 'undo' | 'redo') {
  marks[what]();
  hint(what === 'undo' ? 'undone' : 'done again');
  tell();
}

function paintAt(x: number, y: number, marked: boolean) {
  const at = solid.hit(x, y);
  solid.showBrush(at, brush());
  if (at) put(solid.ball(at, brush()), marked, `within ${number(brush() * radius)}`);
  return at !== null;
}

// ---- the mouse and fingers

// What the pointer does now. A second finger always turns.
let act: { id: number; kind: 'paint' | 'box'; x: number; y: number; marked: boolean } | null = null;

const place = (event: PointerEvent) => {
  const r = solid.renderer.domElement.getBoundingClientRect();
  return { x: event.clientX - r.left, y: event.clientY - r.top };
};
function rubber(x0: number, y0: number, x1: number, y1: number) {
  Object.assign($('rubber').style, { left: `${Math.min(x0, x1)}px`, top: `${Math.min(y0, y1)}px`,
    width: `${Math.abs(x1 - x0)}px`, height: `${Math.abs(y1 - y0)}px` });
}
function down(event: PointerEvent) {
  if (act && event.pointerId !== act.id) return leave(false);
  const { x, y } = place(event);
  const box = input('tool-box').checked, on = box || solid.hit(x, y) !== null;
  const turns = event.button !== 0 || !on || ended !== '';
  solid.firstTurns(turns);
  if (turns) return;
  act = { id: event.pointerId, kind: box ? 'box' : 'paint', x, y, marked: adds(event) };
  solid.renderer.domElement.setPointerCapture(event.pointerId);
  $('rubber').hidden = !box;
  if (box) rubber(x, y, x, y); else paintAt(x, y, act.marked);
}
function move(event: PointerEvent) {
  const { x, y } = place(event);
  if (!act) {
    const shown = input('tool-brush').checked && event.buttons === 0;
    return solid.showBrush(shown ? solid.hit(x, y) : null, brush());
  }
  if (event.pointerId !== act.id) return;
  if (act.kind === 'box') rubber(act.x, act.y, x, y); else paintAt(x, y, act.marked);
}
function up(event: PointerEvent) {
  if (!act || event.pointerId !== act.id) return;
  const { x, y } = place(event);
  if (act.kind === 'box')
    put(solid.rectangle(act.x, act.y, x, y, input('through').checked), act.marked, 'in the rectangle');
  leave(true);
}
// `whole`: the stroke counts; else it is taken back, since a second finger came.
function leave(whole: boolean) {
  act = null;
  $('rubber').hidden = true;
  if (whole) marks.endStroke(); else marks.dropStroke();
  tell();
}

// ---- keys

function keyOnPart(event: KeyboardEvent) {
  const arrows: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const way = arrows[event.key], size = solid.size();
  if (ended) return;
  if (way && event.altKey) solid.turn(0.1 * way[0], 0.1 * way[1]);
  else if (way) {
    cross.x = Math.min(size.w - 1, Math.max(0, cross.x + 12 * way[0]));
    cross.y = Math.min(size.h - 1, Math.max(0, cross.y + 12 * way[1]));
    showCross();
  } else if (event.key === ' ') {
    showCross();
    if (!paintAt(cross.x, cross.y, adds(event))) hint('the cross is beside the part');
    marks.endStroke();
    tell();
  } else if (event.key === 'PageUp' || event.key === 'PageDown') {
    input('radius').value = String(Number(input('radius').value) + (event.key === 'PageUp' ? 0.1 : -0.1));
    radiusChanged();
    showCross();
  } else if (event.key === '+' || event.key === '-') solid.turn(0, 0, event.key === '+' ? 0.9 : 1.1);
  else return;
  event.preventDefault();
}
function showCross() {
  cross.shown = true;
  const at = solid.hit(cross.x, cross.y), mark = $('cross');
  mark.hidden = false;
  Object.assign(mark.style, { left: `${cross.x}px`, top: `${cross.y}px` });
  solid.showBrush(at, brush());
}
function keyAnywhere(event: KeyboardEvent) {
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === 'z') {
    step(event.shiftKey ? 'redo' : 'undo');
    event.preventDefault();
  }
}

// ---- boxes by coordinates

function byCoordinates(marked: boolean) {
  const low: number[] = [], high: number[] = [];
  for (const [i, axis] of ['x', 'y', 'z'].entries()) {
    const a = input(`${axis}0`).valueAsNumber, b = input(`${axis}1`).valueAsNumber;
    if (!Number.isFinite(a) || !Number.isFinite(b)) return hint(`the box needs two numbers for ${axis}`);
    low[i] = (Math.min(a, b) * perUnit - origin[i]) / radius - 1e-5;  // the page has 24 bits
    high[i] = (Math.max(a, b) * perUnit - origin[i]) / radius + 1e-5;
  }
  const found: number[] = [], p = solid.place;
  for (let v = 0, k = 0; k < p.length; ++v, k += 3)
    if ([0, 1, 2].every((i) => p[k + i] >= low[i] && p[k + i] <= high[i])) found.push(v);
  put(found, marked, 'in the box');
  marks.endStroke();
  tell();
}

function radiusChanged() {
  $('radius-out').textContent = number(brush() * radius);
  solid.showBrush(solid.brush.visible ? solid.brush.position.clone() : null, brush());
}

// ---- the program

function end(text: string, kind: string) {
  ended = text;
  chip(text, kind);
  hint(text);
  for (const button of document.querySelectorAll('button')) button.disabled = true;
}
function load(packet: Packet) {
  const { head } = packet, index = packet.arrays.get('index');
  origin = head.origin, radius = head.radius, perUnit = head.metres, unit = head.unit;
  $('scene').textContent = head.name;
  $('unit').textContent = unit;
  solid = new Solid3D($('space'), floats(packet, 'position'), index instanceof Uint32Array ? index : new Uint32Array(0));
  const fixed = packet.arrays.get('fixed');
  marks = new Marks(head.vertices, fixed instanceof Uint32Array ? fixed : []);
  $('all').textContent = String(head.vertices);
  const canvas = solid.renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute('role', 'application');
  canvas.setAttribute('aria-label', 'the part; arrow keys move a cross, Space fixes vertices there, Shift and Space free them');
  // Before the camera's own listeners, which follow `enabled`.
  $('space').addEventListener('pointerdown', (e) => { if (e.target === canvas) { canvas.focus(); down(e); } }, { capture: true });
  canvas.addEventListener('pointermove', move);
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', () => { if (act) leave(false); });
  canvas.addEventListener('pointerleave', () => solid.showBrush(null, brush()));
  canvas.addEventListener('keydown', keyOnPart);
  canvas.addEventListener('blur', () => { $('cross').hidden = true; solid.showBrush(null, brush()); });
  document.addEventListener('keydown', keyAnywhere);
  cross.x = Math.round(solid.size().w / 2), cross.y = Math.round(solid.size().h / 2);
  hint(touch ? 'One finger fixes vertices · two turn and come nearer'
    : 'Drag on the part to fix vertices · Shift frees them · drag beside it, or with the right button, to turn it · wheel comes nearer');
  radiusChanged();
  tell();
  chip('choose', 'good');
  const draw = () => { solid.render(); requestAnimationFrame(draw); };
  draw();
}
function heard(packet: Packet) {
  if (packet.head.kind === 'solid' && !solid) {
    try {
      load(packet);
    } catch (error) {
      chip('no WebGL', 'bad');
      hint('This browser offers no WebGL, so the part cannot be drawn: allow it in the settings, or use another browser.');
      throw error;
    }
  }
  if (packet.head.kind === 'note') { chip('choose', 'good'); hint(packet.head.text); }
  if (packet.head.kind === 'done') end('The program has the vertices; this page can be closed.', 'good');
}
function connect() {
  socket = new WebSocket(`ws://${location.host}/live${location.search}`);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (m) => heard(unpack(m.data));
  socket.onclose = () => {
    if (ended) return;
    if (solid) return end('The program has ended.', 'bad');
    chip('no program', 'bad');
  };
}

const says = (request: object) => { if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request)); };
$('use').onclick = () => { chip('sending', 'warn'); says({ do: 'use', vertices: marks.marked() }); };
$('cancel').onclick = () => { says({ do: 'cancel' }); end('Nothing was chosen; this page can be closed.', 'warn'); };
$('undo').onclick = () => step('undo');
$('redo').onclick = () => step('redo');
$('box-add').onclick = () => byCoordinates(true);
$('box-remove').onclick = () => byCoordinates(false);
$('clear').onclick = () => { put(marks.marked(), false, 'everywhere'); marks.endStroke(); tell(); };
input('radius').oninput = radiusChanged;
const mark = document.createElement('div');
mark.id = 'cross', mark.hidden = true;
$('space').appendChild(mark);
connect();
Object.assign(window, { hapsix: { solid: () => solid, marks: () => marks } });
