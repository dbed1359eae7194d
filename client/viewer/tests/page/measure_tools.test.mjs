// Values at the pointer, measurements and axes. Leaves a screenshot in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { launch, recording, screenshots, until, Viewer, violations, withoutTooltip, World } from './support.mjs';

let world, browser, viewer, box;

/** A square from 0 to 1 with a column p = x. */
function square() {
  const lines = ['id,x,y,p'];
  for (let i = 0; i < 21; ++i) {
    for (let j = 0; j < 21; ++j) lines.push([21 * i + j + 1, i / 20, j / 20, i / 20].join());
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  mkdirSync(screenshots, { recursive: true });
  world = await World.start();
  browser = await launch();
  const file = path.join(world.folder, 'square.csv');
  writeFileSync(file, square());
  world.replayOf(file, 'square', '--attributes', 'p', '--loop', '--rate', '8', '--spacing', '.05');
  // One unit has 200 pixels, and the centre of the picture is at (0.5, 0.5).
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=square&view=0.5,0.5,200' });
  await viewer.shows(2);
  await viewer.button('Pause').click();
  box = await viewer.pane().locator('canvas').boundingBox();
});
after(async () => {
  const errors = viewer?.errors;
  await viewer?.close();
  await browser?.close();
  await world?.close();
  assert.deepEqual(errors, []);
});

const at = (x, y) => [box.x + box.width / 2 + 200 * (x - 0.5), box.y + box.height / 2 - 200 * (y - 0.5)];
const readout = () => viewer.pane().locator('.readout').textContent();
const result = () => viewer.pane().locator('.overlay .result').textContent();
const measure = (mode) => viewer.page.getByLabel('Measure', { exact: true }).selectOption(mode);

/** Pixels of a PNG with the colour of measurements. */
const blueDots = (png) => viewer.page.evaluate(async (bytes) => {
  const image = await createImageBitmap(new Blob([new Uint8Array(bytes)], { type: 'image/png' }));
  const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, image.width, image.height);
  let count = 0;
  for (let k = 0; k < data.length; k += 4) count += data[k] === 0x0b && data[k + 1] === 0x5c && data[k + 2] === 0xad;
  return count;
}, [...png]);

test('the tooltip at the pointer has identity, values and coordinates', async () => {
  await viewer.page.mouse.move(...at(0.75, 0.5));
  await until('it has the values', async () => /ring \d+: area[^]*p 0\.7/.test(await readout()));
  const [, x, y] = (await readout()).match(/x ([\d.]+), y ([\d.]+)/);
  assert.ok(Math.abs(x - 0.75) < 0.01 && Math.abs(y - 0.5) < 0.01, `${x}, ${y}`);
  const value = Number((await readout()).match(/p ([\d.]+)/)[1]);
  assert.ok(Math.abs(value - 0.75) < 0.03, `p ${value}`);
  const tip = await viewer.pane().locator('.readout').boundingBox();
  const [left, top] = at(0.75, 0.5);
  assert.ok(tip.x > left && tip.x < left + 30 && tip.y > top && tip.y < top + 30, 'beside the pointer');
});

