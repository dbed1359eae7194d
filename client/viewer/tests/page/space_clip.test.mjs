// Tests the clip plane of surfaces, its cut faces, and the planes of sections. Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { test } from 'node:test';
import { ballsOf, servesBalls, SpaceViewer, SURFACE } from './space_support.mjs';
import { moduleOf, screenshots, until, violations, withoutTooltip } from './support.mjs';

const { axesOf } = await moduleOf('src/space/camera.ts');

let viewer;
const balls = servesBalls(() => viewer);

const choose = (label, value) => viewer.page.getByLabel(label, { exact: true }).selectOption(value);
const toggle = (label) => viewer.page.getByLabel(label, { exact: true }).click();
const isChecked = (label) => viewer.page.getByLabel(label, { exact: true }).isChecked();
const changes = (what, act) => viewer.changes(what, act);
const shot = (name) => viewer.page.screenshot({ path: path.join(screenshots, `space_clip_${name}.png`) });
const link = () => decodeURIComponent(new URL(viewer.page.url()).hash);

/** The first frame without its front halves, as seen from the camera. The first ball has a cavity. */
async function openCut(options = {}) {
  viewer = await SpaceViewer.ofBalls(balls.browser, balls.world.url, options);
  await viewer.pauseAtFirst();
  await toggle('Sections');
  await choose('Clip plane', 'y');
  await changes('the other side', () => toggle('Other side'));
}

/** Red, green and blue of a PNG at places in CSS pixels. */
function coloursOf(png, places) {
  return viewer.page.evaluate(async ([base64, at]) => {
    const bytes = Uint8Array.from(atob(base64), (one) => one.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const context = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height }).getContext('2d');
    context.drawImage(image, 0, 0);
    return at.map(({ x, y }) => [...context.getImageData(Math.round(x), Math.round(y), 1, 1).data.slice(0, 3)]);
  }, [png.toString('base64'), places]);
}

/** Colours of the picture at world positions. */
async function coloursAt(...points) {
  await viewer.still();
  const places = await Promise.all(points.map((point) => viewer.placeOf(point)));
  return coloursOf(await viewer.pixelsOf(viewer.space()), places);
}

/** The direction to the camera. */
function directionNow() {
  const [, , , turn, tilt] = /camera=([^&]*)/.exec(link())[1].split(',').map(Number);
  return axesOf({ turn, tilt }).back;
}

/** The point nearest to another one in the plane through the middle of the box, across a direction. */
function onPlane(point, along = directionNow()) {
  const above = point.reduce((sum, part, axis) => sum + part * along[axis], 0);
  return point.map((part, axis) => part - above * along[axis]);
}

const apart = (a, b) => Math.max(...a.map((value, k) => Math.abs(value - b[k])));

/** Points of the cut faces: in front of the outer wall and of the cavity's, of the other ball; and in the cavity. */
const FACE = [[-8, 0, 4.5], [-12.5, 0, 0], [-3.6, 0, 0]];
const OTHER = [8.5, 0, 2.5];
const CAVITY = [[-8, 0, 0], [-9, 0, 1], [-7, 0, 0]];

test('cut faces have the colours of their bodies and hide what is behind them', async () => {
  await openCut();
  await changes('colour by body', () => choose('Colour', 'identity'));
  const [first, second, third, other, ...cavity] = await coloursAt(...FACE, OTHER, ...CAVITY);
  await shot('identity');
  for (const colour of [second, third]) assert.ok(apart(first, colour) < 4, `${first} and ${colour}`);
  assert.ok(apart(first, other) > 20, 'another body has another colour');
  assert.ok(Math.max(...cavity.map((colour) => apart(first, colour))) > 10, 'the cavity is open');
  await toggle('Particles');
  const hidden = await coloursAt(...FACE, OTHER);
  [first, second, third, other].forEach((colour, k) => assert.ok(apart(colour, hidden[k]) < 4, `point ${k} hides the particles`));
  await toggle('Mesh edges');
  const withEdges = await coloursAt(...FACE, OTHER);
  [first, second, third, other].forEach((colour, k) => assert.ok(apart(colour, withEdges[k]) < 4, `point ${k} hides the edges`));
  await shot('edges');
  await toggle('Mesh edges');
  await changes('no cut faces', () => toggle('Cut faces'));
  await shot('hollow');
  await changes('cut faces', () => toggle('Cut faces'));
  await toggle('Particles');
  await changes('colours of p', () => choose('Colour', 'p'));
  const [face, beside] = await coloursAt(FACE[0], OTHER);
  assert.ok(apart(face, beside) < 4, 'no point of a cut face has a number');
  await shot('values');
  await changes('a translucent surface', () => toggle('Translucent'));
  const [open, openToo] = await coloursAt(FACE[0], FACE[1]);
  assert.ok(apart(open, openToo) > 3, 'a translucent surface shows its inside');
  await shot('translucent');
});

