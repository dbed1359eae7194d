// Recovery of the page from failures.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { launch, until, Viewer, World } from './support.mjs';

const TOKEN = 'a-token-for-the-page-0123456789';
let browser;
before(async () => { browser = await launch(); });
after(async () => { await browser?.close(); });

/** Chromium's own messages on failed connections. */
const isConnection = (text) => /net::ERR_|WebSocket connection to|Failed to load resource/.test(text);

test('the page recovers from a server restart without a reload', async (t) => {
  const world = await World.start();
  const viewer = await Viewer.open(browser, world.url);
  try {
    world.loop('dam');
    await viewer.shows(10);
    await viewer.page.evaluate(() => { window.wasHere = true; });
    await world.killServer();
    await until('the loss is told', async () => /again/.test(await viewer.status()));
    const picture = await viewer.picture();
    const at = await viewer.frame();
    await world.startServer();
    const start = Date.now();
    await until('the picture moves', async () =>
      await viewer.frame() !== at && await viewer.picture() !== picture);
    t.diagnostic(`live again ${Date.now() - start} ms after the server was there`);
    await until('all is well', async () => await viewer.status() === 'Live');
    assert.equal(await viewer.page.evaluate(() => window.wasHere), true, 'no reload');
    assert.deepEqual(viewer.errors.filter((text) => !isConnection(text)), []);
  } finally {
    await viewer.close();
    await world.close();
  }
});

test('the page reports the end of a stream and its return', async () => {
  const world = await World.start();
  const viewer = await Viewer.open(browser, world.url);
  try {
    const first = world.loop('dam');
    await viewer.shows(5);
    await first.stop();
    await until('the end is told', async () => /ended|No stream/.test(await viewer.status()));
    await viewer.page.getByText('No stream is open').waitFor();
    world.loop('dam');
    await viewer.button('Switch to the new run').click();
    await until('it is live again', async () => await viewer.status() === 'Live');
    const at = await viewer.frame();
    await until('it moves', async () => await viewer.frame() !== at);
    assert.deepEqual(viewer.errors, []);
  } finally {
    await viewer.close();
    await world.close();
  }
});

test('a token is entered once', async () => {
  const folder = mkdtempSync(path.join(tmpdir(), 'partiemc-token-'));
  const file = path.join(folder, 'token');
  writeFileSync(file, `${TOKEN}\n`);
  const world = await World.start('--token-file', file);
  const viewer = await Viewer.open(browser, world.url);
  try {
    const field = viewer.page.getByLabel('Access token');
    await field.waitFor();
    await until('what to do is told', async () => /access token/i.test(await viewer.status()));
    await field.fill(TOKEN);
    await viewer.button('Connect').click();
    world.loop('dam', '--token-file', file);
    await viewer.shows(5);
    assert.deepEqual(viewer.errors.filter((text) => !isConnection(text)), []);
  } finally {
    await viewer.close();
    await world.close();
    rmSync(folder, { recursive: true });
  }
});
