import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { CHROMIUM_FLAGS, until } from './support.mjs';

/** Controls Chromium over a pipe. Playwright copies every WebSocket frame, which makes them ten times
 * slower. */
export class BareChromium {
  #profile = mkdtempSync(path.join(tmpdir(), 'partiemc-chromium-'));
  #pending = new Map();
  #next = 0;
  #rest = '';
  #session;

  constructor() {
    this.child = spawn(process.env.CHROMIUM ?? '/usr/bin/chromium', [
      '--headless=new', '--remote-debugging-pipe', `--user-data-dir=${this.#profile}`,
      '--no-first-run', '--window-size=1280,800', '--enable-precise-memory-info', ...CHROMIUM_FLAGS,
      'about:blank',
    ], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.child.stdio[4].setEncoding('utf8');
    this.child.stdio[4].on('data', (text) => this.#receive(text));
  }

  /** A tab at this address. */
  async open(url) {
    const { targetId } = await this.send('Target.createTarget', { url: 'about:blank' });
    const { sessionId } = await this.send('Target.attachToTarget', { targetId, flatten: true });
    this.#session = sessionId;
    await this.send('Page.navigate', { url });
  }

  /** Calls a function in the page, with `argument` as JSON. */
  async evaluate(run, argument = null) {
    const { result, exceptionDetails } = await this.send('Runtime.evaluate', {
      expression: `(${run})(${JSON.stringify(argument)})`, awaitPromise: true, returnByValue: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  send(method, params = {}) {
    const id = ++this.#next;
    this.child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId: this.#session })}\0`);
    return new Promise((resolve, reject) => this.#pending.set(id, { resolve, reject }));
  }

  async close() {
    this.child.kill();
    await once(this.child, 'exit');
    // Chromium's other processes still write for a moment.
    await until('the profile is removed', () => {
      try {
        rmSync(this.#profile, { recursive: true, force: true });
        return true;
      } catch {
        return false;
      }
    });
  }

  #receive(text) {
    const messages = (this.#rest + text).split('\0');
    this.#rest = messages.pop();
    for (const message of messages) {
      const { id, result, error } = JSON.parse(message);
      const waiting = this.#pending.get(id);
      this.#pending.delete(id);
      if (error) waiting?.reject(new Error(error.message));
      else waiting?.resolve(result);
    }
  }
}
