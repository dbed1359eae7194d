// Tests of a live stream in the page: history, pause, settings, export.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { cleansUp, launch, recording, until, Viewer, World } from './support.mjs';

let world, browser, viewer, truth;

before(async () => {
  // The server's history holds about a minute of the stream. Each page fetches it when it opens.
  world = await World.start('--history-bytes', '24MiB');
  browser = await launch();
  truth = await world.statistics(recording);
  world.loop('dam');
});
cleansUp(() => ({ world, browser, viewer }));

const open = async (hash = '#stream=dam') => { viewer = await Viewer.open(browser, world.url, { hash }); };

let streams = 0;
/** Opens the page with a new stream, whose first 75 frames are the recording. */
async function openNew() {
  const name = `dam_${++streams}`;
  const producer = world.loop(name);
  await open(`#stream=${name}`);
  await viewer.shows();
  const slider = viewer.page.getByLabel('Frame', { exact: true });
  await until('all of the recording', async () => Number(await slider.getAttribute('max')) >= 75);
  await until('the history', async () => await slider.getAttribute('min') === '1');
  return producer;
}

/** Compares the page's numbers of a frame with the command line's. */
async function agrees(sequence) {
  const row = truth[sequence - 1];
  const numbers = await viewer.numbers();
  assert.equal(numbers.frame, String(sequence));
  assert.equal(numbers['rings-digest'], row.rings_digest);
  assert.equal(numbers['mesh-digest'], row.mesh_digest);
  assert.equal(numbers.triangles, row.triangles.toLocaleString('en'));
  assert.equal(numbers.grid, row.triangles_grid.toLocaleString('en'));
  assert.equal(numbers.particles, row.particles.toLocaleString('en'));
  assert.equal(Number(numbers.area), Number(row.area.toPrecision(7)));
  assert.equal(Number(numbers.perimeter), Number(row.perimeter.toPrecision(7)));
}

test('the only stream is shown at once and moves', async () => {
  await open('');
  const first = await viewer.shows();
  const picture = await viewer.picture();
  await viewer.shows(first + 10);
  assert.notEqual(await viewer.picture(), picture);
  assert.equal(await viewer.status(), 'Live');
  assert.equal(await viewer.button('Live').getAttribute('aria-pressed'), 'true');
});

test('a late viewer can go back to the first frame', async () => {
  const producer = await openNew();
  for (const sequence of [1, 40, 75]) {
    await viewer.scrubTo(sequence);
    await agrees(sequence);
  }
  await producer.stop();
});

test('a paused stream resumes at its frame and catches up', async () => {
  await open();
  await viewer.shows(20);
  const at = await viewer.pause();
  const picture = await viewer.picture();
  const last = viewer.page.locator('#position');
  await until('the stream goes on behind', async () =>
    Number((await last.textContent()).split(' of ')[1]) > at + 30);
  assert.equal(await viewer.frame(), at);
  assert.equal(await viewer.picture(), picture);
  const seen = watchFrames();
  await viewer.button('Play').click();
  await viewer.shows(at + 15);
  const frames = (await seen).filter((frame) => frame > at);
  assert.ok(frames[0] <= at + 10, `goes on from ${at} and not from ${frames[0]}`);
  await viewer.button('Live').click();
  await until('the newest is followed', async () => {
    const [place, newest] = (await last.textContent()).split(' of ').map(Number);
    return newest - place < 15;
  });
});

/** The next eight frames shown. */
function watchFrames() {
  return viewer.page.evaluate(() => new Promise((resolve) => {
    const cell = document.querySelector('[data-key="frame"]');
    const seen = [];
    const observer = new MutationObserver(() => {
      seen.push(Number(cell.textContent));
      if (seen.length < 8) return;
      observer.disconnect();
      resolve(seen);
    });
    observer.observe(cell, { childList: true, characterData: true, subtree: true });
  }));
}

test('numbers follow ten times a second, and at once in a pause', async () => {
  await open();
  await viewer.shows(20);
  const { changes, shown, place } = await viewer.page.evaluate(async () => {
    const cell = document.querySelector('[data-key="frame"]');
    let changes = 0;
    const observer = new MutationObserver(() => { ++changes; });
    observer.observe(cell, { childList: true, characterData: true, subtree: true });
    await new Promise((over) => { setTimeout(over, 2000); });
    observer.disconnect();
    document.querySelector('#play').click();
    return { changes, shown: cell.textContent, place: document.querySelector('#position').textContent };
  });
  assert.ok(changes > 0 && changes <= 21, `${changes} changes in 2 s`);
  assert.equal(place.split(' of ')[0], shown);
  assert.equal(await viewer.value('frame'), shown);
});

