// Options of files, truncated recordings and closed files. Leaves screenshots in build/screenshots.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, recording, screenshots, until, Viewer, violations, withoutTooltip, World } from './support.mjs';

let world, browser, viewer;
const place = (name) => path.join(world.folder, name);

before(async () => {
  world = await World.start();
  browser = await launch();
  // A ball of particles 0.1 apart: type 1 on the left, type 2 on the right.
  const ball = ['id,type,x,y,z'];
  for (let i = -8; i <= 8; ++i) {
    for (let j = -8; j <= 8; ++j) {
      for (let k = -8; k <= 8; ++k) {
        if (i * i + j * j + k * k <= 64) ball.push([ball.length, i < 0 ? 1 : 2, i / 10, j / 10, 1 + k / 10].join());
      }
    }
  }
  writeFileSync(place('ball.csv'), `${ball.join('\n')}\n`);
  const flat = ball.map((row) => row.split(',')).filter((cells, k) => k === 0 || cells[4] === '1')
    .map((cells) => cells.slice(0, 4).join());
  writeFileSync(place('flat.csv'), `${flat.join('\n')}\n`);
  writeFileSync(place('odd.csv'), `${flat.join('\n').replace('x,y', 'east,north')}\n`);
  const whole = readFileSync(recording);
  writeFileSync(place('cut.pemc'), whole.subarray(0, whole.length / 2));
});
cleansUp(() => ({ world, browser, viewer }));

const field = (label) => viewer.page.locator('#file-options').getByLabel(label, { exact: true });
const errorOf = (name) => viewer.page.locator(`#file-${name}-error`);
const submit = () => viewer.button('Open with these options').click();
const shows = (digest) => until('the numbers of the command line', async () => await viewer.value('rings-digest') === digest);
const shot = (name) => viewer.page.screenshot({ path: path.join(screenshots, `${name}.png`) });

test('3D particles ask for their plane, with defaults of the file', async () => {
  const [truth] = await world.statistics(place('ball.csv'), '--slice', 'z=1', '--spacing', '0.1');
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('ball.csv'));
  await until('the question', async () => /is 3D/.test(await errorOf('slice').textContent()));
  assert.deepEqual([await field('Plane').inputValue(), await field('Spacing').inputValue()], ['z=1', '0.1']);
  assert.equal(await field('Plane').getAttribute('aria-invalid'), 'true');
  assert.deepEqual(await withoutTooltip(viewer.page), []);
  assert.deepEqual(await violations(viewer.page), []);
  await shot('file_asks');
  await submit();
  await shows(truth.rings_digest);
  assert.equal(await errorOf('slice').isVisible(), false);
  await viewer.page.getByLabel('Particles', { exact: true }).check();
  await shot('file_slice');
  const { hash } = new URL(viewer.page.url());
  assert.match(hash, /open=spacing:0\.1;slice:z%3D1/);
  const other = await Viewer.open(browser, world.url, { hash });
  const first = viewer;
  viewer = other;
  await viewer.drop(place('ball.csv'));
  await shows(truth.rings_digest);
  await first.close();
});

test('3D particles open as a surface, with sections', async () => {
  const flags = ['--surface', '--spacing', '0.1', '--attributes', 'type'];
  const [truth] = await world.statistics(place('ball.csv'), ...flags);
  const [section] = await world.statistics(place('ball.csv'), '--slice', 'z=1', '--spacing', '0.1');
  const isTrue = () => until('the numbers of the command line', async () => await viewer.value('surface-digest') === truth.surface_digest);
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('ball.csv'));
  await until('the question', async () => /is 3D/.test(await errorOf('slice').textContent()));
  await viewer.button('Open as a surface').click();
  await isTrue();
  assert.ok(await viewer.pane().locator('.space canvas').isVisible());
  assert.equal(await errorOf('slice').isVisible(), false);
  assert.equal((await viewer.numbers()).bodies, '1, 0');
  await viewer.allFrames();
  assert.deepEqual(await violations(viewer.page), []);
  await shot('file_surface');
  assert.match(new URL(viewer.page.url()).hash, /open=spacing:0\.1;slice:surface/);
  await field('Plane').fill('surface; z=1');
  await submit();
  await viewer.page.getByLabel('Picture of').selectOption({ label: 'z = 1' });
  await shows(section.rings_digest);
  const { hash } = new URL(viewer.page.url());
  await viewer.close();
  viewer = await Viewer.open(browser, world.url, { hash: hash.replace(/,of:1/, '') });
  await viewer.drop(place('ball.csv'));
  await isTrue();
});

