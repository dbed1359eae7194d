import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Gauges } from '../src/gauges/gauges';
import { columnsOf, parseGauge } from '../src/gauges/kinds';
import { measure } from '../src/gauges/measure';
import { ringsOf } from '../src/gauges/rings';
import { bareRings, NO_RING, type Frame } from '../src/protocol/frame';
import type { Entry, Summary } from '../src/stream/history';
import { makeFrame } from './draw_frames';

/** A frame with these rings around (100, 200); the first is an outer ring, the others are its holes. */
function frameOf(...rings: [number, number][][]): Frame {
  const offsets = new Uint32Array(rings.length + 1);
  rings.forEach((ring, k) => { offsets[k + 1] = offsets[k] + ring.length; });
  const bare = bareRings(new Float32Array(rings.flat(2)), offsets);
  bare.outerOf.forEach((_, k) => { bare.outerOf[k] = k === 0 ? NO_RING : 0; });
  return { ...makeFrame(), origin: [100, 200], rings: bare };
}

/** A square with side 4 with a square hole with side 2 in its middle. */
const frame = frameOf([[-2, -2], [2, -2], [2, 2], [-2, 2]], [[-1, -1], [-1, 1], [1, 1], [1, -1]]);
const values = (text: string, of = frame) => measure(parseGauge(text), ringsOf(of));
const near = (found: number[], wanted: number[], error = 1e-9) => {
  assert.equal(found.length, wanted.length);
  found.forEach((value, k) => assert.ok(
    Math.abs(value - wanted[k]) <= error || (Number.isNaN(value) && Number.isNaN(wanted[k])), `${found} is not ${wanted}`));
};

test('heights, fronts, lengths and areas are exact', () => {
  near(values('a=height:100.5'), [202, 198, 4]);
  near(values('a=height:90'), [NaN, NaN, 0]);
  near(values('a=front:3,0').slice(0, 2), [102, 102]);
  near(values('a=front:0,-1').slice(0, 1), [-198]);
  near(values('a=wetted:90,200,110,200'), [2]);
  near(values('a=wetted:98.5,200,98.5,200.5'), [0.5]);
  near(values('a=box:90,190,110,210'), [12, 100, 200]);
  // The right half: 8 with its middle at 101, without 2 with its middle at 100.5.
  near(values('a=box:100,190,110,210'), [6, (8 * 101 - 2 * 100.5) / 6, 200]);
  near(values('a=box:99.5,199.5,100.5,200.5'), [0, NaN, NaN]);
});

test('a drop on a wall has its contact angle, a pile its slopes', () => {
  const angle = 60 * Math.PI / 180;
  const drop = Array.from({ length: 400 }, (_, k): [number, number] => {
    const at = Math.PI / 2 + angle - (k / 399) * 2 * angle;
    return [20 * Math.cos(at), 20 * Math.sin(at) - 20 * Math.cos(angle)];
  }).reverse();
  const of = { ...frameOf(drop), statistics: { ...makeFrame().statistics, spacing: 0.5 } };
  const [start, end, from, to] = values('a=contact:100,200,1,0,40', of);
  near([start, end], [60, 60], 0.01);
  near([from, to], [-20 * Math.sin(angle), 20 * Math.sin(angle)], 0.01);
  near(values('a=repose', frameOf([[-20, 0], [10, 0], [0, 10]])), [Math.atan(0.5) * 180 / Math.PI, 45], 1e-6);
});

test('a wrong gauge says what is wrong', () => {
  const wrong: [string, RegExp][] = [
    ['height:1', /form NAME=KIND:NUMBERS/], ['a b=height:1', /1 to 40 of letters/], ['a=depth:1', /one of height, front/],
    ['a=height', /height must have the numbers x\./], ['a=height:1,2', /numbers x\./], ['a=height:one', /numbers x\./],
    ['a=repose:1', /repose has no numbers/], ['a=front:0,0', /direction must not be zero/],
    ['a=repose:', /repose has no numbers/], ['a=height:1,', /numbers x\./], ['a=height:', /numbers x\./],
    ['a=wetted:1,1,1,1', /ends must differ/], ['a=box:1,1,0,2', /max_x and max_y/], ['a=contact:0,0,0,0,1', /direction/],
    ['a=contact:0,0,1,0,0', /reach must be above 0/], ['a=toString:1', /one of height/],
  ];
  for (const [text, message] of wrong) assert.throws(() => parseGauge(text), message, text);
  for (const number of ['0x10', ' 1', '1 ', '+1', '1e', '.', 'inf', 'nan', '1e400', '1e-400', '1.1e69', '']) {
    assert.throws(() => parseGauge(`a=height:${number}`), /height must have the numbers x\./, number);
  }
  for (const [number, value] of [['-1.5e3', -1500], ['5.', 5], ['.5', 0.5], ['1E5', 1e5], ['1e39', 1e39], ['-1e69', -1e69], ['0e9', 0]] as const) {
    assert.deepEqual(parseGauge(`a=height:${number}`).numbers, [value]);
  }
  assert.throws(() => parseGauge('a=front:1e-61,0'), /direction must not be zero/);
  assert.throws(() => parseGauge(' a=height:1'), /1 to 40 of letters/);
  assert.deepEqual(columnsOf(parseGauge('a=wetted:0,0,1,0')), ['a']);
  assert.deepEqual(columnsOf(parseGauge('a=repose')), ['a_left_angle', 'a_right_angle']);
});

test('frames are measured once, the newest first, as far as the time goes', () => {
  let decoded = 0;
  const entries = Array.from({ length: 5 }, (_, k) => ({
    sequence: k, time: k, receivedAt: 0, bytes: 0, summary: {} as Summary, frame: () => { ++decoded; return frame; },
  } satisfies Entry));
  const gauges = new Gauges();
  gauges.measure(entries, () => false);
  assert.equal(decoded, 0, 'no gauge');
  const level = parseGauge('level=height:100');
  gauges.add(level);
  gauges.measure([...entries, null], () => decoded === 2);
  const known = () => entries.map(({ summary }) => gauges.value(summary, level, 0));
  assert.deepEqual(known(), [NaN, NaN, NaN, 202, 202]);
  gauges.measure(entries, () => false);
  gauges.measure(entries, () => false);
  assert.deepEqual([known(), decoded], [[202, 202, 202, 202, 202], 5]);
  const other = parseGauge('level=front:1,0');
  gauges.add(other);
  assert.deepEqual(gauges.all, [other], 'it replaces the one with its name');
  gauges.remove(other);
  assert.deepEqual(gauges.all, []);
});
