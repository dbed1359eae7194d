// Other settings on a live stream: a stream of its own, compared over time. Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, recording, screenshots, until, Viewer, World } from './support.mjs';

let world, browser, viewer;
before(async () => {
  world = await World.start();
  browser = await launch();
  world.loop('dam');
});
cleansUp(() => ({ world, browser, viewer }));

const open = async (hash = '#stream=dam') => { viewer = await Viewer.open(browser, world.url, { hash }); };
const choose = (label, value) => viewer.page.getByLabel(label, { exact: true }).selectOption(value);
const captions = () => viewer.page.locator('#curves figcaption').allTextContents();

async function downloaded(button) {
  const [download] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button(button).click()]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  return Buffer.concat(chunks).toString();
}

/** Identities of the rings of the chosen picture. */
async function identities() {
  const { features } = JSON.parse(await downloaded('GeoJSON'));
  return features.map(({ properties }) => properties.identity);
}

test('a variant keeps identities from frame to frame, and has curves', async () => {
  await open();
  await viewer.shows(40);
  await viewer.button('Side by side').click();
  await choose('Placement', 'qef');
  await until('the variant is shown', async () => await viewer.value('placement', 1) === 'qef');
  const at = await viewer.shows(0, 1);
  await viewer.shows(at + 20, 1);
  await viewer.button('Pause').click();
  const paused = await until('both show the same frame', async () => {
    const [left, right] = [await viewer.frame(0), await viewer.frame(1)];
    return left === right && left;
  });
  const there = await identities();
  assert.ok(there.length > 0 && there.every((identity) => Number(identity) > 0), `identities ${there}`);
  await viewer.scrubTo(paused - 3);
  await until('the variant follows', async () => await viewer.frame(1) === paused - 3);
  const before = await identities();
  assert.ok(before.some((identity) => there.includes(identity)), `${before} and ${there} share identities`);
  assert.match((await captions())[0], /^Area [\d.]+ \(dashed: as streamed\)$/);
  const [head, ...rows] = (await downloaded('CSV of curves')).trimEnd().split('\n').map((row) => row.split(','));
  assert.ok(rows.length > 20, `${rows.length} frames of the variant`);
  const row = rows.find(([frame]) => Number(frame) === paused - 3);
  assert.equal(Number(Number(row[head.indexOf('area')]).toPrecision(7)), Number(await viewer.value('area', 1)));
  assert.ok(Number(row[head.indexOf('milliseconds')]) > 0);
  assert.equal(await viewer.page.locator('#streams li').count(), 1, 'the list leaves the variant out');
  await viewer.page.screenshot({ path: path.join(screenshots, 'variant.png') });
});

test('back before its first frame, a variant begins again', async () => {
  await open();
  await viewer.shows(80);
  await choose('Placement', 'marching-squares');
  await until('it is shown', async () => await viewer.value('placement') === 'marching-squares');
  await viewer.scrubTo(20);
  assert.equal(await viewer.value('placement'), 'marching-squares');
  await viewer.scrubTo(24);
  await viewer.button('Live').click();
  await viewer.shows(90);
});

test('two grids are compared, with the reduction of each', async () => {
  await open();
  await viewer.shows(40);
  await viewer.scrubTo(8);  // Later frames are so wide that the limit of the cell size applies.
  await choose('Placement', 'marching-squares');
  await viewer.button('32 × 32 cells').click();
  await viewer.button('Side by side').click();
  await viewer.button('64 × 64 cells').click();
  const sizes = async () => (await viewer.page.locator('.pane > header').allTextContents())
    .map((text) => Number(text.match(/cell ([\d.]+)/)?.[1]));
  await until('both are shown', async () => {
    const [coarse, fine] = await sizes();
    return Math.abs(coarse / fine - 2) < 0.02;
  });
  const percent = async (k) => Number((await viewer.value('reduction', k)).replace(' %', ''));
  await until('both have a reduction', async () => await percent(0) > 0 && await percent(1) > 0);
  assert.ok(await percent(1) > await percent(0), 'a finer grid merges more');
  assert.match((await captions()).join('\n'), /^Reduction, % /m);
  await viewer.page.screenshot({ path: path.join(screenshots, 'grids.png') });
});

test('a variant of a stream without particles says why', async () => {
  const bare = world.replayOf(recording, 'bare', '--loop', '--rate', '15');
  await open('#stream=bare&set=placement:qef');
  await until('it is refused', async () => /--echo-particles/.test(await viewer.status()));
  await viewer.button('As streamed').click();
  await viewer.shows();
  await bare.stop();
});