test('a surface that the stream lacks is requested alone', async () => {
  mkdirSync(place('balls'));
  const rows = readFileSync(place('ball.csv'), 'utf8').split('\n');
  for (const share of [1, 2]) {
    writeFileSync(place(`balls/b_${share}.csv`), rows.filter((row, k) => k === 0 || share === 2 || row.split(',')[1] === '1').join('\n'));
  }
  const truth = await world.statistics(place('balls'), '--surface', '--spacing', '0.1');
  viewer = await Viewer.open(browser, world.url);
  await viewer.page.routeWebSocket(/v1\/reconstruct/, (socket) => {
    let frames = 0;
    socket.connectToServer().onMessage((message) => {
      if (message.length < 5000 || ++frames === 1) socket.send(message);
    });
  });
  await viewer.page.reload();
  await viewer.drop(place('balls'));
  await until('the question', async () => /is 3D/.test(await errorOf('slice').textContent()));
  await viewer.button('Open as a surface').click();
  // The file plays to its last frame.
  const volume = Number(truth[1].volume.toPrecision(7));
  await until('the last frame', async () => await viewer.value('frame') === '1' && Number(await viewer.value('volume')) === volume);
  assert.match(await viewer.pane().locator('header').textContent(), /this frame alone/);
  assert.ok(await viewer.pane().locator('.space canvas').isVisible());
});

test('a surface needs three coordinates and a spacing', async () => {
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('flat.csv'));
  await viewer.allFrames();
  assert.ok(await viewer.button('Open as a surface').isHidden());
  await viewer.page.evaluate(() => { location.hash = '#file=ball.csv&open=slice:surface'; });
  await viewer.drop(place('ball.csv'));
  await until('the error', async () => /Surfaces need the spacing/.test(await errorOf('spacing').textContent()));
});

test('a wrong option is reported beside its field', async () => {
  const [left] = await world.statistics(place('flat.csv'), '--select', 'type=1', '--spacing', '0.1');
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('flat.csv'));
  await viewer.allFrames();
  const whole = await viewer.value('rings-digest');
  await viewer.page.getByText('Options of flat.csv').click();
  assert.deepEqual(await viewer.page.locator('#file-filters option').evaluateAll((all) => all.map(({ value }) => value)),
    ['type=1', 'type=2']);
  await field('Spacing').fill('wide');
  await submit();
  await until('the error', async () => /positive length/.test(await errorOf('spacing').textContent()));
  assert.equal(await viewer.value('rings-digest'), whole, 'the picture stays');
  await field('Spacing').fill('0.1');
  await field('Filter').fill('type=9');
  await submit();
  await until('the error', async () => /No particle .*type=9/.test(await errorOf('select').textContent()));
  assert.equal(await errorOf('spacing').isVisible(), false);
  await field('Filter').fill('type=1');
  await submit();
  await shows(left.rings_digest);
  assert.equal(await viewer.page.locator('.pane').count(), 1);
  assert.equal(await viewer.page.locator('#closed').isVisible(), false, 'the file was not closed');
});

test('columns of unknown names are asked for', async () => {
  const [truth] = await world.statistics(place('odd.csv'), '--columns', 'east,north');
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('odd.csv'));
  await until('the question', async () => /No position columns in id, type, east, north/.test(await errorOf('columns').textContent()));
  await field('Columns').fill('east,north');
  await submit();
  await shows(truth.rings_digest);
});

test('a truncated recording says how many frames are whole', async () => {
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('cut.pemc'));
  await viewer.shows();
  const notice = viewer.pane().locator('.notice');
  await until('the notice', async () => /cut\.pemc is truncated\. Its first \d+ frames are whole/.test(await notice.textContent()));
  const count = Number((await notice.textContent()).match(/first (\d+) frames/)[1]);
  assert.equal(await viewer.page.locator('#position').textContent().then((text) => Number(text.split(' of ')[1])), count - 1);
  await shot('file_truncated');
  await viewer.button('Hide notice').click();
  await until('it is hidden', async () => !await notice.isVisible());
  assert.match(await viewer.status(), /truncated/);
});

test('a closed file can be opened again', async () => {
  viewer = await Viewer.open(browser, world.url);
  await viewer.drop(place('flat.csv'));
  await viewer.allFrames();
  const digest = await viewer.value('rings-digest');
  await viewer.drop(recording);
  await until('the recording', async () => /75|74/.test(await viewer.page.locator('#position').textContent()));
  await viewer.allFrames();
  await viewer.scrubTo(20, 19);
  await viewer.page.locator('#closed-files').getByRole('button', { name: 'flat.csv' }).click();
  await shows(digest);
  assert.equal(await viewer.page.locator('#closed-files button').count(), 1, 'the recording is closed now');
  await shot('file_closed');
  await viewer.page.locator('#closed-files button').click();
  await until('its frame', async () => await viewer.value('frame') === '19');
});
