// Linked pictures, and links to frames that are not there. Leaves a screenshot in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, recording, screenshots, until, Viewer, violations, withoutTooltip, World } from './support.mjs';

let world, browser, viewer;
const place = (name) => path.join(world.folder, name);

/** Frames of a square that moves right by one unit of length per unit of time. */
function square(name, count, step) {
  mkdirSync(place(name));
  const times = ['frame,t'];
  for (let k = 0; k < count; ++k) {
    const rows = ['id,x,y'];
    for (let i = 0; i <= 10; ++i) {
      for (let j = 0; j <= 10; ++j) rows.push([rows.length, i / 10 + k * step, j / 10].join());
    }
    writeFileSync(path.join(place(name), `${name}_${k}.csv`), `${rows.join('\n')}\n`);
    times.push(`${k},${k * step}`);
  }
  writeFileSync(path.join(place(name), 'times.csv'), `${times.join('\n')}\n`);
}

before(async () => {
  world = await World.start();
  browser = await launch();
  square('slow', 9, 0.25);
  square('fast', 17, 0.125);
});
cleansUp(() => ({ world, browser, viewer }));

const canvas = (k) => viewer.pane(k).locator('canvas');
const scale = (k) => viewer.pane(k).locator('.scale').textContent();
const readout = (k) => viewer.pane(k).locator('.readout').textContent();
const frames = async (...wanted) => until(`frames ${wanted}`, async () =>
  await viewer.value('frame', 0) === String(wanted[0]) && await viewer.value('frame', 1) === String(wanted[1]));
const seek = (sequence) => viewer.page.getByLabel('Frame', { exact: true }).evaluate((slider, value) => {
  slider.value = String(value);
  slider.dispatchEvent(new Event('input', { bubbles: true }));
}, sequence);

test('pictures of different files share time, view and selection', async () => {
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('slow'));
  await viewer.allFrames();
  assert.equal(await viewer.page.getByLabel('Linked').isVisible(), false, 'one picture has no partner');
  await viewer.button('Side by side').click();
  await viewer.drop(place('fast'));
  // The second picture shows all frames of the first files until the others are open.
  await until('the other files', async () => /fast_0/.test(await viewer.pane(1).locator('.name').textContent()));
  await until('all frames', async () => /All frames/.test(await viewer.pane(1).locator('.state').getAttribute('title')));
  assert.deepEqual(await withoutTooltip(viewer.page), []);
  await canvas(0).focus();
  await seek(4);
  await frames(3, 6);
  assert.equal(await viewer.value('time', 0), await viewer.value('time', 1));
  await canvas(1).focus();
  await seek(13);
  await frames(6, 12);
  const before = await scale(0);
  for (let k = 0; k < 6; ++k) await viewer.page.keyboard.press('+');
  await until('the same view', async () => await scale(0) === await scale(1) && await scale(1) !== before);
  await viewer.button('Fit').click();
  await until('the same view', async () => await scale(0) === await scale(1));
  const box = await canvas(1).boundingBox();
  await viewer.page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await until('both have the ring', async () => /Selected: ring 1: area/.test(await readout(0)) && /Selected: ring 1: area/.test(await readout(1)));
  await viewer.page.screenshot({ path: path.join(screenshots, 'linked.png') });
  assert.deepEqual(await violations(viewer.page), []);
  await canvas(1).focus();
  await viewer.page.keyboard.press('Escape');
  await until('neither has', async () => !/Selected/.test(await readout(0) + await readout(1)));
  await viewer.page.getByLabel('Linked').uncheck();
  await seek(3);
  await frames(6, 2);
  await viewer.page.getByLabel('Linked').check();
  await frames(1, 2);
});

test('a link waits for a frame that has not arrived', async () => {
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=coming&frame=60' });
  world.loop('coming', '--rate', '3');  // A slow host has 20 s to show the notice.
  const notice = viewer.pane().locator('.notice');
  await until('the notice', async () => await notice.isVisible() && /Waiting for frame 60 of the link\. The newest frame is \d+/.test(await notice.textContent()));
  assert.match(new URL(viewer.page.url()).hash, /frame=60/);
  await until('its frame', async () => await viewer.frame() === 60);
  assert.equal(await viewer.button('Play').count(), 1, 'paused there');
  assert.equal(await notice.isVisible(), false);
});

test('a link to a frame that never comes says so', async () => {
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=short&frame=900' });
  world.replayOf(recording, 'short', '--rate', '10');  // The page asks for it every two seconds.
  await until('the reason', async () => /The stream has ended with frame 75, before frame 900 of the link/.test(await viewer.status()));
  await until('no notice', async () => !await viewer.pane().locator('.notice').isVisible());
});

test('a link to a frame beyond the end of a file says so', async () => {
  viewer = await Viewer.open(browser, world.url, { hash: '#file=fast_0.csv&frame=3' });
  await viewer.drop(path.join(place('fast'), 'fast_0.csv'));
  await until('the reason', async () => /no frame 3 of the link\. Its last frame is 0/.test(await viewer.status()));
});

test('a link with a range above all numbers keeps its legend in order', async () => {
  writeFileSync(place('p.csv'), ['id,x,y,p', ...Array.from({ length: 121 }, (_, k) => [k, (k % 11) / 10, Math.floor(k / 11) / 10, k / 100].join())].join('\n'));
  viewer = await Viewer.open(browser, world.url, { hash: '#file=p.csv&look=outline,fill,colour:p,from:100' });
  await viewer.drop(place('p.csv'));
  await until('the legend', async () => await viewer.page.locator('#legend').isVisible());
  const ends = await Promise.all(['min', 'max'].map(async (end) => Number(await viewer.page.locator(`#legend-${end}`).textContent())));
  assert.ok(ends[0] === 100 && ends[1] > 100, `${ends}`);
});