test('buttons and keys step by one frame', async () => {
  await open();
  await viewer.shows(20);
  const at = await viewer.pause();
  await viewer.reaches(at - 2);
  await viewer.button('Previous frame').click();
  const back = await until('one back', async () => await viewer.frame() < at && viewer.frame());
  assert.ok(back >= at - 2, `from ${at} to ${back}: one frame, or two if the server dropped one`);
  await viewer.button('Next frame').click();
  await until('one forward', async () => await viewer.frame() === at);
  await viewer.page.locator('canvas').first().focus();
  await viewer.page.keyboard.press(',');
  await until('one back by key', async () => await viewer.frame() === back);
});

test('every setting changes picture and numbers', async () => {
  const producer = await openNew();
  await viewer.scrubTo(60);
  await viewer.page.getByLabel('Mesh edges').check();
  const set = async (label, value) => {
    const control = viewer.page.getByLabel(label, { exact: true });
    if (await control.evaluate((element) => element.tagName) === 'SELECT') await control.selectOption(value);
    else {
      await control.fill(value);
      await control.blur();
    }
  };
  const digests = async () => {
    const { 'rings-digest': rings, 'mesh-digest': mesh } = await viewer.numbers();
    return `${rings} ${mesh}`;
  };
  const seen = new Set([await digests()]);
  const pictures = new Set([await viewer.picture()]);
  const changes = async (what) => {
    await until(`${what} changes the numbers`, async () => !seen.has(await digests()));
    seen.add(await digests());
    await until(`${what} changes the picture`, async () => !pictures.has(await viewer.picture()));
    pictures.add(await viewer.picture());
  };
  const switches = [
    ['Placement', 'qef'], ['Placement', 'marching-squares'], ['Placement', 'farthest-particle'],
    ['Surface offset', '0.5'], ['Fill', 'grid'], ['Fill', 'conforming'], ['Fill', 'polygon'],
    ['Fill', 'none'], ['Kernel radius', '4'], ['Reference radius', '1.2'], ['Cell size', '1.5'],
    ['Particles used', '80'], ['Particles used', '50'], ['Particles used', '30'],
  ];
  for (const [label, value] of switches) {
    await set(label, value);
    await changes(`${label} ${value}`);
  }
  assert.ok(Number((await viewer.value('particles')).replace(',', '')) < 1000);
  await viewer.button('As streamed').click();
  await until('as it was', async () => await viewer.value('rings-digest') === truth[59].rings_digest);
  await producer.stop();
});

test('two placements are compared side by side', async () => {
  await open();
  await viewer.shows(20);
  const at = await viewer.pause();
  await viewer.button('Side by side').click();
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('marching-squares');
  await viewer.page.getByLabel('Fill', { exact: true }).selectOption('grid');
  await until('both are shown', async () =>
    await viewer.frame(0) === at && await viewer.frame(1) === at &&
    await viewer.value('placement', 1) === 'marching-squares' &&
    await viewer.value('fill', 1) === 'grid');
  const [left, right] = [await viewer.numbers(0), await viewer.numbers(1)];
  assert.equal(left.placement, 'virtual-plane');
  assert.notEqual(left['rings-digest'], right['rings-digest']);
  assert.equal(right.triangles, right.grid, 'fill grid merges nothing');
  assert.notEqual(left.triangles, right.triangles);
  assert.ok(Number(left.area) > 0 && Number(right.area) > 0);
  assert.notEqual(await viewer.picture(0), await viewer.picture(1));
  // The captions show the numbers of the chosen picture. They name the settings of the curve if these
  // differ.
  const caption = viewer.page.locator('#curves figcaption').first();
  await until('the caption has the area of picture 2', async () =>
    await caption.textContent() === `Area ${right.area} (dashed: as streamed)`);
  await viewer.pane(0).locator('canvas').focus();
  await until('the caption has the area of picture 1', async () => await caption.textContent() === `Area ${left.area}`);
  await viewer.button('Close picture 2').click();
  assert.equal(await viewer.page.locator('.pane').count(), 1);
});

test('a link shows the same frame, view and settings', async () => {
  const producer = await openNew();
  await viewer.button('Pause').click();
  await viewer.page.getByLabel('Placement', { exact: true }).selectOption('qef');
  await viewer.page.locator('canvas').first().focus();
  await viewer.page.keyboard.press('+');
  await until('settings are shown', async () => await viewer.value('placement') === 'qef');
  const digest = async (of) => (await of.numbers())['rings-digest'];
  const first = await until('the picture is there', async () => {
    const before = await digest(viewer);
    return before === await digest(viewer) && before;
  });
  const hash = new URL(viewer.page.url()).hash;
  const other = await Viewer.open(browser, world.url, { hash });
  await until('the link shows the same', async () =>
    await other.frame() === await viewer.frame() && await digest(other) === first);
  assert.equal(new URL(other.page.url()).hash, hash);
  await other.close();
  await producer.stop();
});