test('clicks measure a distance, an angle and a ring', async () => {
  await measure('distance');
  await viewer.page.mouse.click(...at(0, 0));
  await viewer.page.mouse.click(...at(0.6, 0.8));
  await until('the distance', async () => /^distance (1|0\.99|1\.00)/.test(await result()));
  await measure('ring');
  await viewer.page.mouse.click(...at(0.5, 0.5));
  await until('the area', async () => (await result()).startsWith(`area ${Number(await viewer.value('area')).toPrecision(5).replace(/0+$/, '')}`));
  await measure('angle');
  for (const [x, y] of [[1, 0], [0, 0], [0, 1]]) await viewer.page.mouse.click(...at(x, y));
  await until('the angle', async () => Math.abs(Number((await result()).match(/angle ([\d.]+)°/)?.[1]) - 90) < 1.5);
  assert.ok(!(await readout()).includes('Selected'), 'a click that measures selects nothing');
  await viewer.page.getByLabel('Axes', { exact: true }).check();
  await until('coordinates', async () => await viewer.pane().locator('.overlay .axis').count() >= 6);
  await viewer.page.mouse.move(...at(0.3, 0.7));
  await viewer.page.screenshot({ path: path.join(screenshots, 'measure.png') });
  for (const name of ['SVG', 'PNG']) {
    const [download] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button(name).click()]);
    await download.saveAs(path.join(screenshots, `measure_export.${name.toLowerCase()}`));
  }
  const exported = readFileSync(path.join(screenshots, 'measure_export.svg'), 'utf8');
  assert.ok(exported.includes(`>${await result()}<`), 'the angle is in the export');
  assert.equal(exported.match(/<circle /g).length, 3);
  const labels = await viewer.pane().locator('.overlay text').allTextContents();
  for (const label of labels) assert.ok(exported.includes(`>${label}</text>`), `the coordinate ${label} is in the export`);
  assert.ok(await blueDots(readFileSync(path.join(screenshots, 'measure_export.png'))) > 100, 'the lines are in the pixels');
  await viewer.pane().locator('canvas').focus();
  await viewer.page.keyboard.press('Escape');
  await until('it is gone', async () => await viewer.pane().locator('.overlay .measure').count() === 0);
  assert.match(decodeURIComponent(new URL(viewer.page.url()).hash), /look=.*axes/);
});

test('gauges have curves and columns with the values of the command line', async () => {
  const gauges = ['front=front:1,0', 'level=height:0.5', 'part=box:0,0,1,1', 'slope=repose', 'wall=wetted:0,0,4,0',
    'drop=contact:0,0,1,0,0.5'];
  const truth = await world.statistics(recording, ...gauges.flatMap((gauge) => ['--gauge', gauge]));
  const files = await Viewer.open(browser, world.url);
  await files.drop(recording);
  await files.allFrames();
  const field = files.page.getByLabel('New gauge');
  await field.fill('level=height');
  await field.press('Enter');
  const error = files.page.locator('#gauge-error');
  await until('the rule', async () => await error.isVisible() && /height must have the numbers x/.test(await error.textContent()));
  for (const gauge of gauges) {
    await field.fill(gauge);
    await field.press('Enter');
  }
  assert.equal(await error.isVisible(), false);
  const caption = files.page.getByRole('figure', { name: 'level (height)' }).locator('figcaption');
  await until('the caption has a value', async () => /level \(height\) [\d.]+/.test(await caption.textContent()));
  await field.scrollIntoViewIfNeeded();
  await files.page.getByText('Kinds', { exact: true }).click();
  await files.page.screenshot({ path: path.join(screenshots, 'gauges.png') });
  assert.deepEqual(await withoutTooltip(files.page), []);
  assert.deepEqual(await violations(files.page), []);
  const [download] = await Promise.all([files.page.waitForEvent('download'), files.button('CSV of curves').click()]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  const [head, ...rows] = Buffer.concat(chunks).toString().trimEnd().split('\n').map((row) => row.split(','));
  assert.equal(rows.length, truth.length);
  const columns = Object.keys(truth[0]).filter((name) => gauges.some((gauge) => `${name}_`.startsWith(`${gauge.split('=')[0]}_`)));
  assert.equal(columns.length, 16);
  for (const name of columns) {
    const at = head.indexOf(name);
    assert.ok(at > 0, `the file has ${name}`);
    rows.forEach((row, k) => {
      const [found, wanted] = [row[at] === '' ? null : Number(row[at]), truth[k][name]];
      if (wanted === null) assert.equal(found, null, `${name}, frame ${k}`);
      else assert.ok(Math.abs(found - wanted) < 1e-3 * Math.max(1, Math.abs(wanted)), `${name}, frame ${k}: ${found}, ${wanted}`);
    });
  }
  await files.page.getByLabel('Remove level').click();
  assert.equal(await files.page.getByRole('figure', { name: 'level (height)' }).count(), 0);
  assert.deepEqual(files.errors, []);
  await files.close();
});
