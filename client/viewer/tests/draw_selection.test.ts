import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Selection } from '../src/draw/selection';
import { type Frame, NO_RING } from '../src/protocol/frame';
import { makeFrame } from './draw_frames';

const TEMPLATE = makeFrame({ cell: 1 });

/** A frame with rings of these identities and parents. */
function frame(sequence: number, rings: [identity: number, parents: number[]][]): Frame {
  return {
    ...TEMPLATE,
    sequence: BigInt(sequence),
    rings: {
      ...TEMPLATE.rings,
      identities: BigUint64Array.from(rings, ([identity]) => BigInt(identity)),
      parents: rings.map(([, parents]) => parents.map(BigInt)),
    },
  };
}

function selected(selection: Selection, one: Frame): bigint[] {
  return selection.ringsOf(one).map((ring) => one.rings.identities[ring]);
}

test('A ring stays selected as long as it keeps its identity', () => {
  const selection = new Selection();
  selection.start(7n);
  assert.deepEqual(selected(selection, frame(1, [[5, []], [7, []]])), [7n]);
  assert.deepEqual(selected(selection, frame(2, [[7, [7]], [5, [5]]])), [7n]);
  assert.deepEqual(selected(selection, frame(9, [[7, [7]]])), [7n]);
});

test('after a split all parts are selected', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, frame(1, [[7, []], [1, []]]));
  assert.deepEqual(selected(selection, frame(2, [[7, [7]], [8, [7]], [1, [1]]])), [7n, 8n]);
  assert.deepEqual(selected(selection, frame(3, [[9, [8]], [8, [8]], [7, [7]]])), [9n, 8n, 7n]);
});

test('after a merge the merged ring is selected', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, frame(1, [[7, []], [1, []]]));
  assert.deepEqual(selected(selection, frame(2, [[1, [1, 7]]])), [1n]);
  assert.deepEqual(selected(selection, frame(3, [[1, [1]]])), [1n]);
});

test('before a merge the other ring is not selected', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, frame(4, [[7, []], [1, []]]));
  selected(selection, frame(5, [[1, [1, 7]]]));
  assert.deepEqual(selected(selection, frame(4, [[7, []], [1, []]])), [7n]);
  assert.deepEqual(selected(selection, frame(5, [[1, [1, 7]]])), [1n]);
});

test('parents are ignored after a gap', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, frame(1, [[7, []], [8, []]]));
  assert.deepEqual(selected(selection, frame(90, [[8, [7]]])), []);
});

/** A frame with squares: identity, left, bottom, side. */
function squares(sequence: number, ones: [number, number, number, number][],
                 origin: [number, number] = [0, 0]): Frame {
  const corners = ones.map(([, left, bottom, side]) => [
    left, bottom, left + side, bottom, left + side, bottom + side, left, bottom + side,
  ].map((one, k) => one - origin[k % 2]));
  return {
    ...TEMPLATE,
    sequence: BigInt(sequence),
    origin,
    rings: {
      ...TEMPLATE.rings,
      points: Float32Array.from(corners.flat()),
      offsets: Uint32Array.from({ length: ones.length + 1 }, (_, k) => 4 * k),
      outerOf: Uint32Array.from(ones, () => NO_RING),
      identities: BigUint64Array.from(ones, ([identity]) => BigInt(identity)),
      area: Float64Array.from(ones, ([, , , side]) => side * side),
      parents: ones.map(() => []),
    },
  };
}

test('a missed merge is found by position', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, squares(1, [[7, 0, 0, 2], [1, 3, 0, 9]]));
  const merged = squares(4, [[1, -1, -1, 13], [2, 50, 50, 3]], [100, 100]);
  assert.deepEqual(selected(selection, merged), [1n]);
  assert.deepEqual(selected(selection, squares(90, [[1, -1, -1, 13]])), [1n]);
});

test('a missed split is found by position', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, squares(1, [[7, 0, 0, 10], [1, 30, 0, 9]]));
  const split = squares(3, [[7, 0, 0, 4], [8, 5, 5, 4], [9, 31, 1, 3], [1, 35, 0, 4]]);
  assert.deepEqual(selected(selection, split), [7n, 8n]);
});

test('position is ignored after many frames', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, squares(1, [[7, 0, 0, 2], [1, 3, 0, 9]]));
  assert.deepEqual(selected(selection, squares(60, [[1, -1, -1, 13]])), []);
});

test('an untracked ring is never selected', () => {
  const selection = new Selection();
  selection.start(0n);
  assert.deepEqual(selected(selection, frame(1, [[0, []]])), []);
  selection.start(7n);
  selected(selection, frame(1, [[7, []]]));
  assert.deepEqual(selected(selection, frame(2, [[0, [7]], [0, []]])), [0n]);
  assert.deepEqual(selected(selection, frame(3, [[0, []], [0, []]])), []);
});

test('a new selection replaces the old one', () => {
  const selection = new Selection();
  selection.start(7n);
  selected(selection, frame(1, [[7, []], [1, []]]));
  selection.start(1n);
  assert.deepEqual(selected(selection, frame(2, [[7, [7]], [1, [1]]])), [1n]);
  selection.start(null);
  assert.deepEqual(selected(selection, frame(3, [[7, [7]], [1, [1]]])), []);
});
