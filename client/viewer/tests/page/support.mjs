// Common parts of the page's tests: a server, streams, Chromium, and the page.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { createRequire } from 'node:module';
import path from 'node:path';
import { after, afterEach } from 'node:test';
import { setTimeout as sleep } from 'node:timers/promises';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';
import { chromium } from 'playwright-core';

export const viewer = path.resolve(path.dirname(fileURLToPath(import.meta.url)), '../..');
export const root = path.resolve(viewer, '../..');
export const recording = path.join(root, 'client/recordings/dam_break.pemc');
export const screenshots = path.join(viewer, 'build/screenshots');
/** Folder of partiemc and partiemc-server. */
const bin = path.resolve(process.env.PARTIEMC_BIN ?? path.join(root, 'build/release/bin'));
const chromiumPath = process.env.CHROMIUM ?? '/usr/bin/chromium';

/** Draws without a graphics card: WebGL by SwiftShader, the page by Chromium's own software renderer,
 * which is four times faster for it. */
export const CHROMIUM_FLAGS = [
  '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--disable-gpu-compositing',
];

/** Timeout of short operations. Long, because tests share their machine. */
export const PATIENCE_MS = Number(process.env.PATIENCE_MS ?? 60_000);

/** Waits until `value()` is truthy, and returns it. */
export async function until(what, value, patienceMs = PATIENCE_MS) {
  const end = Date.now() + patienceMs;
  while (true) {
    const result = await value();
    if (result) return result;
    if (Date.now() > end) throw new Error(`${what}: not within ${patienceMs} ms`);
    await sleep(20);
  }
}

/** A module of the page, for computations in tests. */
export async function moduleOf(file) {
  const { outputFiles: [{ text }] } = await build({
    entryPoints: [path.join(viewer, file)], bundle: true, format: 'esm', write: false, logLevel: 'warning',
  });
  return import(`data:text/javascript,${encodeURIComponent(text)}`);
}

function start(program, args, log) {
  const child = spawn(path.join(bin, program), args, { stdio: ['ignore', 'pipe', 'pipe'] });
  for (const stream of [child.stdout, child.stderr]) {
    stream.setEncoding('utf8');
    stream.on('data', (text) => log.push(text));
  }
  return child;
}

async function stop(child, signal = 'SIGTERM') {
  if (!child || child.exitCode !== null || child.signalCode !== null) return;
  child.kill(signal);
  child.kill('SIGCONT');  // It may be stopped.
  await once(child, 'exit');
}

/** A server with its page and its producers. */
export class World {
  folder = mkdtempSync(path.join(tmpdir(), 'partiemc-page-'));
  log = [];
  #server = null;
  #producers = [];
  #address = '127.0.0.1:0';
  #web = '127.0.0.1:0';
  #options;

  constructor(...options) { this.#options = options; }

  static async start(...options) {
    const world = new World(...options);
    await world.startServer();
    return world;
  }

  /** The page's address. */
  get url() { return `http://${this.#web}/`; }

  /** Starts the server; a restart uses the same addresses. */
  async startServer() {
    const file = (name) => path.join(this.folder, name);
    rmSync(file('address'), { force: true });
    rmSync(file('web'), { force: true });
    this.#server = start('partiemc-server', [
      '--address', this.#address, '--port-file', file('address'),
      '--web', this.#web, '--web-port-file', file('web'),
      '--web-root', path.join(viewer, 'build/page'), ...this.#options,
    ], this.log);
    const read = (name) => existsSync(file(name)) && readFileSync(file(name), 'utf8').trim();
    await until(`the server starts; it says ${this.log.join('')}`, () => {
      if (this.#server.exitCode !== null) throw new Error(`the server ended: ${this.log.join('')}`);
      return read('address') && read('web');
    });
    this.#address = read('address');
    this.#web = read('web');
  }

