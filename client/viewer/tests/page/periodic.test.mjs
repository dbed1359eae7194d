// Files and streams whose periodic box changes from frame to frame. Leaves a screenshot in build/screenshots.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, screenshots, until, Viewer, violations, withoutTooltip, World } from './support.mjs';

const FRAMES = 4;
let world, browser, viewer;
const place = (name) => path.join(world.folder, name);

/** A dump of points, as fractions of a box that grows from `length` by 1 % a frame. */
function dumpOf(length, points) {
  const frames = Array.from({ length: FRAMES }, (_, k) => {
    const side = length * 1.01 ** k;
    const bounds = `${-side / 2} ${side / 2}`;
    return ['ITEM: TIMESTEP', k, 'ITEM: NUMBER OF ATOMS', points.length, 'ITEM: BOX BOUNDS pp pp pp', bounds, bounds,
      points[0].length === 3 ? bounds : '-1 1', `ITEM: ATOMS id ${['xs', 'ys', 'zs'].slice(0, points[0].length).join(' ')}`,
      ...points.map((point, i) => `${i + 1} ${point.map((at) => at - Math.floor(at)).join(' ')}`)].join('\n');
  });
  return `${frames.join('\n')}\n`;
}

/** Points of a lattice in a ball around the corner of the box. */
function ball(radius, dimensions, length) {
  const along = Array.from({ length: 2 * radius + 1 }, (_, i) => i - radius);
  let points = [[]];
  for (let axis = 0; axis < dimensions; ++axis) points = points.flatMap((point) => along.map((at) => [...point, at]));
  return points.filter((point) => Math.hypot(...point) <= radius).map((point) => point.map((at) => at / length));
}

before(async () => {
  world = await World.start();
  browser = await launch();
  const layer = Array.from({ length: 240 }, (_, k) => [(k % 60 + 0.5) / 60, (Math.floor(k / 60) + 28) / 60]);
  writeFileSync(place('npt.lammpstrj'), dumpOf(60, [...ball(6, 2, 60), ...layer]));
  writeFileSync(place('solid.lammpstrj'), dumpOf(20, ball(4, 3, 20)));
  await world.convert(place('npt.lammpstrj'), place('npt.pemc'));
});
cleansUp(() => ({ world, browser, viewer }));

const field = (label) => viewer.page.locator('#file-options').getByLabel(label, { exact: true });
const submit = () => viewer.button('Open with these options').click();

/** Compares all frames with the command line. `first`: the number of the first frame. */
async function showsAll(truth, key, first) {
  const name = `${key}_digest`;
  assert.equal(new Set(truth.map((frame) => frame[name])).size, FRAMES);
  for (const [k, frame] of truth.entries()) {
    await viewer.scrubTo(k + 1, k + first);
    await until(`frame ${k} as the command line`, async () => await viewer.value(`${key}-digest`) === frame[name]);
  }
}

test('frames of files have their own boxes', async () => {
  const options = ['--spacing', '1', '--periodic', 'x,y'];
  for (const name of ['npt.lammpstrj', 'npt.pemc']) {
    const truth = await world.statistics(place(name), ...options);
    const fixed = await world.statistics(place(name), ...options, '--box', '-30,30,-30,30');
    assert.notEqual(truth[FRAMES - 1].rings_digest, fixed[FRAMES - 1].rings_digest);
    await viewer?.close();
    viewer = await Viewer.open(browser, world.url);
    await viewer.drop(place(name));
    await viewer.allFrames();
    await viewer.page.locator('#file-title').click();
    await field('Spacing').fill('1');
    await field('Periodic').fill('x,q');
    await submit();
    await until('the error', async () => /for example x,y/.test(await viewer.page.locator('#file-periodic-error').textContent()));
    await field('Periodic').fill('x,y');
    await submit();
    await showsAll(truth, 'rings', 0);
    assert.deepEqual([await withoutTooltip(viewer.page), await violations(viewer.page)], [[], []]);
  }
  assert.match(decodeURIComponent(new URL(viewer.page.url()).hash), /open=spacing:1;periodic:x,y/);
  await viewer.page.screenshot({ path: path.join(screenshots, 'periodic.png') });
});

test('frames of surfaces have their own boxes', async () => {
  const truth = await world.statistics(place('solid.lammpstrj'), '--surface', '--spacing', '1', '--periodic', 'x,y,z');
  viewer = await Viewer.open(browser, world.url, { hash: '#file=solid.lammpstrj&open=spacing:1;slice:surface;periodic:x,y,z' });
  await viewer.drop(place('solid.lammpstrj'));
  await viewer.allFrames();
  await showsAll(truth, 'surface', 0);
  assert.equal((await viewer.numbers()).bodies, '1, 0');
});

test('other settings of a stream have the boxes of its frames', async () => {
  const options = ['--spacing', '1', '--periodic', 'x,y'];
  const truth = await world.statistics(place('npt.lammpstrj'), ...options, '--placement', 'qef');
  world.replayOf(place('npt.lammpstrj'), 'npt', ...options, '--echo-particles', '--loop', '--rate', '8');
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=npt' });
  await viewer.shows(FRAMES);
  await viewer.reaches(1);
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('qef');
  await until('the variant is shown', async () => await viewer.value('placement') === 'qef');
  await showsAll(truth, 'rings', 1);
});

test('a file without a box has no periodic axes', async () => {
  const rows = Array.from({ length: 100 }, (_, k) => `${k % 10},${Math.floor(k / 10)}`);
  writeFileSync(place('bare.csv'), `x,y\n${rows.join('\n')}\n`);
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('bare.csv'));
  await viewer.allFrames();
  await viewer.page.locator('#file-title').click();
  assert.deepEqual([await field('Spacing').isVisible(), await viewer.page.locator('#file-periodic').isVisible()], [true, false]);
  await viewer.page.evaluate(() => { location.hash = '#file=bare.csv&open=periodic:x'; });
  await viewer.drop(place('bare.csv'));
  await until('the error', async () => /bare\.csv has no box/.test(await viewer.page.locator('#file-periodic-error').textContent()));
});
