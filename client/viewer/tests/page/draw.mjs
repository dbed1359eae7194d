// Draws known frames in Chromium with software rendering, and checks the pixels. Then reports how long
// the main thread takes to decode, show and draw a mesh of 100,000 vertices. Build the page first.
//   node tests/page/draw.mjs [--frames N] [--pictures DIR]
// CHROMIUM names another browser than /usr/bin/chromium.
import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { build } from 'esbuild';
import { chromium } from 'playwright-core';
import { CHROMIUM_FLAGS } from './support.mjs';

const here = path.dirname(fileURLToPath(import.meta.url));
const { values: options } = parseArgs({
  options: { frames: { type: 'string', default: '1000' }, pictures: { type: 'string' } },
});
const [WIDTH, HEIGHT] = [900, 600];

/** Positions in the default frame of `makeFrame`. */
const IN_BODY = [10.1, 4.9];
const IN_HOLE = [5.1, 4.6];
const IN_DROP = [13.3, 8.3];
const OUTSIDE = [12.6, 5.2];

let folder;
let browser;
const errors = [];

before(async () => {
  folder = mkdtempSync(path.join(tmpdir(), 'viewer-draw-'));
  await build({
    entryPoints: [path.join(here, 'draw_entry.ts')],
    outfile: path.join(folder, 'entry.js'),
    bundle: true,
    format: 'iife',
    target: 'es2022',
    tsconfig: path.join(here, '../../tsconfig.json'),
    logLevel: 'warning',
  });
  writeFileSync(path.join(folder, 'index.html'), `<!doctype html><meta charset="utf-8">
    <style>body { margin: 0 } canvas { display: block; width: 100vw; height: 100vh }</style>
    <canvas tabindex="0"></canvas><script src="entry.js"></script>`);
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: CHROMIUM_FLAGS,
  });
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
  assert.deepEqual(errors, [], 'errors in the console');
});

/** Opens a page with `bench` of draw_entry.ts for the duration of `work`. */
async function inPage(work, ratio = 1) {
  const page = await browser.newPage({
    viewport: { width: WIDTH, height: HEIGHT }, deviceScaleFactor: ratio,
  });
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => {
    if (message.type() === 'error') errors.push(message.text());
  });
  await page.goto(pathToFileURL(path.join(folder, 'index.html')).href);
  try {
    await work(page);
  } finally {
    await page.close();
  }
}

/** Colours at positions in one look; `lacking`: parts to remove from the frame. */
function coloursOf(page, look, places, lacking = []) {
  return page.evaluate(([one, at, without]) => {
    const frame = bench.makeFrame();
    for (const part of without) frame[part] = null;
    bench.picture(one, frame);
    return bench.coloursAt(at);
  }, [look, places, lacking]);
}

function themeOf(page, dark) {
  return page.evaluate((one) => Object.fromEntries(Object.entries(bench.theme(one))
    .map(([name, colour]) => [name, colour.map((part) => Math.round(255 * part))])), dark);
}

function assertNear(actual, expected, tolerance, what) {
  actual.forEach((part, k) => assert.ok(
    Math.abs(part - expected[k]) <= tolerance, `${what}: ${actual} and not ${expected}`));
}

test('parts have their colours in dark and light', () =>
  inPage(async (page) => {
    for (const dark of [false, true]) {
      const theme = await themeOf(page, dark);
      const { line, band } = await page.evaluate(() => {
        const { rings, mesh } = bench.makeFrame();
        const k = rings.offsets[rings.outerOf.indexOf(0xffffffff)];
        // The centre of the largest boundary triangle (class 0), which lies in the band along the
        // outline.
        let best = { area: 0, place: [0, 0] };
        for (let t = 0; t < mesh.classes.length; ++t) {
          if (mesh.classes[t] !== 0) continue;
          const [a, b, c] = [0, 1, 2].map((corner) => 2 * mesh.triangles[3 * t + corner]);
          const p = mesh.points;
          const area = (p[b] - p[a]) * (p[c + 1] - p[a + 1]) -
            (p[b + 1] - p[a + 1]) * (p[c] - p[a]);
          const place = [(p[a] + p[b] + p[c]) / 3, (p[a + 1] + p[b + 1] + p[c + 1]) / 3];
          if (area > best.area) best = { area, place };
        }
        return { line: [rings.points[2 * k], rings.points[2 * k + 1]], band: best.place };
      });
      const colours = await coloursOf(page, { dark, lineWidth: 3 },
        [IN_BODY, band, line, IN_HOLE, OUTSIDE]);
      const expected = [theme.interior, theme.band, theme.outline, theme.background,
        theme.background];
      colours.forEach((colour, k) => assertNear(colour, expected[k], 2, `place ${k}, ${dark}`));
    }
  }));

