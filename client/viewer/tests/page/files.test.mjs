// Dropped files.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { before, test } from 'node:test';
import { cleansUp, launch, recording, until, Viewer, World } from './support.mjs';

const FRAMES = 12;
let world, browser, viewer, folder;

/** Two approaching drops of particles. */
function drops(frame) {
  const lines = ['id,x,y,pressure'];
  const spacing = 0.05;
  let id = 0;
  for (let i = -8; i <= 8; ++i) {
    for (let j = -8; j <= 8; ++j) {
      if (i * i + j * j > 64) continue;
      for (const side of [-1, 1]) {
        const x = i * spacing + side * (0.7 - 0.02 * frame);
        lines.push([++id, x, j * spacing + 0.3, (j + 8 + frame) / 10].join(','));
      }
    }
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  world = await World.start();
  browser = await launch();
  folder = path.join(world.folder, 'drops');
  mkdirSync(folder);
  const times = ['frame,t'];
  for (let k = 0; k < FRAMES; ++k) {
    writeFileSync(path.join(folder, `drops_${k}.csv`), drops(k));
    times.push(`${k},${k * 0.25}`);
  }
  writeFileSync(path.join(folder, 'times.csv'), `${times.join('\n')}\n`);
});
cleansUp(() => ({ world, browser, viewer }));

const drop = (...paths) => viewer.drop(...paths);

const isAll = () => until('all frames are here', async () => await viewer.status() === 'All frames received');

test('a CSV folder has the numbers of the command line', async () => {
  const truth = await world.statistics(folder, '--attributes', 'pressure');
  viewer = await Viewer.open(browser, world.url);
  await drop(folder);
  await viewer.shows();
  await isAll();
  for (const sequence of [1, 6, FRAMES]) {
    await viewer.scrubTo(sequence, sequence - 1);
    const row = truth[sequence - 1];
    const numbers = await viewer.numbers();
    assert.equal(numbers['rings-digest'], row.rings_digest);
    assert.equal(numbers['mesh-digest'], row.mesh_digest);
    assert.equal(Number(numbers.time), row.time);
  }
  const { capabilities } = await world.information();
  const colours = await viewer.page.getByLabel('Colour', { exact: true }).locator('option').allTextContents();
  assert.equal(colours.includes('by pressure'), capabilities.includes('attributes'));
});

test('files play to the end, and again on request', async () => {
  viewer = await Viewer.open(browser, world.url);
  await drop(folder);
  await until('the end', async () => await viewer.frame() === FRAMES - 1 && await viewer.button('Play').count() === 1);
  await viewer.page.locator('#speed').selectOption('0.1');
  await viewer.button('Play').click();
  await until('anew', async () => await viewer.frame() < FRAMES - 1);
});

test('another placement streams the files again', async () => {
  const truth = await world.statistics(folder, '--placement', 'qef', '--fill', 'conforming');
  viewer = await Viewer.open(browser, world.url);
  await drop(folder);
  await isAll();
  await viewer.scrubTo(7, 6);
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('qef');
  await viewer.page.getByLabel('Fill', { exact: true }).selectOption('conforming');
  await until('the numbers are those of qef', async () =>
    await viewer.value('rings-digest') === truth[6].rings_digest &&
    await viewer.value('mesh-digest') === truth[6].mesh_digest);
  assert.equal(await viewer.frame(), 6);
});

test('two settings of files are compared side by side', async () => {
  viewer = await Viewer.open(browser, world.url);
  await drop(folder);
  await isAll();
  await viewer.scrubTo(3, 2);
  await viewer.button('Side by side').click();
  await viewer.page.getByLabel('Particles used').selectOption('50');
  await until('half of the particles', async () => {
    const [all, half] = await Promise.all([0, 1].map(async (k) => Number(await viewer.value('particles', k))));
    return half > 0.3 * all && half < 0.7 * all;
  });
  assert.equal(await viewer.frame(0), await viewer.frame(1));
});

