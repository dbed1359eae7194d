// Tests of the page's controls: settings, shortcuts, and controls of features that the browser or the
// stream lacks.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, screenshots, until, Viewer, World } from './support.mjs';

let browser, world, viewer;
before(async () => {
  browser = await launch();
  world = await World.start();
  world.loop('dam');
});
cleansUp(() => ({ world, browser, viewer }), { makesErrors: true });

const open = async (hash = '#stream=dam', from = browser) => {
  viewer = await Viewer.open(from, world.url, { hash });
  await viewer.shows(5);
};
const fill = async (label, value) => {
  const field = viewer.page.getByLabel(label, { exact: true });
  await field.fill(value);
  await field.blur();
};
const settings = () => new URLSearchParams(new URL(viewer.page.url()).hash.slice(1)).get('set') ?? '';

test('an invalid field keeps its last valid value, and other fields apply', async () => {
  await open();
  await viewer.button('Pause').click();
  await fill('Kernel radius', '3.25');
  await until('a quarter is legal', async () => settings() === 'kernel:3.25');
  await fill('Kernel radius', '99');
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('qef');
  await until('the placement applies', async () => settings() === 'placement:qef;kernel:3.25');
  await until('it is computed', async () => await viewer.value('placement') === 'qef');
  assert.equal(await viewer.page.getByLabel('Kernel radius', { exact: true }).inputValue(), '99', 'to be corrected');
  await fill('Kernel radius', '4');
  await until('the correction applies', async () => settings() === 'placement:qef;kernel:4');
});

test('shortcuts work after a click on a button and on a checkbox', async () => {
  await open();
  const at = await viewer.pause();
  await viewer.reaches(at - 2);
  await viewer.page.keyboard.press(',');
  await until('one back', async () => await viewer.frame() < at);
  await viewer.page.getByLabel('Mesh edges').click();
  await viewer.page.keyboard.press('.');
  await until('one forward', async () => await viewer.frame() === at);
  await viewer.button('Fit').click();
  await viewer.page.keyboard.press(' ');
  await until('Space plays', async () => await viewer.button('Pause').count() === 1);
  assert.ok(await viewer.page.getByLabel('Mesh edges').isChecked(), 'Space did not switch the box');
});

test('a button focused by the keyboard keeps Space, and text fields keep all keys', async () => {
  await open();
  const at = await viewer.pause();
  await viewer.button('Previous frame').focus();
  await viewer.reaches(at - 2);
  await viewer.page.keyboard.press(' ');
  const back = await until('the button acts', async () => await viewer.frame() < at && viewer.frame());
  assert.equal(await viewer.button('Play').count(), 1, 'it does not play');
  await viewer.page.getByLabel('Kernel radius', { exact: true }).focus();
  await viewer.page.keyboard.press('.');
  await viewer.page.waitForTimeout(200);
  assert.equal(await viewer.frame(), back);
});

test('normals and particles that a stream lacks are disabled, with the reason', async () => {
  const bare = world.replayOf(path.join(import.meta.dirname, '../../../recordings/dam_break.pemc'), 'bare', '--loop',
                              '--rate', '15');
  await open('#stream=bare');
  for (const name of ['Normals', 'Particles']) {
    const box = viewer.page.getByLabel(name, { exact: true });
    await until(`${name} is disabled`, () => box.isDisabled());
    const reason = await box.evaluate((element) => element.parentElement.title);
    assert.match(reason, name === 'Normals' ? /no normals.*Outputs\.normals/ : /no particles.*--echo-particles/);
  }
  await viewer.page.evaluate(() => { location.hash = '#stream=dam'; });
  await until('particles of another stream', () => viewer.page.getByLabel('Particles', { exact: true }).isEnabled());
  await bare.stop();
});

test('without a clipboard the page shows the link', async () => {
  await open();
  await viewer.page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined }));
  await viewer.button('Pause').click();
  await viewer.button('Copy link to this picture').click();
  const link = viewer.page.getByLabel('Link to this picture', { exact: true });
  await link.waitFor();
  assert.equal(await link.inputValue(), viewer.page.url());
  assert.match(await viewer.status(), /does not let this page copy/);
});