test('rings without a mesh are filled, holes are not', () => inPage(async (page) => {
  const theme = await themeOf(page, false);
  const colours = await coloursOf(page, {}, [IN_BODY, IN_HOLE, IN_DROP, OUTSIDE], ['mesh']);
  [theme.band, theme.background, theme.band, theme.background].forEach((expected, k) =>
    assertNear(colours[k], expected, 2, `place ${k}`));
}));

test('identities differ in hue', () => inPage(async (page) => {
  const [body, elsewhere, drop, hole] = await coloursOf(
    page, { colour: 'identity' }, [IN_BODY, [8.1, 2.6], [2.2, 9.3], IN_HOLE]);
  assert.deepEqual(body, elsewhere);
  assert.ok(Math.hypot(...body.map((part, k) => part - drop[k])) > 20, `${body} ${drop}`);
  assertNear(hole, (await themeOf(page, false)).background, 2, 'hole');
}));

test('the alignment of arrays does not change the picture', () =>
  inPage(async (page) => {
    const differing = await page.evaluate(() => {
      const look = { edges: true, colour: 'identity' };
      bench.picture(look);
      const expected = bench.pixels();
      return [0, 1, 2, 3].filter((shift) => {
        bench.picture(look, bench.sent(bench.makeFrame(), shift));
        return bench.pixels().some((part, k) => part !== expected[k]);
      });
    });
    assert.deepEqual(differing, []);
  }));

for (const ratio of [1, 2]) {
  test(`line width in device pixels at ratio ${ratio}`, () =>
    inPage(async (page) => {
      for (const lineWidth of [0.5, 1, 2, 3.5]) {
        const { ink, expected } = await page.evaluate((width) => {
          const frame = bench.polygon([[0, 0], [10, 1], [11, 7], [-1, 6]]);
          bench.picture({ fill: false, lineWidth: width }, frame);
          const colour = bench.theme(false).outline.map((part) => 255 * part);
          const length = frame.rings.perimeter[0] * bench.scene.view.scale * devicePixelRatio;
          return { ink: bench.ink(colour), expected: length * width * devicePixelRatio };
        }, lineWidth);
        assert.ok(Math.abs(ink / expected - 1) < 0.03, `${lineWidth}: ${ink} of ${expected}`);
      }
    }, ratio));
}

test('dense vertices do not cover a pixel twice', () => inPage(async (page) => {
  const { ink, expected } = await page.evaluate(() => {
    const corners = Array.from({ length: 40000 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 40000;
      return [5 * Math.cos(angle), 5 * Math.sin(angle)];
    });
    const frame = bench.polygon(corners);
    bench.picture({ fill: false, lineWidth: 2 }, frame);
    const colour = bench.theme(false).outline.map((part) => 255 * part);
    const radius = 5 * bench.scene.view.scale;
    return { ink: bench.ink(colour), expected: 2 * Math.PI * radius * 2 };
  });
  assert.ok(Math.abs(ink / expected - 1) < 0.03, `${ink} of ${expected}`);
}));

test('an attribute colours the outline over its legend', () =>
  inPage(async (page) => {
    const { colours, legend, stops } = await page.evaluate(() => {
      const frame = bench.polygon([[0, 0], [10, 0], [10, 6], [0, 6]]);
      frame.rings.attributes.set('speed', Float32Array.of(-2, -2, 5, 5));
      bench.picture({ fill: false, colour: 'speed', lineWidth: 6 }, frame);
      return {
        colours: bench.coloursAt([[5, 0], [5, 6], [10, 3]]),
        legend: bench.scene.legend(),
        stops: bench.rampStops({ dark: false, map: 'violet-yellow' }).map((stop) => bench.rgb(stop).map((part) => 255 * part)),
      };
    });
    assert.equal(legend.min, -2);
    assert.equal(legend.max, 5);
    assertNear(colours[0], stops[0], 3, 'smallest');
    assertNear(colours[1], stops[stops.length - 1], 3, 'largest');
    assertNear(colours[2], stops[(stops.length - 1) / 2], 6, 'middle');
  }));

