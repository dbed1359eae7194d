// Layouts: folded side panel, phone, embedded. Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, screenshots, until, Viewer, violations, World } from './support.mjs';

let world, browser, viewer;
before(async () => {
  world = await World.start();
  browser = await launch();
  world.loop('dam');
});
cleansUp(() => ({ world, browser, viewer }));

const shot = (name) => viewer.page.screenshot({ path: path.join(screenshots, `${name}.png`) });
const widthOf = async (locator) => (await locator.boundingBox())?.width ?? 0;
const fits = async (width) => {
  const wide = await viewer.page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= width, `the page is ${wide} pixels wide`);
};

test('the side panel folds, and stays folded', async () => {
  viewer = await Viewer.open(browser, world.url, { hash: '#stream=dam' });
  await viewer.shows(5);
  const before = await widthOf(viewer.pane());
  await viewer.button('Side panel').click();
  await until('the picture grows', async () => await widthOf(viewer.pane()) > before + 200);
  assert.equal(await viewer.button('Side panel').getAttribute('aria-expanded'), 'false');
  await viewer.page.reload();
  await viewer.shows(5);
  assert.ok(!await viewer.page.locator('#side').isVisible());
  await viewer.button('Side panel').click();
  await viewer.page.locator('#side').waitFor();
});

test('a phone shows the picture, and the side panel over it', async () => {
  viewer = await Viewer.open(browser, world.url, { width: 390, height: 844 });
  await viewer.shows(40);
  await fits(390);
  const picture = await viewer.pane().locator('.picture').boundingBox();
  assert.ok(picture.width > 380 && picture.height > 250, `${picture.width} x ${picture.height}`);
  await viewer.button('Pause').click();
  assert.deepEqual(await violations(viewer.page), []);
  await shot('phone');
  await viewer.button('Side panel').click();
  await viewer.page.locator('#side').waitFor();
  await fits(390);
  assert.deepEqual(await violations(viewer.page), []);
  await shot('phone_panel');
  await viewer.button('Watch dam').click();
  await until('the panel folds after the choice', async () => !await viewer.page.locator('#side').isVisible());
});

test('embedded, the page shows the picture and its time', async () => {
  viewer = await Viewer.open(browser, world.url, { width: 640, height: 420, hash: '?embed#stream=dam' });
  await until('frames arrive', async () => Number((await viewer.page.locator('#position').textContent()).split(' ')[0]) > 40);
  for (const part of ['#side', '#curves', '#status', '.numbers', '#fold']) {
    assert.ok(!await viewer.page.locator(part).isVisible(), `${part} is hidden`);
  }
  const picture = await viewer.pane().locator('.picture').boundingBox();
  assert.ok(picture.height > 280, `${picture.height}`);
  await viewer.button('Pause').click();
  await until('the link keeps ?embed', async () => /\?embed#stream=dam&frame=\d+/.test(viewer.page.url()));
  assert.deepEqual(await violations(viewer.page), []);
  await shot('embed');
});
