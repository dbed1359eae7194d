import assert from 'node:assert/strict';
import { test } from 'node:test';
import { hex, theme } from '../src/draw/colours';
import { contactMarks } from '../src/draw/contacts';
import { DEFAULT_LOOK, type Look } from '../src/draw/look';
import { isolineColour } from '../src/draw/look_colours';
import { rampStops } from '../src/draw/ramp';
import { legendOf } from '../src/draw/scene';
import { toCss } from '../src/draw/view';
import { marksOf } from '../src/export/marks';
import { svg } from '../src/export/svg';
import type { Frame } from '../src/protocol/frame';
import { makeFrame, meshOf } from './draw_frames';

const SIZE = { width: 850, height: 550 };
const VIEW = { x: 8.5, y: 5.5, scale: 50 };
const FRAME = makeFrame();
const NOTHING: Look = { ...DEFAULT_LOOK, outline: false, fill: false };

function draw(look: Partial<Look>, frame: Frame = FRAME, view = VIEW): string {
  return svg(frame, { ...NOTHING, ...look }, view, SIZE);
}

function count(text: string, pattern: RegExp): number {
  return text.match(pattern)?.length ?? 0;
}

test('an empty look draws only the background', () => {
  const text = draw({});
  assert.match(text, /^<svg [^>]*width="850" height="550" viewBox="0 0 850 550">/);
  assert.equal(count(text, /<path/g), 0);
  assert.ok(text.includes(`fill="${hex(theme(false).background)}"`));
  assert.ok(draw({ dark: true }).includes(hex(theme(true).background)));
});

test('the outline has every vertex at its screen position', () => {
  const text = draw({ outline: true, lineWidth: 3 });
  assert.equal(count(text, /[ML][\d.-]+ [\d.-]+/g), FRAME.rings.points.length / 2);
  assert.equal(count(text, /Z/g), FRAME.rings.outerOf.length);
  assert.equal(count(text, /stroke-width="3"/g), 2, 'outer rings and holes');
  const x = Math.round(100 * (425 + (FRAME.rings.points[0] - 8.5) * 50)) / 100;
  const y = Math.round(100 * (275 - (FRAME.rings.points[1] - 5.5) * 50)) / 100;
  assert.ok(text.includes(`M${x} ${y}L`));
});

test('the outline ends at cuts', () => {
  const cuts = Uint32Array.of(1, 2);  // In the first ring.
  const text = draw({ outline: true }, { ...FRAME, rings: { ...FRAME.rings, cuts } });
  assert.equal(count(text, /Z/g), FRAME.rings.outerOf.length - 1);
  const segments = FRAME.rings.offsets[1] - cuts.length;
  assert.equal(count(text, /M/g), segments + FRAME.rings.outerOf.length - 1);
});

test('parts outside the picture are left out', () => {
  const drop = { x: 14.6, y: 3.1, scale: 250 };
  assert.equal(count(draw({ outline: true }, FRAME, drop), /Z/g), 1);
  const away = { x: 1e6, y: 0, scale: 50 };
  const all = { outline: true, fill: true, edges: true, particles: true, normals: true };
  assert.equal(count(draw(all, FRAME, away), /<path/g), 0);
});

test('merged triangles are one path on top of the inside', () => {
  const text = draw({ fill: true });
  const { band, interior } = theme(false);
  assert.ok(text.indexOf(hex(band)) < text.indexOf(hex(interior)));
  assert.equal(count(text, /<path/g), 2);
  const merged = FRAME.mesh?.classes.reduce((sum, one) => sum + one, 0) ?? 0;
  assert.equal(count(text, /Z/g), FRAME.rings.outerOf.length + merged);
});

test('rings are filled without a mesh', () => {
  const text = draw({ fill: true, edges: true }, { ...FRAME, mesh: null });
  assert.equal(count(text, /<path/g), 1);
  assert.match(text, /fill-rule="evenodd"/);
});

test('every edge is drawn once', () => {
  const edges = new Set<string>();
  const { triangles } = FRAME.mesh ?? { triangles: new Uint32Array(0) };
  for (let k = 0; k < triangles.length; ++k) {
    const pair = [triangles[k], triangles[k % 3 === 2 ? k - 2 : k + 1]];
    edges.add(pair.sort((a, b) => a - b).join());
  }
  assert.equal(count(draw({ edges: true }), /M/g), edges.size);
});

test('particles are dots, normals are lines', () => {
  assert.equal(count(draw({ particles: true }), /h0/g), (FRAME.particles?.length ?? 0) / 2);
  assert.equal(count(draw({ normals: true }), /l/g) > 0, true);
  const zoomed = { ...VIEW, scale: 5 };
  assert.ok(count(draw({ normals: true }, FRAME, zoomed), /M/g) <
    count(draw({ normals: true }), /M/g), 'every n-th where they are too close');
});