test('an attribute colours particles, in the map and range of the look', () =>
  inPage(async (page) => {
    const { colours, stops, ground } = await page.evaluate(() => {
      const frame = bench.polygon([[0, 0], [10, 0], [10, 6], [0, 6]]);
      frame.particles = Float32Array.of(3, 3, 5, 3, 7, 3);
      frame.particleAttributes = new Map([['speed', Float32Array.of(-9, 1, 40)]]);
      const look = { fill: false, outline: false, particles: true, colour: 'speed', map: 'blue-red', from: 0, to: 2 };
      bench.picture(look, frame);
      return {
        colours: bench.coloursAt([[3, 3], [5, 3], [7, 3], [9, 3]]),
        stops: bench.rampStops({ dark: false, map: 'blue-red' }).map((stop) => bench.rgb(stop).map((part) => 255 * part)),
        ground: bench.theme(false).background.map((part) => 255 * part),
      };
    });
    // Dots cover 85 % of the background.
    const dot = (colour) => colour.map((part, k) => 0.85 * part + 0.15 * ground[k]);
    assertNear(colours[0], dot(stops[0]), 6, 'below the range');
    assertNear(colours[1], dot(stops[(stops.length - 1) / 2]), 6, 'middle');
    assertNear(colours[2], dot(stops[stops.length - 1]), 6, 'above the range');
    assertNear(colours[3], ground, 2, 'no particle');
  }));

test('particles with own sizes are as large as they are', () =>
  inPage(async (page) => {
    const { grains, dots, ground } = await page.evaluate(() => {
      const frame = bench.polygon([[0, 0], [10, 0], [10, 6], [0, 6]]);
      frame.particles = Float32Array.of(2, 3, 7, 3);
      const look = { fill: false, outline: false, particles: true };
      const places = [[2, 3], [2.4, 3], [2.7, 3], [7, 3], [8.2, 3], [8.7, 3]];
      const diameters = Float32Array.of(1, 3);
      const drawn = (areDiscs) => {
        bench.picture(look, { ...frame, particleSizes: { diameters, areDiscs } });
        return bench.coloursAt(places);
      };
      return { grains: drawn(true), dots: drawn(false), ground: bench.theme(false).background.map((part) => 255 * part) };
    });
    const isDrawn = (colours) => colours.map((colour) => Math.max(...colour.map((part, k) => Math.abs(part - ground[k]))) > 20);
    assert.deepEqual(isDrawn(grains), [true, true, false, true, true, false], 'discs of the diameters 1 and 3');
    assert.deepEqual(isDrawn(dots), [true, false, false, true, false, false], 'dots of .4 times the diameters');
  }));

test('isolines have their colours and their own origin', () =>
  inPage(async (page) => {
    const { colours, background } = await page.evaluate(() => {
      const frame = bench.polygon([[0, 0], [10, 0], [10, 6], [0, 6]]);
      const { rings } = bench.polygon([[1, 1], [3, 1], [3, 5], [1, 5]]);
      frame.isolines = [{ index: 1, rings, origin: [0, 0] }, { index: 2, rings, origin: [5, 0] }];
      const shown = (look) => {
        bench.picture({ fill: false, outline: false, ...look }, frame);
        // The darkest pixel across each line.
        return [[1, 3], [6, 3]].map(([x, y]) => {
          const across = bench.coloursAt([-0.02, -0.01, 0, 0.01, 0.02].map((off) => [x + off, y]));
          return across.reduce((a, b) => (a[0] + a[1] + a[2] < b[0] + b[1] + b[2] ? a : b));
        });
      };
      return {
        colours: [shown({}), shown({ hidden: [1] }), shown({ sections: false })],
        background: bench.theme(false).background.map((part) => 255 * part),
      };
    });
    const isLine = (colour) => Math.max(...colour.map((part, k) => Math.abs(part - background[k]))) > 60;
    assert.deepEqual(colours.map((pair) => pair.map(isLine)), [[true, true], [false, true], [false, false]]);
    assert.notDeepEqual(colours[0][0], colours[0][1], 'colours differ');
  }));

test('particles, normals and edges add to the picture', () => inPage(async (page) => {
  const covered = (look) => page.evaluate((one) => {
    bench.picture({ fill: false, outline: false, ...one });
    const background = bench.theme(false).background.map((part) => Math.round(255 * part));
    const read = bench.pixels();
    let count = 0;
    for (let k = 0; k < read.length; k += 4) if (read[k] < background[0] - 30) ++count;
    return count;
  }, look);
  assert.equal(await covered({}), 0);
  for (const part of ['particles', 'normals', 'edges']) {
    assert.ok(await covered({ [part]: true }) > 2000, part);
  }
}));

test('only the selected ring is highlighted', () => inPage(async (page) => {
  const { accent } = await themeOf(page, false);
  const { before: plain, after: marked, rings } = await page.evaluate(() => {
    const { rings: { points, offsets, identities } } = bench.makeFrame();
    const places = [0, 1].map((ring) => [points[2 * offsets[ring]], points[2 * offsets[ring] + 1]]);
    bench.picture({});
    const first = bench.coloursAt(places);
    bench.scene.select(identities[1]);
    return { before: first, after: bench.coloursAt(places), rings: [...bench.scene.selectedRings] };
  });
  assert.deepEqual(rings, [1]);
  assert.deepEqual(marked[0], plain[0]);
  assertNear(marked[1], accent, 2, 'selected');
}));

