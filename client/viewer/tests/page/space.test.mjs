// Tests surfaces in space in the page. Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';
import { ballsOf, FRAMES, servesBalls, SpaceViewer, streamBalls, SURFACE } from './space_support.mjs';
import { screenshots, until, violations, withoutTooltip } from './support.mjs';

let viewer;
const balls = servesBalls(() => viewer);

const open = async (options = {}) => { viewer = await SpaceViewer.ofBalls(balls.browser, balls.world.url, options); };
const changes = (what, act) => viewer.changes(what, act);
const shot = (name) => viewer.page.screenshot({ path: path.join(screenshots, `space_${name}.png`) });

test('a live surface is drawn and moves, in every format', async () => {
  await open();
  const first = await viewer.frame();
  const picture = await viewer.picture();
  await viewer.shows(first + 3);
  await until('the picture moves', async () => await viewer.picture() !== picture);
  await until('the stream is live', async () => await viewer.status() === 'Live');
  for (const format of ['float64', 'float32']) {
    const name = `balls_${format}`;
    const producer = streamBalls(balls.world, name, format);
    await viewer.button(`Watch ${name}`).click();
    await until(`${name} is shown`, async () => await viewer.pane().locator('.name').textContent() === name);
    await viewer.shows();
    await until(`${name} is drawn`, () => viewer.isDrawn());
    await producer.stop();
  }
});

test('numbers and curves are those of surfaces', async () => {
  await open();
  const at = await viewer.pauseAtFirst();
  const truth = (await balls.world.statistics(ballsOf(balls.world), ...SURFACE))[(at - 1) % FRAMES];
  const numbers = await viewer.numbers();
  assert.equal(numbers.bodies, '2, 1');
  assert.equal(numbers['surface-digest'], truth.surface_digest);
  assert.equal(numbers.triangles, truth.triangles.toLocaleString('en'));
  assert.equal(Number(numbers.area), Number(truth.area.toPrecision(7)));
  assert.equal(Number(numbers.volume), Number(truth.volume.toPrecision(7)));
  assert.equal(await viewer.pane().locator('[data-key="rings"]').isVisible(), false);
  for (const curve of ['Volume', 'Bodies, cavities']) {
    assert.ok(await viewer.page.getByRole('figure', { name: curve }).isVisible(), curve);
  }
  assert.equal(await viewer.page.getByRole('figure', { name: 'Rings, holes' }).isVisible(), false);
});

test('every control changes the picture', async () => {
  await open();
  await viewer.pauseAtFirst();
  const { page } = viewer;
  const choose = (label, value) => page.getByLabel(label, { exact: true }).selectOption(value);
  const toggle = (label) => page.getByLabel(label, { exact: true }).click();
  await changes('flat shading', () => choose('Shading', 'flat'));
  await changes('a parallel projection', () => choose('Projection', 'parallel'));
  await changes('edges', () => toggle('Mesh edges'));
  await changes('translucent', () => toggle('Translucent'));
  await changes('particles', () => toggle('Particles'));
  await changes('no surface', () => toggle('Filled'));
  await changes('the surface', () => toggle('Filled'));
  await changes('colour by body', () => choose('Colour', 'identity'));
  await changes('colour by p', () => choose('Colour', 'p'));
  assert.ok(await page.locator('#legend').isVisible());
  await changes('another map', () => choose('Colour map', 'blue-red'));
  await changes('axes', () => toggle('Axes'));
  assert.ok(await viewer.pane().locator('.space .overlay text').count() > 6);
  await changes('no sections', () => toggle('Sections'));
  await changes('sections', () => toggle('Sections'));
  await changes('one section', () => page.locator('#outline-list input:enabled').first().click());
  await changes('a clip plane', () => choose('Clip plane', 'x'));
  await changes('its position', () => page.getByLabel('Position', { exact: true }).fill('0.3'));
  await changes('its other side', () => toggle('Other side'));
  await shot('controls');
  const address = new URL(page.url()).hash;
  assert.match(decodeURIComponent(address), /space=flat,translucent,parallel,clip:x:0.3:flipped/);
  const frame = await viewer.frame();
  await page.goto('about:blank');
  await page.goto(balls.world.url + address);
  await until('the link shows the frame', async () => await viewer.frame() === frame && await viewer.isDrawn());
  assert.equal(new URL(page.url()).hash, address);
  assert.equal(await page.getByLabel('Clip plane').inputValue(), 'x');
  assert.equal(await page.getByLabel('Projection').inputValue(), 'parallel');
});