test('each identity has its colour', () => {
  const text = draw({ outline: true, fill: true, colour: 'identity' });
  const strokes = new Set([...text.matchAll(/stroke="(#\w+)"/g)].map(([, colour]) => colour));
  assert.equal(strokes.size, FRAME.rings.outerOf.length);
  const fills = new Set([...text.matchAll(/<path fill="(#\w+)"/g)].map(([, colour]) => colour));
  assert.equal(fills.size, 2 * 6, 'band and interior of six outer rings');
});

test('an attribute colours the outline; NaN is grey', () => {
  const stops = rampStops(DEFAULT_LOOK);
  const values = Float32Array.from(FRAME.rings.points, (one) => one).filter((_, k) => k % 2 === 0);
  const rings = { ...FRAME.rings, attributes: new Map([['x', values]]) };
  const text = draw({ outline: true, colour: 'x' }, { ...FRAME, rings });
  assert.ok(text.includes(stops[0]) && text.includes(stops[stops.length - 1]));
  const range = { min: 1e9, max: 2e9 };
  const below = svg({ ...FRAME, rings }, { ...NOTHING, outline: true, colour: 'x' }, VIEW, SIZE,
    range);
  assert.equal(count(below, /<path/g), 1);
  const unknown = { ...FRAME.rings, attributes: new Map([['x', values.map(() => NaN)]]) };
  assert.ok(draw({ outline: true, colour: 'x' }, { ...FRAME, rings: unknown })
    .includes(`stroke="${hex(theme(false).missing)}"`));
});

test('an attribute colours the mesh in bands', () => {
  const { points, triangles, classes } = makeFrame().mesh!;
  const values = Float32Array.from({ length: points.length / 2 }, (_, k) => points[2 * k]);
  const mesh = meshOf(points, triangles, classes, new Map([['x', values]]));
  const text = draw({ fill: true, colour: 'x' }, { ...FRAME, mesh });
  assert.ok(count(text, /<path fill="#/g) > 50);
  const [first] = /d="([^"]*)"/.exec(text)!.slice(1);
  const xs = [...first.matchAll(/[ML]([\d.]+) /g)].map(([, x]) => Number(x));
  assert.ok(Math.max(...xs) - Math.min(...xs) <= (850 / 64) + 0.02, 'a band is narrow');
});

test('isolines and selected rings are lines', () => {
  const isolines = [1, 2].map((index) => ({ index, rings: FRAME.rings, origin: FRAME.origin }));
  const lines = draw({ sections: true }, { ...FRAME, isolines });
  for (const index of [1, 2]) assert.ok(lines.includes(hex(isolineColour(index, false))));
  const one = draw({ sections: true, hidden: [1] }, { ...FRAME, isolines });
  assert.ok(!one.includes(hex(isolineColour(1, false))) && one.includes(hex(isolineColour(2, false))));
  assert.equal(count(draw({ sections: false }, { ...FRAME, isolines }), /<path/g), 0);
  const text = svg(FRAME, NOTHING, VIEW, SIZE, null, [0]);
  assert.ok(text.includes(hex(theme(false).accent)));
});

test('a missing attribute leaves the outline plain', () => {
  assert.ok(draw({ outline: true, colour: 'nowhere' }).includes(hex(theme(false).outline)));
});

test('particles have the colours of an attribute', () => {
  const particles = FRAME.particles!;
  const values = Float32Array.from({ length: particles.length / 2 }, (_, k) => (k === 0 ? NaN : particles[2 * k]));
  const frame = { ...FRAME, particleAttributes: new Map([['x', values]]) };
  const text = draw({ particles: true, colour: 'x' }, frame);
  const stops = rampStops(DEFAULT_LOOK);
  assert.ok(text.includes(stops[0]) && text.includes(stops[stops.length - 1]));
  assert.ok(text.includes(hex(theme(false).missing)), 'NaN is grey');
  assert.ok(!text.includes(hex(theme(false).particle)));
  assert.equal(count(text, /h0/g), particles.length, 'rims and dots');
  const grey = draw({ particles: true, colour: 'x', map: 'grey' }, frame);
  assert.ok(grey.includes(rampStops({ dark: false, map: 'grey' })[0]) && !grey.includes(stops[0]));
});

test('particles with own sizes have their diameters, grains all of it', () => {
  const particles = FRAME.particles!;
  const diameters = Float32Array.from({ length: particles.length / 2 }, (_, k) => 1 + k % 2);
  const widths = (areDiscs: boolean) => {
    const text = draw({ particles: true }, { ...FRAME, particleSizes: { diameters, areDiscs } });
    assert.equal(count(text, /h0/g), particles.length / 2);
    return [...text.matchAll(/stroke-width="([\d.]+)"/g)].map(([, width]) => Number(width)).sort((a, b) => a - b);
  };
  const [small, large] = widths(true);
  assert.ok(Math.abs(large / small - 2) < 0.05);
  assert.ok(Math.abs(small - VIEW.scale) < 0.1, 'a diameter of 1');
  assert.ok(Math.abs(widths(false)[0] / small - 0.4) < 0.05);
});

