// SPDX-License-Identifier: Apache-2.0
// Drives headless Chromium over its DevTools protocol: opens a page, evaluates in it, uses the mouse.
import { spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import WebSocket from 'ws';

export const wait = (ms) => new Promise((done) => setTimeout(done, ms));

// Polls `what` until it is truthy; throws with `sentence` after `seconds`.
export async function until(what, sentence, seconds = 60) {
  const end = Date.now() + 1000 * seconds;
  for (;;) {
    const value = await what();
    if (value) return value;
    if (Date.now() > end) throw new Error(`not within ${seconds} s: ${sentence}`);
    await wait(100);
  }
}

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

export class Browser {
  problems = [];  // console errors and exceptions of the page
  #waiting = new Map();
  #next = 1;

  static async open(program, { webgl = true } = {}) {
    const b = new Browser();
    b.folder = mkdtempSync(join(tmpdir(), 'hapsix-view-'));
    // Software GL: the machine may have no graphics card. /dev/shm may be small. `detached` makes a process
    // group of its own, so that close() also ends the helper processes: they write to the folder.
    b.process = spawn(program, ['--headless=new', '--no-sandbox', '--disable-dev-shm-usage',
      ...(webgl ? ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader']
        : ['--disable-gpu', '--disable-software-rasterizer', '--disable-3d-apis']),
      '--hide-scrollbars', '--no-first-run', '--disable-extensions', '--disable-background-networking',
      '--window-size=1280,860', '--remote-debugging-port=0', `--user-data-dir=${b.folder}`,
      'about:blank'], { stdio: 'ignore', detached: true });
    for (const signal of ['SIGINT', 'SIGTERM'])
      process.once(signal, () => { process.kill(-b.process.pid, 'SIGKILL'); process.exit(1); });
    const file = join(b.folder, 'DevToolsActivePort');
    await until(() => existsSync(file) && readFileSync(file, 'utf8').includes('\n'), 'Chromium starts');
    const port = readFileSync(file, 'utf8').split('\n')[0];
    const page = await until(async () => (await (await fetch(`http://127.0.0.1:${port}/json`)).json())
      .find((t) => t.type === 'page'), 'Chromium has a page');
    b.socket = new WebSocket(page.webSocketDebuggerUrl);
    await new Promise((done, failed) => { b.socket.on('open', done); b.socket.on('error', failed); });
    b.socket.on('message', (data) => b.#heard(JSON.parse(data)));
    for (const domain of ['Page', 'Runtime', 'Log']) await b.send(`${domain}.enable`);
    await b.send('Emulation.setDeviceMetricsOverride', { width: 1280, height: 860, deviceScaleFactor: 1, mobile: false });
    return b;
  }

  #heard(message) {
    if (message.id) {
      const { done, failed } = this.#waiting.get(message.id);
      this.#waiting.delete(message.id);
      if (message.error) failed(new Error(message.error.message)); else done(message.result);
      return;
    }
    const p = message.params;
    if (message.method === 'Runtime.exceptionThrown') this.problems.push(p.exceptionDetails.exception?.description ?? p.exceptionDetails.text);
    if (message.method === 'Runtime.consoleAPICalled' && p.type === 'error') this.problems.push(p.args.map((a) => a.value ?? a.description).join(' '));
    if (message.method === 'Log.entryAdded' && p.entry.level === 'error') this.problems.push(`${p.entry.text} ${p.entry.url ?? ''}`);
  }

  send(method, params = {}) {
    const id = this.#next++;
    this.socket.send(JSON.stringify({ id, method, params }));
    return new Promise((done, failed) => this.#waiting.set(id, { done, failed }));
  }
  async go(url) { await this.send('Page.navigate', { url }); }
  // The value of an expression in the page; waits for a promise.
  async value(expression) {
    const r = await this.send('Runtime.evaluate', { expression, returnByValue: true, awaitPromise: true });
    if (r.exceptionDetails) throw new Error(r.exceptionDetails.exception?.description ?? r.exceptionDetails.text);
    return r.result.value;
  }
  async size(width, height) {
    await this.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
  }
  // 'light' or 'dark', as the system would have it.
  async scheme(value) {
    await this.send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value }] });
  }
  // How far the part is behind the hand [part of the scene's radius], and what the run says.
  async follow() {
    return this.value(`(() => {
      const h = window.hapsix, p = h.view.bodies[h.view.hand].position, g = h.drag && h.drag().held ? h.drag().p : h.view.ghost.position, s = h.state();
      return { behind: p.distanceTo(g) / h.view.radius, contacts: s.contacts, late: s.late ?? null, place: p.toArray() };
    })()`);
  }
  // Moves the hand by `go` until the part touches and stays behind; then it must still do so.
  async meetsWall(go, what) {
    for (let i = 0; i < 60; ++i) {
      await go(i);
      const now = await this.follow();
      if (!(now.contacts > 0 && now.behind > 0.03)) continue;
      await wait(500);
      const later = await this.follow();
      if (!(later.contacts > 0 && later.behind > 0.03)) continue;
      return console.log(`# ${what}: ${later.contacts} contacts, ${(100 * later.behind).toFixed(0)} % of the radius behind the hand, late frames so far: ${JSON.stringify(later.late)}`);
    }
    throw new Error(`${what}: the part never stays behind the hand in contact: ${JSON.stringify(await this.follow())}`);
  }
  // What axe-core finds serious or critical on the page, light and dark; lesser findings are printed.
  async graveFindings() {
    const all = [];
    for (const value of ['light', 'dark']) {
      await this.scheme(value);
      await wait(500);
      const found = await this.value(`(async () => { ${axe}; const r = await window.axe.run(document, { resultTypes: ['violations'] });
        return r.violations.map((v) => ({ id: v.id, impact: v.impact, where: v.nodes.map((n) => n.target.join(' ') + ': ' + n.failureSummary) })); })()`);
      console.log(`# ${value}: ${found.length} findings ${found.map((v) => v.id).join(' ')}`);
      all.push(...found.filter((v) => v.impact === 'serious' || v.impact === 'critical').map((v) => ({ scheme: value, ...v })));
    }
    return all;
  }
  async key(type, key, more = {}) {
    await this.send('Input.dispatchKeyEvent', { type, key, code: key, windowsVirtualKeyCode: { ArrowLeft: 37, ArrowUp: 38, ArrowRight: 39, ArrowDown: 40, PageUp: 33, PageDown: 34, ' ': 32 }[key] ?? 0, ...more });
  }
  async mouse(type, x, y, more = {}) {
    await this.send('Input.dispatchMouseEvent', { type, x, y, button: 'left', buttons: type === 'mouseReleased' ? 0 : 1, clickCount: 1, ...more });
  }
  async picture(file) {
    const { data } = await this.send('Page.captureScreenshot', { format: 'png' });
    const bytes = Buffer.from(data, 'base64');
    writeFileSync(file, bytes);
    return bytes;
  }
  async close() {
    this.socket.close();
    process.kill(-this.process.pid, 'SIGKILL');
    await new Promise((done) => (this.process.exitCode !== null || this.process.signalCode !== null ? done() : this.process.on('exit', done)));
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  }
}
