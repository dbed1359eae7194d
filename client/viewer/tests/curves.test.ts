import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Gauges } from '../src/gauges/gauges';
import { History, type Entry } from '../src/stream/history';
import { STAGES } from '../src/stream/summary';
import { curvePoints, curvesCsv } from '../src/ui/curve_data';
import { number } from '../src/ui/format';
import { tickDigits, ticks } from '../src/ui/ticks';

function track(sequences: number[], label = (sequence: number) => String(sequence)) {
  const history = new History(Infinity);
  for (const sequence of sequences) {
    const entry: Entry = {
      sequence, time: sequence / 4, receivedAt: 0, bytes: 0,
      summary: {
        area: sequence === 2 ? NaN : 2.5, rings: 3, holes: 1, triangles: 10, trianglesGrid: 20, milliseconds: 1.5,
        stages: STAGES.map((_, k) => k / 8), received: sequence, drawn: 0, dropped: 0, latency: NaN,
      },
      frame: () => { throw new Error('not decoded'); },
    };
    history.insert(entry, Infinity);
  }
  return { history, labelOf: label };
}

test('a curve has a gap where frames are missing', () => {
  const { x, entries } = curvePoints(track([1, 2, 3, 7, 8]));
  assert.deepEqual(x, [1, 2, 3, 5, 7, 8]);
  assert.deepEqual(entries.map((entry) => entry?.sequence ?? null), [1, 2, 3, null, 7, 8]);
});

test('every n-th frame is no gap', () => {
  assert.deepEqual(curvePoints(track([1, 3, 5])).x, [1, 3, 5]);
  const report = track([1, 2, 3], (sequence) => String(10 * sequence));
  assert.deepEqual(curvePoints(report).x, [10, 20, 30]);
});

test('a refused frame of a report is a gap', () => {
  const labels = [0, 1, 3];
  assert.deepEqual(curvePoints(track([1, 2, 3], (sequence) => String(labels[sequence - 1]))).x, [0, 1, 2, 3]);
});

test('a long curve has gaps between its samples, too', () => {
  const sequences = Array.from({ length: 3000 }, (_, k) => (k < 1500 ? k : k + 500));
  const { x, entries } = curvePoints(track(sequences));
  assert.ok(x.length <= 601);
  assert.equal(entries.filter((entry) => entry === null).length, 1);
  const gap = x[entries.indexOf(null)];
  assert.ok(gap > 1495 && gap < 2005, `${gap}`);
});

test('an axis has at least three round ticks', () => {
  assert.deepEqual(ticks(0, 10), [0, 5, 10]);
  assert.deepEqual(ticks(1, 75), [20, 40, 60]);
  assert.deepEqual(ticks(0.25, 0.5), [0.3, 0.4, 0.5]);
  assert.deepEqual(ticks(-1, 1), [-1, 0, 1]);
  for (let k = 1; k < 400; ++k) {
    const [min, max] = [Math.sin(k) * 10 ** (k % 7), Math.sin(k) * 10 ** (k % 7) + 10 ** (k % 9 - 4)];
    const all = ticks(min, max);
    assert.ok(all.length >= 3 && all.length <= 6, `${min} ${max}: ${all.join(' ')}`);
    assert.ok(all[0] >= min - 1e-9 && all[all.length - 1] <= max + 1e-9);
    const texts = all.map((tick) => number(tick, tickDigits(all)));
    assert.equal(new Set(texts).size, all.length, `${texts.join(' ')} differ`);
  }
});

test('the curves are saved as CSV, with empty cells for unknown numbers', () => {
  const [head, first, second, ...rest] = curvesCsv(track([1, 2]), new Gauges()).trimEnd().split('\n');
  assert.equal(head, `frame,time,area,rings,holes,triangles,triangles_unmerged,reduction_percent,milliseconds,${
    STAGES.map((name) => `${name}_ms`).join()},received,drawn,dropped,latency_ms`);
  assert.match(first, /^1,0\.25,2\.5,3,1,10,20,50,1\.5,0,0\.125,/);
  const [ofSurfaces, surface] = curvesCsv(track([1, 2]), new Gauges(), true).trimEnd().split('\n');
  assert.match(ofSurfaces, /^frame,time,area,volume,bodies,cavities,triangles,milliseconds,bins_ms,/);
  assert.match(surface, /^1,0\.25,2\.5,,3,1,10,1\.5,0,0\.125,/);
  assert.match(second, /^2,0\.5,,3,1/);
  assert.match(second, /,2,0,0,$/);
  assert.deepEqual(rest, []);
});