/** A layer of 17 x 17 columns, 6 to 9 particles high, without an end along x and y. */
function layer() {
  const lines = ['x,y,z'];
  for (let x = 0; x < 17; ++x) {
    for (let y = 0; y < 17; ++y) {
      const height = 7.5 + 1.5 * Math.sin(2 * Math.PI * x / 17) * Math.cos(2 * Math.PI * y / 17);
      for (let z = 0; z < height; ++z) lines.push([x + 0.5, y + 0.5, z].join(','));
    }
  }
  return `${lines.join('\n')}\n`;
}

test('a face of a periodic box that cuts a layer is flat up to its rim', async () => {
  const file = path.join(balls.world.folder, 'layer.csv');
  writeFileSync(file, layer());
  const producer = balls.world.replayOf(file, 'layer', '--surface', '--spacing', '1', '--periodic', 'x,y',
    '--box', '0,17,0,17,-9,29', '--loop', '--rate', '5');
  viewer = await SpaceViewer.open(balls.browser, balls.world.url, { hash: '#stream=layer' });
  await viewer.drawsSurface();
  await viewer.button('Pause').click();
  // In the middle of the face y = 0, and less than a cell from its rim.
  const [middle, ...rim] = await coloursAt([8.5, 0, 3.5], [5, 0, -0.35], [8.5, 0, -0.35], [12, 0, -0.35], [8.5, 0, 7.3]);
  await shot('box');
  for (const colour of rim) assert.ok(apart(middle, colour) < 5, `${middle} and ${colour}`);
  await producer.stop();
});

test('the clip plane cuts the outlines of sections', async () => {
  await openCut();
  // Around the section z = 0 of the ball without a cavity, whose radius is between 5.9 and 6.7.
  const circle = Array.from({ length: 90 * 9 }, (_, k) => {
    const [angle, radius] = [(k % 90) * Math.PI / 45, 5.9 + 0.1 * Math.floor(k / 90)];
    return [8 + radius * Math.cos(angle), radius * Math.sin(angle), 0];
  });
  const places = await Promise.all(circle.map((point) => viewer.placeOf(point)));
  const others = await Promise.all(circle.map(([x, ...rest]) => viewer.placeOf([x - 16, ...rest])));
  const kept = [...places, ...others].filter((_, k) => circle[k % circle.length][1] > -1);
  // A place in front of the plane can also show what is behind it, of both balls.
  const isApart = (at) => kept.every(({ x, y }) => Math.hypot(x - at.x, y - at.y) > 6);
  const front = circle.filter(([, y], k) => y < -1 && isApart(places[k]));
  const back = circle.filter(([, y]) => y > 1);
  // The section y = 2 lies behind the plane, and is seen through the surface.
  await viewer.page.locator('#outline-list input:enabled').nth(1).uncheck();
  const before = await coloursAt(...front, ...back);
  await changes('sections', () => toggle('Sections'));
  const cut = await coloursAt(...front, ...back);
  // The line is orange; the colours of the surface's silhouette change as well, but keep their hue.
  const isLine = (former, now) => now[0] - now[2] > former[0] - former[2] + 40;
  const lines = (from, to) => before.slice(from, to).filter((colour, k) => isLine(colour, cut[from + k])).length;
  await shot('sections');
  assert.equal(lines(0, front.length), 0, 'nothing is drawn on the side that is cut away');
  assert.ok(lines(front.length, before.length) > 20, 'the other side has its outline');
  await changes('no clip plane', () => choose('Clip plane', 'none'));
  const whole = await coloursAt(...front);
  assert.ok(whole.filter((colour, k) => isLine(before[k], colour)).length > 20, 'without the plane the line is whole');
});

test('the pointer is on the cut face, and selects its body', async () => {
  await openCut();
  const readout = viewer.pane().locator('.space .readout');
  for (const point of FACE) {
    const { x, y } = await viewer.placeOf(point);
    await viewer.space().hover({ position: { x, y } });
    await until('the pointer is described', async () => /body \d+:/.test(await readout.textContent()));
    const found = /x (\S+), y (\S+), z (\S+)/.exec(await readout.textContent()).slice(1).map((text) => Number(text.replace('−', '-')));
    assert.ok(apart(found, point) < 0.1, `${found} at ${point}`);
  }
  const [before] = await coloursAt(FACE[0]);
  await viewer.space().click({ position: await viewer.placeOf(FACE[0]) });
  await until('the body is selected', async () => /Selected: body/.test(await readout.textContent()));
  const [after, other] = await coloursAt(FACE[0], OTHER);
  assert.ok(apart(before, after) > 20, 'the cut face shows the selection');
  assert.ok(apart(before, other) < 4, 'the other body does not');
});