test('a picture turns, pans, zooms to the pointer and fits', async () => {
  await open();
  await viewer.pauseAtFirst();
  const { page } = viewer;
  const box = await viewer.space().boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const drag = async (key) => {
    if (key) await page.keyboard.down(key);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 90, y + 40, { steps: 4 });
    await page.mouse.up();
    if (key) await page.keyboard.up(key);
    await page.mouse.move(box.x + 4, box.y + 4);
  };
  const first = await viewer.still();
  await changes('a drag', () => drag());
  await changes('a drag with Shift', () => drag('Shift'));
  await changes('the wheel', async () => {
    await page.mouse.wheel(0, -300);
  });
  await changes('fit', () => viewer.button('Fit').click());
  assert.notEqual(await viewer.still(), first, 'the direction stays');
  await viewer.space().focus();
  for (const key of ['ArrowLeft', 'Shift+ArrowUp', '+', '-', '0']) await changes(key, () => page.keyboard.press(key));
});

test('a body is selected, described, and followed through its merge', async () => {
  await open();
  const begin = await viewer.pauseAtFirst();
  const readout = viewer.pane().locator('.space .readout');
  const says = (what, rule) => until(what, async () => rule.test(await readout.textContent()));
  await viewer.space().click({ position: await viewer.placeOf([-8, 0, 0]) });
  await says('the body is described', /Selected: body \d+: area [\d.]+, volume [\d.]+, particles \d+$/);
  await shot('selected');
  await viewer.goTo(begin + FRAMES - 1);
  const { particles, bodies } = await viewer.numbers();
  assert.match(bodies, /^1, 1$/);
  await says('the merged body is selected', new RegExp(`Selected: body \\d+: .*particles ${particles}\\b`));
  await viewer.space().focus();
  await viewer.page.keyboard.press('Escape');
  await says('nothing is selected', /^((?!Selected)[^])*$/);
});

test('a section is shown in its plane, and the surface again', async () => {
  await open();
  await viewer.pauseAtFirst();
  const { page } = viewer;
  await page.getByLabel('Picture of').selectOption({ label: 'z = 0' });
  await until('the outline is shown', async () => Number((await viewer.numbers()).vertices) > 10);
  assert.ok(!await viewer.space().isVisible());
  assert.ok(await viewer.button('SVG').isEnabled());
  await page.getByLabel('Picture of').selectOption({ label: 'Surface' });
  await until('the surface is shown', async () => await viewer.space().isVisible() && await viewer.isDrawn());
});

test('controls of outlines are disabled with a reason', async () => {
  await open();
  for (const name of ['SVG', 'GeoJSON', 'Add', '32 × 32 cells']) {
    assert.ok(await viewer.button(name).isDisabled(), name);
  }
  for (const label of ['Outline', 'Normals', 'Measure', 'Placement', 'Surface offset', 'New gauge']) {
    assert.ok(await viewer.page.getByLabel(label, { exact: true }).isDisabled(), label);
  }
  assert.deepEqual(await withoutTooltip(viewer.page), []);
  const loaded = viewer.page.waitForEvent('download');
  await viewer.button('PNG').click();
  assert.match((await loaded).suggestedFilename(), /^balls_\d+\.png$/);
});

test('two pictures share the camera, and can show a section beside the surface', async () => {
  await open();
  await viewer.pauseAtFirst();
  await viewer.button('Side by side').click();
  await until('two pictures', async () => await viewer.page.locator('.pane').count() === 2);
  await until('both are drawn', async () => await viewer.isDrawn(0) && await viewer.isDrawn(1));
  const other = await viewer.still(1);
  await viewer.pane(0).locator('.space canvas').focus();
  await viewer.page.keyboard.press('ArrowRight');
  await until('the other picture turns', async () => await viewer.picture(1) !== other);
  await shot('pair');
});

/** The different counts of drawn frames in the file of curves. */
async function drawnCounts() {
  const loaded = viewer.page.waitForEvent('download');
  await viewer.button('CSV of curves').click();
  const [names, ...rows] = readFileSync(await (await loaded).path(), 'utf8').trim().split('\n').map((row) => row.split(','));
  const column = names.indexOf('drawn');
  return [...new Set(rows.map((cells) => cells[column]).filter((cell) => cell !== '').map(Number))];
}

