// Contacts of outlines with walls, and the settings of walls and sizes. Leaves a screenshot in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { launch, screenshots, until, Viewer, World } from './support.mjs';

let world, browser, viewer;

/** Rows of particles on the floor y = 0, shorter from row to row: the angle is about 45 degrees. */
function heap() {
  const lines = ['x,y'];
  for (let row = 0; row < 20; ++row) {
    for (let column = row; column < 60 - row; ++column) lines.push([column / 20, (row + 0.5) / 20].join());
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  mkdirSync(screenshots, { recursive: true });
  world = await World.start();
  browser = await launch();
  const file = path.join(world.folder, 'heap.csv');
  writeFileSync(file, heap());
  world.replayOf(file, 'heap', '--wall', '0,0,1,0', '--echo-particles', '--loop', '--rate', '8', '--spacing', '.05');
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=heap' });
  await viewer.shows(2);
  await viewer.button('Pause').click();
});
after(async () => {
  const errors = viewer?.errors;
  await viewer?.close();
  await browser?.close();
  await world?.close();
  assert.deepEqual(errors, []);
});

const contacts = () => viewer.pane().locator('.overlay .contact').count();
const angles = () => viewer.pane().locator('.overlay .angle').allTextContents();

test('contacts are marked with their angles, also in exports', async () => {
  await until('both contacts', async () => await contacts() === 2);
  const shown = await angles();
  for (const angle of shown) assert.match(angle, /^(3|4|5)\d°$/);
  const mean = shown.reduce((sum, angle) => sum + parseInt(angle, 10), 0) / 2;
  const [, told] = (await viewer.value('contact-angles')).match(/^([\d.]+)°, mean of 2$/);
  assert.ok(Math.abs(Number(told) - mean) <= 0.5, `${told} and ${shown}`);
  await viewer.page.screenshot({ path: path.join(screenshots, 'contacts.png') });
  const [download] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button('SVG').click()]);
  const file = path.join(screenshots, 'contacts.svg');
  await download.saveAs(file);
  const exported = readFileSync(file, 'utf8');
  assert.equal(exported.match(/<circle /g).length, 2);
  for (const angle of shown) assert.ok(exported.includes(`>${angle}</text>`), angle);
});

test('without the outline there are no contacts', async () => {
  await viewer.page.getByLabel('Outline', { exact: true }).uncheck();
  await until('they are gone', async () => await contacts() === 0);
  await viewer.page.getByLabel('Outline', { exact: true }).check();
  await until('they are back', async () => await contacts() === 2);
});

test('walls of the settings cut the outline elsewhere', async () => {
  const area = async () => Number((await viewer.value('area')).replaceAll(',', ''));
  const before = await area();
  const walls = viewer.page.getByLabel('Walls', { exact: true });
  await walls.fill('0,0,1');
  await walls.blur();
  assert.equal(await walls.evaluate((field) => field.validity.valid), false);
  assert.equal(await area(), before, 'an invalid wall changes nothing');
  await walls.fill('0,0.3,1,0.3');
  await walls.blur();
  await until('less is left', async () => await area() < 0.8 * before);
  await until('the contacts moved', async () => await contacts() === 2);
  assert.match(decodeURIComponent(new URL(viewer.page.url()).hash), /walls:0,0\.3,1,0\.3/);
  const sizes = viewer.page.getByLabel('Sizes', { exact: true });
  await sizes.selectOption('grains');
  await until('the reason is told', async () => /must be absent if the boundary is grains/.test(await viewer.pane().textContent()));
  await sizes.selectOption('');
  await until('the walls cut again', async () => await contacts() === 2);
  await viewer.button('As streamed').click();
  await until('as before', async () => await area() === before);
});

test('grains of a file have outlines of their own', async () => {
  const file = path.join(world.folder, 'grains.csv');
  writeFileSync(file, 'x,y,volume\n0,0,1\n4,0,4\n0,5,1\n');
  await viewer.drop(file);
  // The volume of a grain is its squared diameter.
  const discs = (1 + 4 + 1) * Math.PI / 4;
  const area = async () => Number(await viewer.value('area'));
  await until('all equal', async () => await area() > 0 && Math.abs(await area() - discs) > 0.2);
  await viewer.page.getByLabel('Sizes', { exact: true }).selectOption('grains');
  await until('the discs', async () => Math.abs(await area() - discs) < 0.05 * discs);
});