test('a clip plane across the view turns with it, or keeps its direction', async () => {
  await openCut();
  assert.ok(!await viewer.page.getByLabel('Hold plane').isVisible());
  await changes('across the view', () => choose('Clip plane', 'view'));
  await toggle('Other side');
  const [front] = await coloursAt(onPlane([8, 0, 0]));
  assert.ok(apart(front, (await coloursAt([0, 0, 0]))[0]) > 20, 'the cut face is seen');
  await viewer.space().focus();
  const turn = async (times) => {
    for (let k = 0; k < times; ++k) await viewer.page.keyboard.press('ArrowLeft');
  };
  await turn(8);
  const [turned] = await coloursAt(onPlane([8, 0, 0]));
  await shot('view');
  assert.ok(apart(front, turned) < 4, `the cut face is across the view: ${front}, ${turned}`);
  await shot('view');
  assert.doesNotMatch(link(), /held/);
  await toggle('Hold plane');
  const held = /held:([^,&]*)/.exec(link())[1];
  await viewer.space().focus();
  await turn(5);
  assert.equal(/held:([^,&]*)/.exec(link())[1], held);
  await shot('held');
  const inPlane = onPlane([8, 0, 0], held.split(':').map(Number));
  const [before] = await coloursAt(inPlane);
  assert.ok(apart(front, before) < 4, 'the plane keeps its direction');
  const address = new URL(viewer.page.url()).hash;
  await viewer.page.goto('about:blank');
  await viewer.page.goto(balls.world.url + address);
  await until('the link is shown', async () => await viewer.isDrawn() && new URL(viewer.page.url()).hash === address);
  assert.ok(apart(front, (await coloursAt(inPlane))[0]) < 4, 'the link has the plane');
  assert.ok(await isChecked('Hold plane'));
  await changes('a plane that turns', () => toggle('Hold plane'));
});

test('keys move the clip plane and switch its parts', async () => {
  await openCut();
  const { keyboard } = viewer.page;
  for (const [label, key] of [['Position', 'ArrowRight'], ['Position', 'PageUp'], ['Other side', ' '], ['Cut faces', ' ']]) {
    await viewer.page.getByLabel(label, { exact: true }).focus();
    if (label === 'Cut faces') await toggle('Other side');
    await viewer.page.getByLabel(label, { exact: true }).focus();
    await changes(`${key} at ${label}`, () => keyboard.press(key));
  }
  await viewer.page.getByLabel('Clip plane', { exact: true }).focus();
  await changes('a letter', () => keyboard.press('n'));
  assert.ok(!await viewer.page.getByLabel('Position', { exact: true }).isVisible());
});

test('a PNG shows the cut faces', async () => {
  await openCut();
  const places = await Promise.all([...FACE, OTHER, ...CAVITY].map((point) => viewer.placeOf(point)));
  await viewer.still();
  const shown = await coloursOf(await viewer.pixelsOf(viewer.space()), places);
  const loaded = viewer.page.waitForEvent('download');
  await viewer.button('PNG').click();
  const png = readFileSync(await (await loaded).path());
  const saved = await coloursOf(png, places);
  shown.forEach((colour, k) => assert.ok(apart(colour, saved[k]) < 4, `point ${k}: ${colour} and ${saved[k]}`));
});

test('planes of sections have borders, which a stream without sections lacks', async () => {
  viewer = await SpaceViewer.ofBalls(balls.browser, balls.world.url);
  await viewer.pauseAtFirst();
  await changes('borders', () => toggle('Planes'));
  assert.match(link(), /space=planes/);
  await shot('planes');
  await changes('one border', () => viewer.page.locator('#outline-list input:enabled').first().click());
  await changes('no sections', () => toggle('Sections'));
  const producer = balls.world.replayOf(ballsOf(balls.world), 'bare', ...SURFACE, '--loop', '--rate', '5');
  await viewer.button('Watch bare').click();
  await until('the other stream is shown', async () => await viewer.pane().locator('.name').textContent() === 'bare');
  await viewer.shows();
  await until('no switch of sections', async () => !await viewer.page.getByLabel('Planes').isVisible());
  await producer.stop();
});

for (const colorScheme of ['light', 'dark']) {
  test(`a cut looks right, ${colorScheme}`, async () => {
    for (const [name, width, height] of [['wide', 1600, 900], ['narrow', 390, 800]]) {
      const hash = '#stream=balls&look=fill,sections,axes,colour:identity&space=clip:view:0.6,planes';
      viewer = await SpaceViewer.ofBalls(balls.browser, balls.world.url, { colorScheme, width, height, hash });
      assert.deepEqual(await violations(viewer.page), []);
      await shot(`${name}_${colorScheme}`);
      assert.deepEqual(await withoutTooltip(viewer.page), []);
      if (name === 'wide') {
        await viewer.close();
        continue;
      }
      await viewer.page.locator('#fold').click();
      await viewer.page.getByLabel('Hold plane').scrollIntoViewIfNeeded();
      assert.deepEqual(await violations(viewer.page), []);
      await shot(`panel_${colorScheme}`);
    }
  });
}