test('a recording plays, and its particles are drawn', async () => {
  const truth = await world.statistics(recording);
  viewer = await Viewer.open(browser, world.url);
  await drop(recording);
  await isAll();
  await viewer.scrubTo(75, 74);
  assert.equal(await viewer.value('rings-digest'), truth[74].rings_digest);
  const before = await viewer.picture();
  await viewer.page.getByLabel('Particles', { exact: true }).check();
  await until('particles are drawn', async () => await viewer.picture() !== before);
});

test('a LAMMPS dump with image flags plays in its steps', async () => {
  const dump = path.join(world.folder, 'dump.lammpstrj');
  const frames = Array.from({ length: 3 }, (_, k) => {
    const rows = drops(k).trim().split('\n').slice(1).map((row) => {
      const [id, x, y] = row.split(',').map(Number);
      const [i, j] = [Math.floor(x / 4), Math.floor(y / 4)];
      return [id, x - 4 * i, y - 4 * j, i, j].join(' ');
    });
    return ['ITEM: TIMESTEP', k * 100, 'ITEM: NUMBER OF ATOMS', rows.length,
      'ITEM: BOX BOUNDS pp pp pp', '0 4', '0 4', '-0.1 0.1', 'ITEM: ATOMS id x y ix iy', ...rows].join('\n');
  });
  writeFileSync(dump, `${frames.join('\n')}\n`);
  const truth = await world.statistics(dump);
  viewer = await Viewer.open(browser, world.url);
  await drop(dump);
  await isAll();
  await viewer.scrubTo(3, 2);
  assert.equal(await viewer.value('rings-digest'), truth[2].rings_digest);
  assert.equal(await viewer.value('time'), '200');
});

test('a frame has the number of the command line, at the slider too', async () => {
  const truth = await world.statistics(folder);
  viewer = await Viewer.open(browser, world.url);
  await drop(folder);
  await isAll();
  await viewer.scrubTo(5, 4);
  assert.equal(truth[4].frame, 4);
  assert.equal(await viewer.value('rings-digest'), truth[4].rings_digest);
  assert.equal(await viewer.page.locator('#position').textContent(), `4 of ${FRAMES - 1}`);
});

test('a link to a file shows it once it is opened', async () => {
  viewer = await Viewer.open(browser, world.url);
  await drop(recording);
  await isAll();
  await viewer.scrubTo(31, 30);
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('qef');
  await until('qef', async () => await viewer.value('placement') === 'qef' && await viewer.frame() === 30);
  const { hash } = new URL(viewer.page.url());
  const digest = await until('its digest', async () => {
    const text = await viewer.value('rings-digest');
    return text !== '–' && text;
  });
  assert.match(hash, /^#file=.*&frame=30&.*set=placement:qef/);
  const other = await Viewer.open(browser, world.url, { hash });
  await until('the page asks for the file', async () => /This link shows the file .*Open it here/.test(await other.status()));
  assert.equal(new URL(other.page.url()).hash, hash);
  const first = viewer;
  viewer = other;
  await drop(recording);
  await until('the same frame', async () => await other.value('rings-digest') === digest);
  assert.equal(await other.frame(), 30);
  assert.equal(new URL(other.page.url()).hash, hash);
  await first.close();
});

test('unreadable files are reported', async () => {
  const bad = path.join(world.folder, 'water.ply');
  writeFileSync(bad, 'ply\n');
  viewer = await Viewer.open(browser, world.url);
  await drop(bad);
  await until('it is told', async () => /water\.ply is a PLY file.*convert/.test(await viewer.status()));
  const broken = path.join(world.folder, 'broken.csv');
  writeFileSync(broken, 'x,y\n1,2\n3\n');
  await drop(broken);
  await until('the line is told', async () => /broken\.csv, line 3/.test(await viewer.status()));
});
