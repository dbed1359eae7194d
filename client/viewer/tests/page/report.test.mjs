// Tests the report of `partiemc replay --report`, opened from disk.
import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { launch, recording, replay, screenshots, until, Viewer, violations, withoutTooltip } from './support.mjs';

let browser, folder, truth;
const file = (name) => path.join(folder, name);

/** A disc of particles with a hole and a column `p`. */
function disc(frame) {
  const lines = ['x,y,p'];
  for (let i = -14; i <= 14; ++i) {
    for (let j = -14; j <= 14; ++j) {
      const away = i * i + j * j;
      if (away <= 196 && away >= 20) lines.push([i * 0.05, j * 0.05, i / 14 + 0.1 * frame].join(','));
    }
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  folder = mkdtempSync(path.join(tmpdir(), 'partiemc-report-'));
  mkdirSync(screenshots, { recursive: true });
  mkdirSync(file('discs'));
  for (let k = 0; k < 3; ++k) writeFileSync(file(`discs/disc_${k}.csv`), disc(k));
  await replay(recording, '--stats', file('dam.json'), '--report', file('dam.html'));
  await replay(file('discs'), '--attributes', 'p', '--color-by', 'p', '--isolines', '.8,.95',
               '--report', file('discs.html'));
  truth = JSON.parse(readFileSync(file('dam.json'), 'utf8'));
  browser = await launch();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens a report for the duration of `work`. */
async function inReport(name, options, work) {
  const report = await Viewer.open(options.browser ?? browser, pathToFileURL(file(name)).href, options);
  try {
    await until('a frame is shown', () => report.value('rings-digest'));
    await work(report);
    assert.deepEqual(report.errors, []);
  } finally {
    await report.close();
  }
}

const shows = (report, frame) => until(`frame ${frame} is shown`, async () => await report.frame() === frame);

test('frames have the numbers of the command line', () => inReport('dam.html', { hash: '#frame=40' }, async (report) => {
  await shows(report, 40);
  const numbers = await report.numbers();
  const row = truth[40];
  assert.equal(numbers['rings-digest'], row.rings_digest);
  assert.equal(numbers['mesh-digest'], row.mesh_digest);
  assert.equal(numbers.triangles, row.triangles.toLocaleString('en'));
  assert.equal(numbers.grid, row.triangles_grid.toLocaleString('en'));
  assert.equal(Number(numbers.area), Number(row.area.toPrecision(7)));
  assert.equal(numbers.placement, 'virtual-plane');
}));

test('buttons, keys, slider and curves go to a frame', () => inReport('dam.html', {}, async (report) => {
  const { page } = report;
  await page.keyboard.press('ArrowRight');
  await shows(report, 1);
  assert.equal(await page.locator('#position').textContent(), '1 of 74', 'the number under the picture');
  await page.keyboard.press('End');
  await shows(report, 74);
  await report.button('Previous frame').click();
  await shows(report, 73);
  await page.locator('canvas').first().click();
  await page.keyboard.press('Home');
  await shows(report, 0);
  await report.button('Play').click();
  await until('it plays', async () => await report.frame() > 2);
  await report.button('Pause').click();
  const plot = page.locator('.curve .u-over').first();
  const box = await plot.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await shows(report, 37);
}));

test('every control has a tooltip', () => inReport('discs.html', {}, async (report) => {
  assert.deepEqual(await withoutTooltip(report.page), []);
}));

test('links have frame, view and layers, also former ones', () =>
  inReport('dam.html', { hash: '#frame=10&layers=outline,particles' }, async (report) => {
    const { page } = report;
    await shows(report, 10);
    assert.equal(await page.getByLabel('Mesh edges').isChecked(), false);
    assert.equal(await page.getByLabel('Particles', { exact: true }).isChecked(), true);
    const before = await report.picture();
    await report.button('Zoom in').click();
    await until('it zooms', async () => await report.picture() !== before);
    const hash = new URL(page.url()).hash;
    assert.match(hash, /^#frame=10&view=.*&look=outline,fill,particles/);
    await inReport('dam.html', { hash }, async (other) => {
      await shows(other, 10);
      assert.equal(new URL(other.page.url()).hash, hash);
    });
  }));

test('a ring under the pointer is highlighted and described', () => inReport('dam.html', {}, async (report) => {
  const before = await report.picture();
  const box = await report.page.locator('canvas').first().boundingBox();
  await report.page.mouse.move(box.x + 0.3 * box.width, box.y + 0.8 * box.height);
  await until('the ring is described', async () =>
    /ring \d+: area 2\.09/.test(await report.pane().locator('.readout').textContent()));
  assert.notEqual(await report.picture(), before);
}));

for (const colorScheme of ['light', 'dark']) {
  test(`colours and isolines of an attribute (${colorScheme})`, () =>
    inReport('discs.html', { colorScheme }, async (report) => {
      const { page } = report;
      assert.equal(await page.getByLabel('Colour', { exact: true }).inputValue(), 'p');
      assert.match(await page.locator('#legend-min').textContent(), /^-1(\.0\d+)?$/);
      assert.deepEqual(await violations(page), []);
      await page.screenshot({ path: path.join(screenshots, `report_${colorScheme}.png`), fullPage: true });
      const pictures = new Set([await report.picture()]);
      for (const key of ['c', 'i', 'm', 'o']) {
        await page.keyboard.press(key);
        await until(`${key} changes the picture`, async () => !pictures.has(await report.picture()));
        pictures.add(await report.picture());
      }
    }));
}

test('without WebGL the picture is SVG', async () => {
  const bare = await launch(['--no-sandbox', '--disable-gpu', '--disable-3d-apis', '--disable-software-rasterizer']);
  try {
    await inReport('discs.html', { browser: bare, width: 390 }, async (report) => {
      await until('paths are shown', async () => await report.page.locator('.picture svg path').count() > 20);
      assert.deepEqual(await violations(report.page), []);
      assert.equal(await report.page.evaluate(() => document.documentElement.scrollWidth), 390);
    });
  } finally {
    await bare.close();
  }
});
