// Tests sections and isolines of a 3D stream, in the page and in the report. Leaves screenshots in
// build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { launch, replay, screenshots, until, Viewer, violations, World } from './support.mjs';

const FLAGS = ['--spacing', '.1', '--slice', 'z=0', '--slice', 'z=.5', '--slice', 'y=.1', '--isolines', '.3,.7'];
const NAMES = ['z = 0', 'z = 0.5', 'y = 0.1'].flatMap(
  (plane) => ['', ', isovalue 0.3', ', isovalue 0.7'].map((isovalue) => plane + isovalue));
let browser, world, folder, truth, report;

/** A ball that moves to the right, and a smaller one above. */
function balls(frame) {
  const lines = ['x,y,z'];
  for (let i = -12; i <= 12; ++i) {
    for (let j = -12; j <= 12; ++j) {
      for (let k = -12; k <= 12; ++k) {
        const [x, y, z] = [i * 0.1, j * 0.1, k * 0.1];
        const isBall = x * x + y * y + z * z < 0.81;
        const isSmall = (x - 0.9) ** 2 + (y - 0.6) ** 2 + (z - 0.5) ** 2 < 0.1;
        if (isBall || isSmall) lines.push([x + 0.02 * frame, y, z].map((one) => one.toFixed(4)).join(','));
      }
    }
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  mkdirSync(screenshots, { recursive: true });
  world = await World.start();
  folder = path.join(world.folder, 'balls');
  mkdirSync(folder);
  for (let k = 0; k < 4; ++k) writeFileSync(path.join(folder, `b_${k}.csv`), balls(k));
  report = path.join(world.folder, 'balls.html');
  const stats = path.join(world.folder, 'balls.json');
  await replay(folder, ...FLAGS, '--report', report, '--stats', stats);
  // The statistics have one row for each outline of a frame.
  truth = JSON.parse(readFileSync(stats, 'utf8')).filter((row) => row.frame === 1).map((row) => row.rings_digest);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await world?.close();
});

/** Lists, switches and shows all outlines; the same in page and report. */
async function showsAll(viewer, name, colorScheme) {
  const { page } = viewer;
  const list = page.locator('#outline-list li');
  await until('all outlines are listed', async () => await list.count() === NAMES.length);
  const texts = await list.allTextContents();
  texts.forEach((text, k) => assert.ok(text.startsWith(NAMES[k]), `${text}: ${NAMES[k]}`));
  for (const k of [6, 7, 8]) {
    assert.match(texts[k], /another plane/);
    assert.ok(await list.nth(k).getByRole('checkbox').isDisabled());
  }
  const colours = await list.locator('i').evaluateAll((all) => all.map((one) => one.style.background));
  assert.equal(new Set(colours).size, NAMES.length, 'colours differ');
  assert.deepEqual(await violations(page), []);
  await page.screenshot({ path: path.join(screenshots, `sections_${name}_${colorScheme}.png`), fullPage: true });
  const pictures = new Set([await viewer.picture()]);
  const changes = async (what) => {
    await until(`${what} changes the picture`, async () => !pictures.has(await viewer.picture()));
    pictures.add(await viewer.picture());
  };
  for (const k of [1, 3, 5]) {
    await list.nth(k).getByRole('checkbox').uncheck();
    await changes(NAMES[k]);
  }
  const own = await viewer.value('rings-digest');
  const digests = new Set([own]);
  for (const [k, outline] of NAMES.entries()) {
    if (k === 0) continue;
    await page.getByLabel('Picture of').selectOption(outline);
    await until(`the numbers are those of ${outline}`, async () => !digests.has(await viewer.value('rings-digest')));
    digests.add(await viewer.value('rings-digest'));
    await changes(outline);
  }
  return [...digests];
}

for (const colorScheme of ['light', 'dark']) {
  test(`the page shows three planes and two isolines (${colorScheme})`, async () => {
    const stream = world.replayOf(folder, `balls_${colorScheme}`, ...FLAGS, '--loop', '--rate', '8');
    const viewer = await Viewer.open(browser, world.url, { hash: `#stream=balls_${colorScheme}`, colorScheme });
    try {
      await viewer.shows(4);
      await viewer.button('Pause').click();
      await viewer.scrubTo(2);
      const digests = await showsAll(viewer, 'page', colorScheme);
      assert.deepEqual(digests, truth);
      assert.match(await viewer.pane().locator('header').textContent(), /y = 0\.1, isovalue 0\.7/);
      const { hash } = new URL(viewer.page.url());
      assert.match(decodeURIComponent(hash), /hidden:1\.3\.5,of:8/);
      assert.deepEqual(viewer.errors, []);
    } finally {
      await viewer.close();
      await stream.stop();
    }
  });

  test(`the report has the same names and outlines (${colorScheme})`, async () => {
    const viewer = await Viewer.open(browser, pathToFileURL(report).href, { colorScheme, hash: '#frame=1' });
    try {
      await until('a frame is shown', () => viewer.value('rings-digest'));
      assert.ok(await viewer.page.getByLabel('Particles', { exact: true }).isDisabled(),
                'particles in space are not drawn as if they were in the plane');
      const digests = await showsAll(viewer, 'report', colorScheme);
      assert.deepEqual(digests, truth);
      assert.deepEqual(viewer.errors, []);
    } finally {
      await viewer.close();
    }
  });
}
