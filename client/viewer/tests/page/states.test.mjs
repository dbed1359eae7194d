// Tests that a pane shows no frame or number under a wrong name: its state, a new run, refusals.
// Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { fromBinary, toBinary } from '@bufbuild/protobuf';
import { cleansUp, launch, moduleOf, screenshots, until, Viewer, violations, World } from './support.mjs';

let browser, world, viewer;
before(async () => {
  browser = await launch();
  world = await World.start();
});
cleansUp(() => ({ world, browser, viewer }), { makesErrors: true });

const open = async (hash, options = {}) => { viewer = await Viewer.open(browser, world.url, { hash, ...options }); };
const badge = (k = 0) => viewer.pane(k).locator('.state').textContent();
const notice = (k = 0) => viewer.pane(k).locator('.notice');
const becomes = (name, k = 0) => until(`pane ${k} is ${name}`, async () => await badge(k) === name);
const isEmpty = async (k = 0) =>
  Object.values(await viewer.numbers(k)).every((text) => text === '–' || text === '');
const shot = (name) => viewer.page.screenshot({ path: path.join(screenshots, `state_${name}.png`) });

test('a stream that does not exist is waited for, and nothing else is shown under its name', async () => {
  const producer = world.loop('dam');
  await open('#stream=dam');
  await viewer.shows(5);
  await becomes('Live');
  await shot('live');
  await viewer.page.evaluate(() => { location.hash = '#stream=later'; });
  await becomes('Waiting');
  assert.equal(await viewer.pane().locator('.name').textContent(), 'later');
  assert.ok(await isEmpty(), 'no number of the former stream');
  assert.match(await notice().textContent(), /no open stream|Waiting/i);
  assert.deepEqual(await violations(viewer.page), []);
  await shot('waiting');
  const later = world.loop('later');
  await becomes('Live');
  await viewer.shows();
  await producer.stop();
  await later.stop();
});

test('an ended run stays viewable, and the page offers the new run of the same name', async () => {
  const first = world.loop('run');
  await open('#stream=run');
  await viewer.shows(20);
  await first.stop();
  await becomes('Ended');
  await viewer.scrubTo(10);
  const digest = await viewer.value('rings-digest');
  const picture = await viewer.picture();
  const second = world.loop('run', '--spacing', '.05');
  await notice().getByRole('button', { name: 'Switch to the new run' }).waitFor();
  assert.equal(await badge(), 'Ended');
  assert.equal(await viewer.value('rings-digest'), digest);
  await viewer.scrubTo(11);
  await viewer.scrubTo(10);
  assert.equal(await viewer.value('rings-digest'), digest, 'the frame of the first run');
  assert.notEqual(await viewer.picture(), '');
  assert.ok(picture);
  assert.deepEqual(await violations(viewer.page), []);
  await shot('ended');
  await viewer.button('Switch to the new run').click();
  await becomes('Live');
  await viewer.shows();
  assert.ok(await notice().isHidden());
  await until('the spacing of the second run', async () => await viewer.value('spacing') === '0.05');
  await second.stop();
});

test('a lost server is named until it is back', async () => {
  const own = await World.start();
  const other = await Viewer.open(browser, own.url, { hash: '#stream=dam', colorScheme: 'dark' });
  viewer = other;
  try {
    own.loop('dam');
    await viewer.shows(5);
    await own.killServer();
    await becomes('Lost');
    assert.match(await notice().textContent(), /again/);
    await shot('lost');
    await own.startServer();
    await becomes('Live');
    await until('the error has expired', async () => await viewer.status() === 'Live');
    assert.ok(await notice().isHidden());
  } finally {
    await own.close();
  }
});

