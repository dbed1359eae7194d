import assert from 'node:assert/strict';
import { test } from 'node:test';
import { History, type Entry } from '../src/stream/history';
import { cellSizeOf } from '../src/stream/settings';
import { reductionOf, STAGES } from '../src/stream/summary';
import { firstOf, nextOf } from '../src/stream/variant_stream';
import { entriesOf } from '../src/ui/curve_data';

function historyOf(sequences: number[]): History {
  const history = new History(Infinity);
  for (const sequence of sequences) {
    const entry: Entry = {
      sequence, time: 0, receivedAt: 0, bytes: 0,
      summary: {
        area: sequence, rings: 0, holes: 0, triangles: 0, trianglesGrid: 0, milliseconds: 0,
        stages: STAGES.map(() => 0), received: 0, drawn: 0, dropped: 0, latency: 0,
      },
      frame: () => { throw new Error('not decoded'); },
    };
    history.insert(entry, Infinity);
  }
  return history;
}

test('a variant begins before the frame shown', () => {
  assert.equal(firstOf(100, 1), 75);
  assert.equal(firstOf(100, 90), 90, 'not before the first frame available');
  assert.equal(firstOf(5, 1), 1);
  assert.equal(firstOf(5, 9), 5, 'the frame itself');
});

test('a variant takes each frame of the stream in order', () => {
  const history = historyOf([1, 2, 4, 5]);
  const sent: number[] = [];
  for (let next = nextOf(history, 0, 5); next !== null; next = nextOf(history, next, 5)) sent.push(next);
  assert.deepEqual(sent, [1, 2, 4, 5]);
});

test('a variant far behind continues shortly before the frame shown', () => {
  const history = historyOf(Array.from({ length: 1000 }, (_, k) => k + 1));
  assert.equal(nextOf(history, 10, 900), 875);
  assert.equal(nextOf(history, 700, 900), 701);
});

test('a compared curve has a gap where the other track lacks a frame', () => {
  const own = historyOf([1, 2, 3]);
  const others = entriesOf({ history: historyOf([2, 3, 4]) }, [own.get(1), null, own.get(2), own.get(3)]);
  assert.deepEqual(others.map((entry) => entry?.summary.area ?? null), [null, null, 2, 3]);
});

test('cells span the longer side of the outline', () => {
  assert.equal(cellSizeOf(32, 3.2, 0.05), 2);
  assert.equal(cellSizeOf(64, 3.2, 0.05), 1);
  assert.equal(cellSizeOf(32, 100, 0.05), 4, 'within the limits');
  assert.equal(cellSizeOf(64, 0.1, 0.05), 0.25);
});

test('the reduction is in percent of the unmerged triangles', () => {
  assert.equal(reductionOf({ triangles: 25, trianglesGrid: 100 }), 75);
  assert.ok(Number.isNaN(reductionOf({ triangles: 0, trianglesGrid: 0 })));
});
