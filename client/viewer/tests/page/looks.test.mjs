// Tests the accessibility of the page: no serious violation, in dark and light, wide and narrow.
// Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync } from 'node:fs';
import path from 'node:path';
import { after, afterEach, before, beforeEach, test } from 'node:test';
import { launch, screenshots, until, Viewer, violations, withoutTooltip, World } from './support.mjs';

let world, browser;

before(async () => {
  mkdirSync(screenshots, { recursive: true });
  browser = await launch();
});
after(() => browser?.close());

// A new stream for every test, so that the history still has the first frame.
beforeEach(async () => {
  world = await World.start();
  world.loop('dam_break');
});
afterEach(() => world?.close());

for (const colorScheme of ['light', 'dark']) {
  for (const width of [1600, 800]) {
    test(`${colorScheme}, ${width} pixels wide: accessible, nothing cut off`, async () => {
      const viewer = await Viewer.open(browser, world.url, { colorScheme, width, height: width === 800 ? 720 : 900 });
      const shot = (name) => viewer.page.screenshot({
        path: path.join(screenshots, `${name}_${colorScheme}_${width}.png`),
      });
      try {
        await viewer.shows(60);
        await until('its history', async () =>
          await viewer.page.getByLabel('Frame', { exact: true }).getAttribute('min') === '1');
        assert.deepEqual(await violations(viewer.page), []);
        await viewer.scrubTo(45);
        await shot('one');
        await viewer.button('Side by side').click();
        await viewer.page.getByLabel('Placement', { exact: true }).selectOption('marching-squares');
        await viewer.page.getByLabel('Fill', { exact: true }).selectOption('grid');
        await viewer.page.getByLabel('Mesh edges').check();
        await viewer.page.getByLabel('Particles', { exact: true }).check();
        await viewer.page.getByLabel('Colour', { exact: true }).selectOption('identity');
        await until('the other fill', async () => await viewer.value('fill', 1) === 'grid' &&
          await viewer.value('triangles', 1) === await viewer.value('grid', 1));
        await viewer.page.mouse.move(width * 0.45, 300);
        await shot('two');
        assert.deepEqual(await violations(viewer.page), []);
        const wide = await viewer.page.evaluate(() => document.documentElement.scrollWidth);
        assert.ok(wide <= width, `the page is ${wide} pixels wide`);
        assert.deepEqual(viewer.errors, []);
      } finally {
        await viewer.close();
      }
    });
  }
}

test('the page before any stream', async () => {
  const empty = await World.start();
  const viewer = await Viewer.open(browser, empty.url, { colorScheme: 'light' });
  try {
    await viewer.page.getByText('No stream is open').waitFor();
    await viewer.page.screenshot({ path: path.join(screenshots, 'empty_light_1600.png') });
    assert.deepEqual(await violations(viewer.page), []);
    assert.deepEqual(viewer.errors, []);
  } finally {
    await viewer.close();
    await empty.close();
  }
});

test('every control can be reached and has a name', async () => {
  const viewer = await Viewer.open(browser, world.url);
  try {
    await viewer.shows();
    const unnamed = await viewer.page.evaluate(() => [...document.querySelectorAll('button, select, input, canvas')]
      .filter((element) => !element.hidden && element.tabIndex >= 0)
      .filter((element) => !(element.getAttribute('aria-label') || element.textContent?.trim() ||
                             element.labels?.length))
      .map((element) => element.outerHTML));
    assert.deepEqual(unnamed, []);
    assert.deepEqual(await withoutTooltip(viewer.page), []);
    const seen = new Set();
    for (let k = 0; k < 90; ++k) {
      await viewer.page.keyboard.press('Tab');
      seen.add(await viewer.page.evaluate(() => document.activeElement?.id || document.activeElement?.tagName));
    }
    for (const id of ['theme', 'choose-files', 'placement', 'share', 'side-by-side', 'outline', 'colour',
      'export-png', 'CANVAS', 'live', 'play', 'scrub', 'speed', 'fit', 'curves']) {
      assert.ok(seen.has(id), `${id} is reached by Tab`);
    }
  } finally {
    await viewer.close();
  }
});