test('a frame counts as drawn once its surface is', async () => {
  await open();
  await viewer.shows(await viewer.frame() + 3);
  const drawn = await drawnCounts();
  assert.ok(Math.max(...drawn) > 2, `${drawn}`);
});

test('an outline that the frames lack is the surface', async () => {
  await open({ hash: '#stream=balls&look=fill,of:7' });
  assert.ok(await viewer.space().isVisible());
  assert.match((await viewer.numbers()).bodies, /^[12], [01]$/);
});

test('the link has the camera that fits the window', async () => {
  await open();
  await viewer.pauseAtFirst();
  const camera = () => /camera=([^&]*)/.exec(viewer.page.url())?.[1];
  const before = camera();
  await viewer.page.setViewportSize({ width: 900, height: 900 });
  await until('the camera of the link changes', () => camera() !== before);
  await viewer.still();
  const middle = await viewer.placeOf([0, 0, 0]);
  const { width, height } = await viewer.space().boundingBox();
  assert.ok(Math.abs(middle.x - width / 2) < 0.2 * width && Math.abs(middle.y - height / 2) < 0.2 * height);
});

test('a pane says why it shows no surface', async () => {
  const cases = [
    ['space.js', /space\.js, cannot be loaded/],
    ['space_worker.js', /cannot start the decoder of surfaces/],
  ];
  for (const [file, reason] of cases) {
    await viewer?.close();
    viewer = await SpaceViewer.open(balls.browser, balls.world.url);
    await viewer.page.route(`**/${file}`, (route) => route.abort());
    await viewer.page.goto(`${balls.world.url}#stream=balls`);
    await viewer.page.reload();
    const notice = viewer.pane().locator('.notice');
    await until(`the notice without ${file}`, async () => reason.test(await notice.textContent()) && await notice.isVisible());
    assert.equal(await viewer.pane().locator('.state').textContent(), 'Refused');
    await viewer.shows(await viewer.frame() + 2);
    assert.deepEqual(await drawnCounts(), [0], `no frame is drawn without ${file}`);
    viewer.errors = viewer.errors.filter((text) => !/Failed to load resource/.test(text));
    assert.deepEqual(viewer.errors, []);
  }
});

/** Overwrites the header of the compressed triangles of a frame. */
function damaged(message) {
  const bytes = Buffer.from(message);
  for (let at = 0; at + 4 < bytes.length; ++at) {
    if (bytes[at] !== 0x12) continue;  // Field 2 of Surface, with a length of two or three bytes.
    for (const size of [2, 3]) {
      const header = bytes[at + 1 + size];
      const isLength = bytes[at + size] < 0x80 && bytes.subarray(at + 1, at + size).every((byte) => byte >= 0x80);
      if (isLength && (header & 0xf0) === 0xe0) bytes[at + 1 + size] = 0;
    }
  }
  return bytes;
}

test('a damaged frame is refused by name, and the next one is shown', async () => {
  viewer = await SpaceViewer.open(balls.browser, balls.world.url);
  let isDamaging = true;
  await viewer.page.routeWebSocket(/v1\/watch/, (socket) => {
    const server = socket.connectToServer();
    server.onMessage((message) => socket.send(isDamaging && message.length > 2000 ? damaged(message) : message));
  });
  await viewer.page.goto(`${balls.world.url}#stream=balls`);
  await viewer.page.reload();
  const notice = viewer.pane().locator('.notice');
  await until('the notice', async () => /Frame \d+ cannot be shown: surface\.triangles does not decompress/.test(await notice.textContent()));
  assert.equal(await viewer.pane().locator('.state').textContent(), 'Refused');
  isDamaging = false;
  await until('a whole frame is shown', async () => await viewer.pane().locator('.state').textContent() === 'Live');
  await until('it is drawn', () => viewer.isDrawn());
});

for (const colorScheme of ['light', 'dark']) {
  test(`the page looks right, ${colorScheme}`, async () => {
    for (const [name, width, height] of [['wide', 1600, 900], ['narrow', 390, 800]]) {
      await open({ colorScheme, width, height });
      await until('frames', async () => await viewer.frame() > 2);
      await viewer.page.evaluate(() => document.querySelector('#axes').click());
      assert.deepEqual(await violations(viewer.page), []);
      await shot(`${name}_${colorScheme}`);
      if (name === 'wide') await viewer.close();
    }
  });
}
