// Tests the report of surfaces, `partiemc replay --surface --report`, opened from disk.
import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { ballsOf, FRAMES, SURFACE } from './space_support.mjs';
import { launch, replay, screenshots, until, Viewer, violations, withoutTooltip } from './support.mjs';

let browser, folder, truth;
const file = (name) => path.join(folder, name);

before(async () => {
  folder = mkdtempSync(path.join(tmpdir(), 'partiemc-report-'));
  mkdirSync(screenshots, { recursive: true });
  const balls = ballsOf({ folder });
  await replay(balls, ...SURFACE, '--slice', 'z=0', '--stats', file('balls.json'), '--report', file('balls.html'),
    '--report-particles', '500');
  truth = JSON.parse(readFileSync(file('balls.json'), 'utf8'));
  browser = await launch();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** Opens the report for the duration of `work`. */
async function inReport(options, work, name = 'balls.html') {
  const report = await Viewer.open(options.browser ?? browser, pathToFileURL(file(name)).href, options);
  try {
    await until('a surface is shown', () => report.value('surface-digest'));
    await work(report);
    assert.deepEqual(report.errors, []);
  } finally {
    await report.close();
  }
}

const shows = (report, frame) => until(`frame ${frame} is shown`, async () => await report.frame() === frame);

async function still(report) {
  let last = '';
  await until('the picture is still', async () => {
    await report.refreshes();
    const now = await report.picture();
    const isSame = now === last;
    last = now;
    return isSame;
  });
  return last;
}

async function changes(report, what, act) {
  const former = await still(report);
  await act();
  await until(`${what} changes the picture`, async () => await report.picture() !== former);
}

test('frames have the numbers of the command line', () => inReport({ hash: '#frame=0' }, async (report) => {
  for (const frame of [0, FRAMES - 1]) {
    await report.page.keyboard.press(frame === 0 ? 'Home' : 'End');
    await shows(report, frame);
    const [numbers, row] = [await report.numbers(), truth[frame]];
    assert.equal(numbers['surface-digest'], row.surface_digest);
    assert.equal(numbers.bodies, `${row.bodies}, ${row.cavities}`);
    assert.equal(numbers.genus, String(row.genus));
    assert.equal(numbers.triangles, row.triangles.toLocaleString('en'));
    assert.equal(Number(numbers.area), Number(row.area.toPrecision(7)));
    assert.equal(Number(numbers.volume), Number(row.volume.toPrecision(7)));
  }
  assert.match(await report.page.locator('#omissions').textContent(), /^The report has 500 of [\d,]+ particles\.$/);
  assert.ok(statSync(file('balls.html')).size < 700_000, 'two scripts and eight small frames');
}));

test('drags, keys and buttons turn, zoom and fit; links keep the camera', () => inReport({}, async (report) => {
  const { page } = report;
  const canvas = page.locator('.space canvas');
  await still(report);
  const box = await canvas.boundingBox();
  await changes(report, 'a drag', async () => {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 80, box.y + box.height / 2 + 30, { steps: 4 });
    await page.mouse.up();
  });
  await changes(report, 'zoom in', () => report.button('Zoom in').click());
  await changes(report, 'a frame', () => page.keyboard.press('ArrowRight'));
  await shows(report, 1);
  const hash = new URL(page.url()).hash;
  assert.match(hash, /^#frame=1&camera=/);
  await inReport({ hash }, async (other) => {
    await shows(other, 1);
    await still(other);
    assert.equal(new URL(other.page.url()).hash, hash);
  });
  await changes(report, 'fit', () => page.keyboard.press('f'));
  await report.button('Play').click();
  await until('it plays', async () => await report.frame() > 2);
}));

for (const colorScheme of ['light', 'dark']) {
  test(`parts, colours, clip plane and sections (${colorScheme})`, () => inReport({ colorScheme, hash: '#frame=0' }, async (report) => {
    const { page } = report;
    const shot = (name) => page.screenshot({ path: path.join(screenshots, `report_space_${name}_${colorScheme}.png`), fullPage: true });
    await still(report);
    await shot('first');
    assert.deepEqual(await violations(page), []);
    await changes(report, 'edges', () => page.keyboard.press('m'));
    await changes(report, 'sections', () => page.keyboard.press('i'));
    await changes(report, 'colours of p', () => page.getByLabel('Colour', { exact: true }).selectOption('p'));
    assert.ok(await page.locator('#legend').isVisible());
    await changes(report, 'a clip plane', () => page.getByLabel('Clip plane', { exact: true }).selectOption('y'));
    await changes(report, 'its other side', () => page.getByLabel('Other side').click());
    await changes(report, 'particles', async () => {
      await page.keyboard.press('p');
      await page.getByLabel('Cut faces').click();
    });
    await shot('parts');
    assert.deepEqual(await withoutTooltip(page), []);
    assert.deepEqual(await violations(page), []);
    await page.getByLabel('Picture of').selectOption('1');
    await until('the section is shown', async () => /\d/.test(await report.value('perimeter')));
    await still(report);
    await shot('section');
  }));
}

test('--color-by is the first colour; C switches it', async () => {
  await replay(ballsOf({ folder }), ...SURFACE, '--color-by', 'p', '--report', file('by_p.html'));
  await inReport({ hash: '#frame=0' }, async (report) => {
    const colour = report.page.getByLabel('Colour', { exact: true });
    await still(report);
    assert.equal(await colour.inputValue(), 'p');
    assert.equal(await report.page.locator('#legend-name').textContent(), 'p');
    await changes(report, 'C', () => report.page.keyboard.press('c'));
    assert.equal(await colour.inputValue(), 'plain');
    await report.page.keyboard.press('c');
    await until('the first colour is back', async () => await colour.inputValue() === 'p');
  }, 'by_p.html');
});

/** Share of the pixels of two PNGs that differ clearly. */
async function difference(...pictures) {
  const page = await browser.newPage();
  const share = await page.evaluate(async (all) => {
    const [one, other] = await Promise.all(all.map(async (base64) => {
      const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
      const { width, height } = picture;
      const pen = new OffscreenCanvas(width, height).getContext('2d');
      pen.drawImage(picture, 0, 0);
      return pen.getImageData(0, 0, width, height).data;
    }));
    if (one.length !== other.length) return 1;
    return one.filter((part, k) => Math.abs(part - other[k]) > 40).length / one.length;
  }, pictures);
  await page.close();
  return share;
}

/** The picture without WebGL, once it is fine. */
async function fine(report) {
  await until('the picture is fine', () => report.page.locator('.space canvas').evaluate(
    ({ width, clientWidth }) => width === 2 * clientWidth));
  return still(report);
}

for (const [colorScheme, width] of [['light', 390], ['dark', 1600]]) {
  test(`without WebGL the report shows the same pictures (${colorScheme})`, async () => {
    const bare = await launch(['--no-sandbox', '--disable-gpu', '--disable-3d-apis', '--disable-software-rasterizer']);
    try {
      const options = { width, colorScheme, hash: '#frame=0' };
      await inReport(options, (report) => inReport({ ...options, browser: bare }, async (plain) => {
        for (let frame = 0; frame < FRAMES; ++frame) {
          await Promise.all([report, plain].map((one) => shows(one, frame)));
          assert.equal(await plain.value('surface-digest'), truth[frame].surface_digest);
          const share = await difference(await still(report), await fine(plain));
          assert.ok(share < 0.01, `frame ${frame}: ${share}`);
          await Promise.all([report, plain].map(({ page }) => page.keyboard.press('ArrowRight')));
        }
        await plain.page.keyboard.press('Home');
        await plain.page.getByText('This browser has no WebGL2').waitFor();
        assert.deepEqual(await violations(plain.page), []);
        assert.equal(await plain.page.evaluate(() => document.documentElement.scrollWidth), width);
        const { x, y, width: side, height } = await plain.page.locator('.space canvas').boundingBox();
        const former = await fine(plain);
        await plain.page.mouse.move(x + side / 2, y + height / 2);
        await plain.page.mouse.down();
        await plain.page.mouse.move(x + side / 2 + 60, y + height / 2 + 20, { steps: 4 });
        await plain.page.mouse.up();
        assert.ok(await difference(former, await fine(plain)) > 0.01, 'a drag turns the balls');
        await plain.page.screenshot({ path: path.join(screenshots, `report_space_no_webgl_${colorScheme}.png`), fullPage: true });
        await plain.page.keyboard.press('m');
        await plain.page.keyboard.press('p');
        await plain.page.keyboard.press('i');
        await plain.page.getByLabel('Clip plane', { exact: true }).selectOption('y');
        await plain.page.getByLabel('Other side').click();
        await fine(plain);
        await plain.page.screenshot({ path: path.join(screenshots, `report_space_no_webgl_parts_${colorScheme}.png`), fullPage: true });
      }));
    } finally {
      await bare.close();
    }
  });
}
