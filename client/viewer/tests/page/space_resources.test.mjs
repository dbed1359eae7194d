// Tests what pictures of surfaces hold of the graphics card: nothing accumulates, and a lost context returns.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { servesBalls, SpaceViewer } from './space_support.mjs';
import { until } from './support.mjs';

let viewer;
const balls = servesBalls(() => viewer);

/** Counts what the page creates and deletes by WebGL. Runs in the page before its scripts. */
function countCalls() {
  const held = window.held = { Buffer: 0, Texture: 0, VertexArray: 0 };
  window.calls = { linkProgram: 0, resized: 0 };
  const { prototype } = WebGL2RenderingContext;
  const wrap = (object, name, act) => {
    const original = object[name];
    object[name] = function (...given) {
      act(...given);
      return original.apply(this, given);
    };
  };
  for (const kind of Object.keys(held)) {
    wrap(prototype, `create${kind}`, () => { ++held[kind]; });
    wrap(prototype, `delete${kind}`, (one) => { if (one) --held[kind]; });
  }
  wrap(prototype, 'linkProgram', () => { ++window.calls.linkProgram; });
  const width = Object.getOwnPropertyDescriptor(HTMLCanvasElement.prototype, 'width');
  Object.defineProperty(HTMLCanvasElement.prototype, 'width', {
    ...width,
    set(value) {
      if (this.closest('.space')) ++window.calls.resized;
      width.set.call(this, value);
    },
  });
}

/** Opens the page with counters. */
async function open() {
  viewer = await SpaceViewer.open(balls.browser, 'about:blank');
  await viewer.page.addInitScript(countCalls);
  await viewer.page.goto(`${balls.world.url}#stream=balls`);
  await viewer.drawsSurface();
}

const counts = () => viewer.page.evaluate(() => ({ ...window.held, ...window.calls }));

/** The counters once the paused page has drawn a frame of the stream. */
async function countsAfter(frame) {
  await viewer.shows(frame);
  await viewer.button('Pause').click();
  await viewer.still();
  const all = await counts();
  await viewer.button('Live').click();
  return all;
}

test('frames of a stream keep no buffers, and compile nothing', async () => {
  await open();
  for (const label of ['Mesh edges', 'Particles']) await viewer.page.getByLabel(label, { exact: true }).click();
  await viewer.page.getByLabel('Colour', { exact: true }).selectOption('p');
  const before = await countsAfter(await viewer.frame() + 4);
  assert.ok(before.Buffer > 5 && before.linkProgram > 2, JSON.stringify(before));
  assert.deepEqual(await countsAfter(await viewer.frame() + 16), before);
});

test('a change of the look keeps no buffers', async () => {
  await open();
  await viewer.pauseAtFirst();
  const choose = (label, value) => viewer.page.getByLabel(label, { exact: true }).selectOption(value);
  const changeAll = async () => {
    for (const colour of ['identity', 'p', 'plain']) {
      await choose('Colour', colour);
      await viewer.refreshes();
    }
    await choose('Clip plane', 'x');
    for (const share of ['0.2', '0.4', '0.6']) {
      await viewer.page.getByLabel('Position', { exact: true }).fill(share);
      await viewer.refreshes();
    }
    await choose('Clip plane', 'none');
    await viewer.still();
  };
  await changeAll();
  const before = await counts();
  await changeAll();
  assert.deepEqual(await counts(), before);
});

test('the picture comes back after a lost context', async () => {
  await open();
  await viewer.pauseAtFirst();
  const before = await viewer.still();
  const lose = (name) => viewer.space().evaluate((canvas, method) => {
    window.loss ??= canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    window.loss[method]();
  }, name);
  await lose('loseContext');
  await until('the picture is gone', async () => await viewer.picture() !== before);
  await lose('restoreContext');
  await until('the picture is back', async () => await viewer.picture() === before);
});