test('the pointer pans, zooms and picks', () => inPage(async (page) => {
  await page.evaluate(() => bench.picture({}));
  const pick = (x, y) => page.evaluate(([one, other]) => bench.scene.pick(one, other), [x, y]);
  const held = await pick(300, 200);
  await page.mouse.move(300, 200);
  await page.mouse.wheel(0, -500);
  await page.waitForFunction(() => bench.changes() > 0);
  const zoomed = await pick(300, 200);
  assert.ok(Math.hypot(held.x - zoomed.x, held.y - zoomed.y) < 1e-6);
  await page.mouse.down();
  await page.mouse.move(420, 330, { steps: 5 });
  await page.mouse.up();
  const dragged = await pick(420, 330);
  assert.ok(Math.hypot(held.x - dragged.x, held.y - dragged.y) < 1e-6);
  assert.equal(await page.evaluate(() => bench.clicks()), 0);
  await page.mouse.click(420, 330);
  assert.equal(await page.evaluate(() => bench.clicks()), 1);
  await page.keyboard.press('0');
  const again = await pick(300, 200);
  assert.ok(Math.hypot(held.x - again.x, held.y - again.y) < 1e-6, 'fits again');
}));

test('the picture returns after a lost context', () =>
  inPage(async (page) => {
    const same = await page.evaluate(async () => {
      bench.picture({ edges: true, particles: true, normals: true });
      const first = bench.pixels();
      await bench.loseContext();
      const second = bench.pixels();
      return first.every((part, k) => part === second[k]);
    });
    assert.ok(same);
  }));

test('PNG and clip have their file types', () => inPage(async (page) => {
  const { picture, film } = await page.evaluate(async () => {
    bench.picture({});
    return { picture: await bench.head(bench.png()), film: await bench.head(bench.film(30)) };
  });
  assert.equal(picture.type, 'image/png');
  assert.deepEqual(picture.bytes, [0x89, 0x50, 0x4e, 0x47]);
  assert.ok(picture.size > 5000, `${picture.size} bytes`);
  assert.equal(film.type, 'video/webm');
  assert.deepEqual(film.bytes, [0x1a, 0x45, 0xdf, 0xa3]);
  assert.ok(film.size > 5000, `${film.size} bytes`);
}));

test('pictures for inspection', { skip: !options.pictures }, () => inPage(async (page) => {
  mkdirSync(options.pictures, { recursive: true });
  for (const dark of [false, true]) {
    for (const [name, look] of Object.entries({
      plain: {}, edges: { edges: true }, identity: { colour: 'identity', edges: true },
      attribute: { colour: 'speed', lineWidth: 3 }, all: { particles: true, normals: true },
    })) {
      await page.evaluate((one) => bench.picture(one), { dark, ...look });
      const png = await page.evaluate(async () => {
        const reader = new FileReader();
        reader.readAsDataURL(await bench.png());
        await new Promise((resolve) => { reader.onload = resolve; });
        return reader.result.split(',')[1];
      });
      const file = path.join(options.pictures, `${name}-${dark ? 'dark' : 'light'}.png`);
      writeFileSync(file, Buffer.from(png, 'base64'));
    }
  }
}, 2));

test('main-thread time of a mesh of 100,000 vertices', (context) => inPage(async (page) => {
  for (const [name, look] of Object.entries({
    'fill and outline': {}, 'with edges': { edges: true }, 'by identity': { colour: 'identity' },
  })) {
    const count = Math.min(Number(options.frames), name === 'fill and outline' ? Infinity : 100);
    const result = await page.evaluate(([one, frames]) =>
      bench.times(one, { cell: 0.023, merge: false }, frames), [look, count]);
    assert.ok(result.points > 98_000, `${result.points} points`);
    const { decode, show, draw } = result;
    const uploaded = decode.map((ms, k) => ms + show[k]);
    const figures = Object.entries({ decode, show, 'decode and show': uploaded, draw })
      .map(([what, ms]) => `${what} p50 ${quantile(ms, 0.5)} p99 ${quantile(ms, 0.99)} ms`);
    context.diagnostic(`${name}: ${result.points} points, ${result.triangles} triangles, ` +
      `${result.bytes} bytes, ${count} frames: ${figures.join('; ')}`);
  }
}));

function quantile(numbers, share) {
  const sorted = numbers.toSorted((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))].toFixed(2);
}