test('a damaged frame is refused by name, and the next one is shown', async () => {
  const stream = world.loop('plain');
  const { WatchStreamResponseSchema } = await moduleOf('build/generated/partiemc/v1/reconstruction_pb.ts');
  const damaged = (bytes) => {
    const message = fromBinary(WatchStreamResponseSchema, bytes);
    const frame = message.response.case === 'frame' ? message.response.value.frame : null;
    frame?.rings?.offsets.set([1]);
    return Buffer.from(toBinary(WatchStreamResponseSchema, message));
  };
  viewer = await Viewer.open(browser, world.url);
  let isDamaging = true;
  await viewer.page.routeWebSocket(/v1\/watch/, (socket) => {
    const server = socket.connectToServer();
    server.onMessage((message) => socket.send(isDamaging ? damaged(message) : message));
  });
  await viewer.page.goto(`${world.url}#stream=plain`);
  await viewer.page.reload();
  await becomes('Refused');
  assert.match(await notice().textContent(), /^Frame \d+ cannot be shown: rings\.offsets must begin with 0\./);
  isDamaging = false;
  await becomes('Live');
  assert.ok(await notice().isHidden());
  assert.deepEqual(viewer.errors, []);
  await stream.stop();
});

test('refused settings show no picture of the former ones', async () => {
  const stream = world.loop('plain');
  await open('#stream=plain');
  await viewer.shows(5);
  await viewer.pause();
  const digest = await viewer.value('rings-digest');
  // The reference radius must be smaller than the kernel radius. No input field can check this, so the
  // server refuses the settings.
  const reference = viewer.page.getByLabel('Reference radius', { exact: true });
  await reference.fill('7');
  await reference.blur();
  await becomes('Refused');
  assert.ok(await isEmpty(), 'no number of the former settings');
  assert.match(await viewer.status(), /reference_radius/);
  assert.deepEqual(await violations(viewer.page), []);
  await shot('refused');
  await viewer.button('As streamed').click();
  await until('the picture is back', async () => await viewer.value('rings-digest') === digest);
  assert.doesNotMatch(await viewer.status(), /reference_radius/, 'the error has gone with its cause');
  await stream.stop();
});

test('the most severe state is in the status line, with its picture', async () => {
  const stream = world.loop('two');
  await open('#stream=two');
  await viewer.shows(5);
  await viewer.button('Side by side').click();
  const reference = viewer.page.getByLabel('Reference radius', { exact: true });
  await reference.fill('7');
  await reference.blur();
  await becomes('Refused', 1);
  await viewer.pane(0).locator('canvas').focus();
  await until('the first picture is chosen', async () =>
    await viewer.pane(0).evaluate((element) => element.classList.contains('active')));
  assert.match(await viewer.status(), /^Picture 2: .*reference_radius/);
  await viewer.button('Close picture 2').click();
  await until('it is gone', async () => await viewer.status() === 'Live');
  await stream.stop();
});

test('a refused frame of a file is named, and the others are shown', async () => {
  const folder = path.join(world.folder, 'frames');
  mkdirSync(folder);
  for (let k = 0; k < 4; ++k) {
    const lines = ['x,y'];
    for (let i = 0; i < 20; ++i) for (let j = 0; j < 20; ++j) lines.push(`${i * 0.1 + k * 0.01},${j * 0.1}`);
    if (k === 2) for (let i = 0; i < 40; ++i) lines.push(`${10 ** (9 + i)},${10 ** (8 + i)}`);
    writeFileSync(path.join(folder, `f_${k}.csv`), `${lines.join('\n')}\n`);
  }
  await open('');
  const session = await viewer.page.context().newCDPSession(viewer.page);
  const data = { items: [], files: [folder], dragOperationsMask: 1 };
  for (const type of ['dragEnter', 'dragOver', 'drop']) {
    await session.send('Input.dispatchDragEvent', { type, x: 700, y: 300, data });
  }
  await becomes('File');
  await until('all frames', async () => /All frames received, 1 refused/.test(await viewer.status()) ||
    /Frame 2 is refused/.test(await viewer.status()));
  await viewer.page.getByLabel('Frame', { exact: true }).evaluate((slider) => {
    slider.value = '3';
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  });
  await becomes('Refused');
  assert.match(await viewer.status(), /Frame 2 is refused/);
  assert.ok(await isEmpty());
  await viewer.scrubTo(4, 3);
  await becomes('File');
});