test('without WebGL the page says so, and offers SVG', async () => {
  const bare = await launch(['--no-sandbox', '--disable-gpu', '--disable-3d-apis', '--disable-software-rasterizer']);
  try {
    await open('#stream=dam', bare);
    await viewer.page.getByText('This browser has no WebGL2').waitFor();
    assert.ok(await viewer.button('PNG').isDisabled());
    assert.match(await viewer.button('PNG').getAttribute('title'), /WebGL2.*SVG/);
    assert.ok(await viewer.button('SVG').isEnabled());
    await viewer.page.screenshot({ path: path.join(screenshots, 'no_webgl.png') });
    assert.deepEqual(viewer.errors, []);
  } finally {
    await viewer?.close();
    viewer = null;
    await bare.close();
  }
});

/** Particles of a rotating square. */
function rotating() {
  const lines = ['id,x,y,vx,vy'];
  for (let i = 0; i < 24; ++i) {
    for (let j = 0; j < 24; ++j) {
      const [x, y] = [i * 0.05, j * 0.05];
      lines.push([24 * i + j + 1, x, y, -(y - 0.6), x - 0.6].join(','));
    }
  }
  return `${lines.join('\n')}\n`;
}

test('a vector attribute is coloured by magnitude and by component', async () => {
  const folder = path.join(world.folder, 'rotating');
  mkdirSync(folder);
  for (let k = 0; k < 3; ++k) writeFileSync(path.join(folder, `r_${k}.csv`), rotating());
  writeFileSync(path.join(folder, 'times.csv'), 'frame,t\n0,0\n1,1\n2,2\n');
  const stream = world.replayOf(folder, 'rotating', '--attributes', 'velocity', '--loop', '--rate', '15',
                                '--echo-particles', '--spacing', '.05');
  await open('#stream=rotating');
  await viewer.button('Pause').click();
  const colour = viewer.page.getByLabel('Colour', { exact: true });
  await until('its channels are offered', async () =>
    (await colour.locator('option').allTextContents()).join() ===
      'one colour,by identity,by velocity, magnitude,by velocity x,by velocity y');
  await viewer.page.getByLabel('Particles', { exact: true }).check();
  const pictures = new Set();
  const legend = () => viewer.page.locator('#legend').evaluate((element) => element.innerText.split(/\s*\n\s*/).join(' '));
  for (const [channel, name, least] of [['velocity', 'velocity, magnitude', 0], ['velocity x', 'velocity x', -0.6],
    ['velocity y', 'velocity y', -0.6]]) {
    await colour.selectOption(channel);
    await until('the legend names it', async () => (await legend()).includes(name));
    const min = Number(await viewer.page.locator('#legend-min').textContent());
    assert.ok(Math.abs(min - least) < 0.08, `${channel} begins at ${min}`);
    await until('the picture changes', async () => !pictures.has(await viewer.picture()));
    pictures.add(await viewer.picture());
    await viewer.page.screenshot({ path: path.join(screenshots, `vector_${channel.replace(' ', '_')}.png`) });
  }
  await viewer.page.getByLabel('Colour map').selectOption('blue-red');
  await until('the map changes', async () => !pictures.has(await viewer.picture()));
  pictures.add(await viewer.picture());
  await fill('First number of the range', '-2');
  await fill('Last number of the range', '2');
  await until('the range is fixed', async () => await viewer.page.locator('#legend-min').textContent() === '-2');
  await until('the range changes the picture', async () => !pictures.has(await viewer.picture()));
  const hash = new URL(viewer.page.url()).hash;
  assert.match(decodeURIComponent(hash), /colour:velocity y,map:blue-red,from:-2,to:2/);
  const [download] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button('SVG').click()]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  const text = Buffer.concat(chunks).toString();
  for (const part of ['velocity y', 'rotating, frame', ', time ', '>-2<', '>2<']) assert.ok(text.includes(part), part);
  const [png] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button('PNG').click()]);
  await png.saveAs(path.join(screenshots, 'export.png'));
  await stream.stop();
});