test('caption, scale and legend are on the picture', () => {
  const legend = { name: 'velocity, magnitude', min: 0.5, max: 2, stops: rampStops(DEFAULT_LOOK) };
  const marks = marksOf('dam <1>, frame 12, time 0.5', SIZE, VIEW, legend, false);
  const text = svg(FRAME, NOTHING, VIEW, SIZE, legend, [], marks);
  for (const part of ['dam &#60;1&#62;, frame 12, time 0.5', 'velocity, magnitude', '>0.5<', '>2<']) {
    assert.ok(text.includes(part), part);
  }
  const bars = [...text.matchAll(/<rect [^>]*width="([\d.]+)" height="(\d+)" fill="(#\w+)"/g)];
  assert.ok(bars.some(([, width, height]) => width === '100' && height === '2'), 'two units of length are 100 pixels');
  const colours = bars.filter(([, , height]) => height === '8').map(([, , , colour]) => colour);
  assert.deepEqual([...new Set(colours)], legend.stops);
  const plain = marksOf('dam', SIZE, VIEW, null, true);
  assert.equal(plain.length, 3, 'caption, length and bar');
});

test('axes and a measurement are on the picture, clear of caption and legend', () => {
  const legend = { name: 'p', min: 0, max: 1, stops: rampStops(DEFAULT_LOOK) };
  const drawn = { axes: true, contacts: [], points: [[8.5, 5.5], [9.5, 5.5]] as [number, number][], text: 'distance 1' };
  const marks = marksOf('dam', SIZE, VIEW, legend, false, drawn);
  const text = svg(FRAME, NOTHING, VIEW, SIZE, legend, [], marks);
  assert.ok(text.includes('<polyline points="425,275 475,275"'), 'the measured line');
  assert.equal(count(text, /<circle /g), 2);
  assert.match(text, /<text x="483" y="267" [^>]*paint-order="stroke"[^>]*>distance 1</);
  const ticks = marks.filter((mark) => mark.kind === 'line' && mark.width === 1);
  assert.ok(ticks.length >= 6, `${ticks.length} ticks`);
  assert.match(text, /text-anchor="middle">5</, 'x = 5');
  const at = (content: string) => marks.find((mark) => mark.kind === 'text' && mark.text === content) as { x: number; y: number };
  assert.ok(at('dam').y < SIZE.height - 20 && at('dam').x > 50, 'the caption is above the axis');
  assert.ok(at('p').x > 50, 'the legend is beside the axis');
});

test('contacts are on the picture with their angles, unless there are many', () => {
  const { rings, origin } = FRAME;
  const contacts = Uint32Array.of(0, 2);
  const wet = { ...FRAME, rings: { ...rings, contacts, contactAngles: Float32Array.of(Math.PI / 2, 1) } };
  const marks = contactMarks(wet, VIEW, SIZE);
  assert.deepEqual(marks.map(({ text }) => text), ['90°', '57°']);
  const expected = toCss(VIEW, SIZE, origin[0] + rings.points[4], origin[1] + rings.points[5]);
  assert.deepEqual([marks[1].x, marks[1].y], expected);
  const drawn = marksOf('dam', SIZE, VIEW, null, true, { axes: false, contacts: marks, points: [], text: '' });
  assert.equal(drawn.filter(({ kind }) => kind === 'circle').length, 2);
  const repeated = new Uint32Array(2000);
  const many = contactMarks({ ...wet, rings: { ...rings, contacts: repeated, contactAngles: new Float32Array(2000) } }, VIEW, SIZE);
  assert.deepEqual([many.length, many[0].text], [1000, '']);
  assert.deepEqual(contactMarks(wet, { ...VIEW, x: VIEW.x + 1e6 }, SIZE), [], 'outside the picture');
});

test('without a channel there is no legend', () => {
  const range = { min: 0, max: 1 };
  assert.equal(legendOf(DEFAULT_LOOK, range, ['p']), null, 'one colour');
  assert.equal(legendOf({ ...DEFAULT_LOOK, colour: 'identity' }, range, ['p']), null, 'by identity');
  assert.equal(legendOf({ ...DEFAULT_LOOK, colour: 'p' }, null, []), null, 'no number so far');
  const kept = legendOf({ ...DEFAULT_LOOK, colour: 'v' }, range, []);
  assert.deepEqual([kept?.name, kept?.min, kept?.max], ['v', 0, 1], 'a frame without the channel keeps the range');
  assert.equal(legendOf({ ...DEFAULT_LOOK, colour: 'v' }, range, ['v', 'v x'])?.name, 'v, magnitude');
  const marks = marksOf('dam', SIZE, VIEW, null, false);
  assert.deepEqual(marks.map(({ kind }) => kind), ['text', 'text', 'box']);
});