test('the readout shows the ring; a click selects it', async () => {
  await open();
  await viewer.shows(5);
  await viewer.button('Pause').click();
  const canvas = viewer.page.locator('canvas').first();
  await canvas.focus();
  const box = await canvas.boundingBox();
  const readout = viewer.pane().locator('.readout');
  const found = await until('a ring is under the pointer', async () => {
    for (let y = 0.9; y > 0.3; y -= 0.1) {
      for (let x = 0.35; x < 0.7; x += 0.05) {
        await viewer.page.mouse.move(box.x + x * box.width, box.y + y * box.height);
        await viewer.page.waitForTimeout(30);
        if (/ring \d+: area .* perimeter .* particles/.test(await readout.textContent())) return true;
      }
    }
    return false;
  });
  assert.ok(found);
  await viewer.page.mouse.down();
  await viewer.page.mouse.up();
  await until('it is selected', async () => (await readout.textContent()).includes('Selected: ring'));
  await viewer.button('Play').click();
  const at = await viewer.frame();
  await viewer.shows(at + 5);
  assert.match(await readout.textContent(), /Selected: (ring|hole) \d+: area/);
  await canvas.focus();
  await viewer.page.keyboard.press('Escape');
  await until('none is selected', async () => !(await readout.textContent()).includes('Selected'));
});

test('a click in a curve goes to that moment', async () => {
  await open();
  await viewer.shows(60);
  const plot = viewer.page.locator('.curve .u-over').first();
  const box = await plot.boundingBox();
  await viewer.page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  await until('it stands in the middle', async () => {
    const [place, newest] = (await viewer.page.locator('#position').textContent()).split(' of ').map(Number);
    const shown = await viewer.frame();
    return await viewer.button('Play').count() === 1 && shown === place && newest - place > 20;
  });
});

test('the curves are exported as CSV', async () => {
  const producer = await openNew();
  await viewer.button('Pause').click();
  const [download] = await Promise.all([
    viewer.page.waitForEvent('download'), viewer.button('CSV of curves').click()]);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  const [head, ...rows] = Buffer.concat(chunks).toString().trimEnd().split('\n').map((row) => row.split(','));
  const area = head.indexOf('area');
  const row = rows.find(([frame]) => frame === '40');
  assert.ok(Math.abs(Number(row[area]) - truth[39].area) < 1e-9);
  await producer.stop();
});

test('the picture is exported as PNG, SVG and GeoJSON', async () => {
  await open();
  await viewer.shows(20);
  await viewer.button('Pause').click();
  const saved = async (name) => {
    const [download] = await Promise.all([viewer.page.waitForEvent('download'), viewer.button(name).click()]);
    const chunks = [];
    for await (const chunk of await download.createReadStream()) chunks.push(chunk);
    return { name: download.suggestedFilename(), bytes: Buffer.concat(chunks) };
  };
  const at = await viewer.frame();
  const png = await saved('PNG');
  assert.equal(png.name, `dam_${at}.png`);
  assert.equal(png.bytes.subarray(1, 4).toString(), 'PNG');
  const svg = await saved('SVG');
  assert.match(svg.bytes.toString(), /^(<\?xml[^>]*>\s*)?<svg[\s\S]*<path/);
  const { features } = JSON.parse((await saved('GeoJSON')).bytes.toString());
  const area = features.reduce((sum, { properties }) => sum + properties.area, 0);
  assert.ok(features.length > 0);
  assert.ok(Math.abs(area - Number(await viewer.value('area'))) < 0.2, `${area}`);
});

test('a clip is recorded', async () => {
  await open();
  await viewer.shows(5);
  await viewer.button('Record clip').click();
  await viewer.shows(await viewer.frame() + 20);
  const [download] = await Promise.all([
    viewer.page.waitForEvent('download'), viewer.button('Stop and save').click()]);
  assert.match(download.suggestedFilename(), /\.webm$/);
  const chunks = [];
  for await (const chunk of await download.createReadStream()) chunks.push(chunk);
  const bytes = Buffer.concat(chunks);
  assert.equal(bytes.readUInt32BE(0), 0x1a45dfa3, 'the magic number of EBML');
  assert.ok(bytes.length > 5000, `${bytes.length} bytes`);
});

test('a clip is saved after its picture was closed', async () => {
  await open();
  await viewer.shows(5);
  await viewer.button('Side by side').click();
  await until('both are shown', async () => await viewer.frame(1) > 0);
  await viewer.button('Record clip').click();
  await until('it records', async () => await viewer.button('Stop and save').count() === 1);
  await viewer.button('Close picture 2').click();
  const [download] = await Promise.all([
    viewer.page.waitForEvent('download'), viewer.button('Stop and save').click()]);
  assert.match(download.suggestedFilename(), /\.webm$/);
  await until('it can record again', async () => await viewer.button('Record clip').count() === 1);
});