  async killServer() { await stop(this.#server, 'SIGKILL'); }

  /** Streams a file. */
  replayOf(file, name, ...options) {
    const child = start('partiemc', [
      'replay', file, '--server', this.#address, '--name', name, '--quiet', ...options,
    ], this.log);
    this.#producers.push(child);
    return { stop: () => stop(child), rest: () => child.kill('SIGSTOP') };
  }

  /** Streams the bundled dam break in a loop. Slowly, because browser and server may share two cores. */
  loop(name, ...options) {
    const rate = options.includes('--rate') ? [] : ['--rate', '15'];
    return this.replayOf(recording, name, '--loop', ...rate, '--echo-particles', ...options);
  }

  /** Converts files to a recording. */
  async convert(input, output, ...options) {
    const child = start('partiemc', ['convert', input, output, '--quiet', ...options], this.log);
    const [code] = await once(child, 'exit');
    if (code !== 0) throw new Error(`partiemc convert: ${this.log.join('')}`);
  }

  /** Numbers of every frame, from `partiemc replay --stats`. */
  async statistics(input, ...options) {
    const file = path.join(this.folder, 'statistics.json');
    await replay(input, '--stats', file, ...options);
    return JSON.parse(readFileSync(file, 'utf8'));
  }

  /** Information on the server. */
  async information() {
    const child = start('partiemc', ['info', '--server', this.#address, '--json'], this.log);
    let text = '';
    child.stdout.on('data', (piece) => { text += piece; });
    await once(child, 'close');
    return JSON.parse(text);
  }

  async close() {
    for (const child of this.#producers) await stop(child);
    await stop(this.#server);
    rmSync(this.folder, { recursive: true, force: true });
  }
}

export const launch = (flags = CHROMIUM_FLAGS) => chromium.launch({ executablePath: chromiumPath, args: flags });

/**
 * Closes the page after each test, and browser and server after all. `opened`: what is open then, as
 * { world, browser, viewer }. The console of the page must have no errors, unless a test of the file makes some.
 */
export function cleansUp(opened, { makesErrors = false } = {}) {
  mkdirSync(screenshots, { recursive: true });
  let closed = null;
  afterEach(async () => {
    const { viewer } = opened();
    if (!viewer || viewer === closed) return;
    closed = viewer;
    await viewer.close();
    if (!makesErrors) assert.deepEqual(viewer.errors, [], 'the console has no errors');
  });
  after(async () => {
    const { browser, world } = opened();
    await browser?.close();
    await world?.close();
  });
}

/** Runs `partiemc replay --local` to its end. */
export async function replay(input, ...options) {
  const log = [];
  const child = start('partiemc', ['replay', input, '--local', '--quiet', ...options], log);
  const [code] = await once(child, 'exit');
  if (code !== 0) throw new Error(`partiemc replay: ${log.join('')}`);
}

/** The page in a new tab, and actions of a user. */
export class Viewer {
  /** Console errors and uncaught exceptions. */
  errors = [];

  static async open(browser, url, options = {}) {
    const { width = 1600, height = 900, colorScheme = 'light', hash = '' } = options;
    const context = await browser.newContext({
      viewport: { width, height }, colorScheme, acceptDownloads: true,
    });
    const it = new this();
    it.page = await context.newPage();
    it.page.setDefaultTimeout(PATIENCE_MS);
    it.page.on('console', (message) => {
      if (message.type() === 'error') it.errors.push(message.text());
    });
    it.page.on('pageerror', (error) => it.errors.push(String(error.stack)));
    await it.page.goto(url + hash);
    return it;
  }

  pane(k = 0) { return this.page.locator('.pane').nth(k); }
  button(name) { return this.page.getByRole('button', { name, exact: true }); }

  /** Text of a number under a picture. */
  async value(key, k = 0) {
    const cell = this.pane(k).locator(`[data-key="${key}"]`);
    return await cell.count() ? (await cell.textContent()).trim() : '';
  }

  async frame(k = 0) { return Number(await this.value('frame', k)) || 0; }

  /** Pauses, and returns the frame. The page writes its number in the next refresh of the screen. */
  async pause(k = 0) {
    await this.button('Pause').click();
    await this.refreshes();
    return this.frame(k);
  }

  async numbers(k = 0) {
    const cells = await this.pane(k).locator('[data-key]').evaluateAll(
      (all) => all.map((cell) => [cell.dataset.key, cell.textContent.trim()]));
    return Object.fromEntries(cells);
  }

  /** Pixels of a picture, as a string. */
  async picture(k = 0) { return (await this.pixelsOf(this.pane(k).locator('.picture'))).toString('base64'); }

  /** An element's pixels as PNG, at once. `Locator.screenshot` first waits for two refreshes of the screen
   * between which the element does not move; a page that draws frames by software on a busy machine may
   * have none within a minute. */
  async pixelsOf(element) {
    const clip = await element.evaluate((shown) => {
      shown.scrollIntoView({ behavior: 'instant', block: 'nearest', inline: 'nearest' });
      const { x, y, width, height } = shown.getBoundingClientRect();
      return { x, y, width, height };
    });
    return this.page.screenshot({ clip });
  }

  /** Waits until the page has drawn all changes so far. */
  refreshes() {
    return this.page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
  }

  status() { return this.page.getByRole('status').textContent(); }

  /** Drops files and folders on the page. */
  async drop(...paths) {
    await this.refreshes();  // A page takes drag events after its first picture only.
    const session = await this.page.context().newCDPSession(this.page);
    const data = { items: [], files: paths, dragOperationsMask: 1 };
    for (const type of ['dragEnter', 'dragOver', 'drop']) {
      await session.send('Input.dispatchDragEvent', { type, x: 300, y: 300, data });
    }
  }

  /** Waits until all frames of dropped files are here. */
  allFrames() {
    return until('all frames are here', async () => /All frames received/.test(await this.pane().locator('.state').getAttribute('title')));
  }

  /** Waits until a frame after `sequence` is shown. */
  async shows(sequence = 0, k = 0) {
    return until(`a frame above ${sequence} is shown`, async () => {
      const frame = await this.frame(k);
      return frame > sequence && frame;
    });
  }

  /** Waits until the slider's range holds a frame. The page fetches the past after its first picture. */
  async reaches(sequence) {
    const slider = this.page.getByLabel('Frame', { exact: true });
    await until(`the slider reaches frame ${sequence}`, () => slider.evaluate(
      ({ min, max }, at) => Number(min) <= at && at <= Number(max), sequence));
  }

  /** `number`: of the frame for the user. Files count from 0, as the command line does. */
  async scrubTo(sequence, number = sequence) {
    await this.reaches(sequence);
    await this.page.getByLabel('Frame', { exact: true }).evaluate((slider, value) => {
      slider.value = String(value);
      slider.dispatchEvent(new Event('input', { bubbles: true }));
    }, sequence);
    await until(`frame ${number} is shown`, async () => await this.value('frame') === String(number));
  }

  async close() { await this.page.context().close(); }
}

/** Controls without a tooltip of one sentence, their own or their label's. A disabled one names its reason. */
export function withoutTooltip(page) {
  return page.evaluate(() => [...document.querySelectorAll('button, select, input')]
    .filter((element) => !/^[A-Z]([^.]|\.\d)*\.$/.test(element.title || element.labels?.[0]?.title || '') &&
                         !(element.disabled && element.labels?.[0]?.title))
    .map((element) => element.outerHTML));
}

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** Serious and critical violations, one line each. */
export async function violations(page) {
  await page.evaluate(axe);
  const results = await page.evaluate(
    () => window.axe.run(document, { resultTypes: ['violations'] }));
  return results.violations.filter(({ impact }) => impact === 'serious' || impact === 'critical')
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(' | ')}`);
}
