// A real browser without a window, driven over the DevTools protocol through a pipe: no port, no package.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, existsSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { pathToFileURL } from 'node:url';

/** Ends the test as skipped. */
export function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);  // CTest's SKIP_RETURN_CODE
}

/** Chromium as Debian and others install it, or nothing. */
function chromium() {
  const names = ['chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'];
  const places = (process.env.PATH ?? '').split(':').flatMap((folder) => names.map((name) => join(folder, name)));
  return places.find((place) => existsSync(place));
}

/** A connection to the browser, or to one of its pages. */
class Session {
  constructor(browser, id) { Object.assign(this, { browser, id }); }

  send(method, params = {}) { return this.browser.send(method, params, this.id); }
}

class Browser {
  waiting = new Map();
  listeners = [];
  number = 0;

  /** @param {string[]} graphics how it draws in 3-D, or that it does not */
  constructor(program, graphics) {
    this.home = mkdtempSync(join(tmpdir(), 'octosurf-page-'));
    const options = ['--headless=new', '--remote-debugging-pipe', `--user-data-dir=${this.home}`, '--no-first-run',
      ...graphics, '--hide-scrollbars', '--force-color-profile=srgb', '--disable-extensions',
      '--disable-background-networking', '--no-proxy-server'];
    if (process.getuid() === 0) options.push('--no-sandbox');
    this.process = spawn(program, [...options, 'about:blank'], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.gone = new Promise((resolve) => this.process.once('exit', resolve));
    this.process.once('exit', () => {
      for (const { reject } of this.waiting.values()) reject(new Error('the browser has ended'));
    });
    this.process.stdio[3].on('error', () => {});  // told by 'exit'
    let text = '';
    this.process.stdio[4].setEncoding('utf8').on('data', (part) => {
      const messages = (text + part).split('\0');
      text = messages.pop();
      for (const message of messages) this.receive(JSON.parse(message));
    });
  }

  receive({ id, result, error, method, params, sessionId }) {
    if (id === undefined) {
      for (const listener of this.listeners) listener(method, params, sessionId);
      return;
    }
    const { resolve, reject } = this.waiting.get(id);
    this.waiting.delete(id);
    if (error) reject(new Error(error.message));
    else resolve(result);
  }

  send(method, params = {}, sessionId = undefined) {
    const id = ++this.number;
    this.process.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  /**
   * @param {string} file or an address
   * @param {{width?: number, height?: number, dark?: boolean, touch?: boolean}} how
   */
  async open(file, { width = 1280, height = 800, dark = false, touch = false } = {}) {
    const { targetId } = await this.send('Target.createTarget', { url: 'about:blank' });
    const { sessionId } = await this.send('Target.attachToTarget', { targetId, flatten: true });
    const page = new Page(new Session(this, sessionId), targetId);
    this.listeners.push((method, params, from) => { if (from === sessionId) page.note(method, params); });
    for (const domain of ['Page', 'Runtime', 'Log', 'Network']) await page.session.send(`${domain}.enable`);
    await page.session.send('Emulation.setDeviceMetricsOverride',
      { width, height, deviceScaleFactor: 1, mobile: touch });
    if (touch) await page.session.send('Emulation.setTouchEmulationEnabled', { enabled: true });
    await page.session.send('Emulation.setEmulatedMedia',
      { features: [{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }] });
    page.url = file.startsWith('http:') ? file : pathToFileURL(file).href;
    await page.session.send('Page.navigate', { url: page.url });
    await page.until('window.octosurf !== undefined || document.getElementById("message")?.hidden === false', 60);
    await page.settled();
    return page;
  }

  async close() {
    this.process.kill();
    await this.gone;
    // Its helper processes write for a moment longer.
    for (let left = 50; left > 0 && existsSync(this.home); --left)
      try { rmSync(this.home, { recursive: true, force: true }); } catch { await sleep(100); }
  }
}

class Page {
  errors = [];    // whatever the console or the browser complained about
  fetched = [];   // addresses beside the page's own

  constructor(session, target) {
    this.session = session;
    this.target = target;
  }

  note(method, params) {
    if (method === 'Runtime.exceptionThrown')
      this.errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && ['error', 'warning', 'assert'].includes(params.type))
      this.errors.push(params.args.map((one) => one.value ?? one.description).join(' '));
    if (method === 'Log.entryAdded' && ['error', 'warning'].includes(params.entry.level))
      this.errors.push(params.entry.text);
    if (method === 'Network.requestWillBeSent' && params.request.url !== this.url &&
        !params.request.url.startsWith('data:')) this.fetched.push(params.request.url);
  }

  /** The value of an expression in the page; `page` is what main.js leaves there. */
  async value(expression) {
    const { result, exceptionDetails } = await this.session.send('Runtime.evaluate',
      { expression: `(async () => { const page = window.octosurf; return ${expression}; })()`,
        awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${exceptionDetails.exception?.description ?? exceptionDetails.text}: ${expression}`);
    return result.value;
  }

  async until(expression, seconds = 30) {
    const end = performance.now() + 1000 * seconds;
    for (;;) {
      const value = await this.value(expression);
      if (value) return value;
      if (performance.now() > end) throw new Error(`not within ${seconds} s: ${expression}`);
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
  }

  /** Drawn, whole, at rest. */
  async settled() {
    await this.until('!page.view.asked && !page.view.moving');
    await this.value('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))');
  }

  mouse(type, x, y, more = {}) {
    return this.session.send('Input.dispatchMouseEvent', { type, x, y, ...more });
  }

  async hover(x, y) {
    await this.mouse('mouseMoved', x, y);
    await this.settled();
  }

  async click(x, y) {
    await this.mouse('mouseMoved', x, y);
    await this.mouse('mousePressed', x, y, { button: 'left', buttons: 1, clickCount: 1 });
    await this.mouse('mouseReleased', x, y, { button: 'left', clickCount: 1 });
    await this.settled();
  }

  /** The middle of an element, as a person would press it. */
  async press(selector) {
    const { x, y } = await this.value(`(() => {
      const element = document.querySelector(${JSON.stringify(selector)});
      element.scrollIntoView({ block: 'nearest' });
      const box = element.getBoundingClientRect();
      return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    })()`);
    await this.click(x, y);
  }

  async drag(from, to, steps = 8) {
    await this.mouse('mouseMoved', ...from);
    await this.mouse('mousePressed', ...from, { button: 'left', buttons: 1, clickCount: 1 });
    for (let i = 1; i <= steps; ++i) {
      const at = from.map((x, k) => x + (to[k] - x) * i / steps);
      await this.mouse('mouseMoved', ...at, { button: 'left', buttons: 1 });
    }
    await this.mouse('mouseReleased', ...to, { button: 'left', clickCount: 1 });
    await this.settled();
  }

  async tap(x, y) {
    await this.session.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [{ x, y }] });
    await this.session.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
    await this.settled();
  }

  async key(key) {
    await this.session.send('Input.dispatchKeyEvent', { type: 'keyDown', key });
    await this.session.send('Input.dispatchKeyEvent', { type: 'keyUp', key });
    await this.settled();
  }

  /** What has this id, as if it were clicked. @param {'surface'|'cylinder'} kind */
  pick(kind, id) {
    return this.value(`page.select({ kind: '${kind}', what: page.map.${kind}(${id}), place: [0, 0, 0] })`);
  }

  /** A choice of the panel, as its reader sets it. */
  async choose(selector, value) {
    await this.value(`(() => {
      const field = document.querySelector(${JSON.stringify(selector)});
      field.value = '${value}';
      field.dispatchEvent(new Event('change'));
    })()`);
    await this.settled();
  }

  text(selector) {
    return this.value(`document.querySelector(${JSON.stringify(selector)}).textContent`);
  }

  visible(selector) {
    return this.value(`document.querySelector(${JSON.stringify(selector)}).checkVisibility()`);
  }

  /** Colours [r, g, b] of the canvas at places of the page, as they are drawn. */
  colors(places) {
    return this.value(`(() => {
      const { canvas, pixels } = page.view, gl = page.view.renderer.getContext();
      page.view.draw();
      const box = canvas.getBoundingClientRect();
      return ${JSON.stringify(places)}.map(({ x, y }) => {
        const rgba = new Uint8Array(4);
        gl.readPixels(Math.round((x - box.left) / box.width * pixels.x), Math.round((1 - (y - box.top) / box.height) * pixels.y),
          1, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
        return [...rgba.subarray(0, 3)];
      });
    })()`);
  }
}

const byProcessor = ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];

/** Calls the tests one after the other with a browser and a folder. */
export async function runInBrowser(tests, graphics = byProcessor) {
  const program = chromium() ?? skip('no Chromium');
  const browser = new Browser(program, graphics), folder = mkdtempSync(join(tmpdir(), 'octosurf-page-'));
  try {
    for (const test of tests) {
      const begin = performance.now();
      await test(browser, folder);
      console.log(`${test.name}: well, ${((performance.now() - begin) / 1000).toFixed(1)} s`);
    }
  } finally {
    await browser.close();
    rmSync(folder, { recursive: true, force: true });
  }
}
