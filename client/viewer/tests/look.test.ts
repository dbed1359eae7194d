import assert from 'node:assert/strict';
import { test } from 'node:test';
import { chosenRange } from '../src/draw/ramp';
import { offeredChannels, rangeOf } from '../src/ui/look_panel';

test('a chosen colour stays offered in a frame without it', () => {
  assert.deepEqual(offeredChannels(['p', 'q'], 'p'), ['p', 'q']);
  assert.deepEqual(offeredChannels(['q'], 'p'), ['q', 'p']);
  assert.deepEqual(offeredChannels([], 'p'), ['p']);
  assert.deepEqual(offeredChannels([], 'identity'), []);
});

test('a link with an inverted or empty range has none', () => {
  assert.deepEqual(rangeOf(-1, 2), { from: -1, to: 2 });
  assert.deepEqual(rangeOf(2, -1), { from: null, to: null });
  assert.deepEqual(rangeOf(2, 2), { from: null, to: null });
  assert.deepEqual(rangeOf(null, 2), { from: null, to: 2 });
});

test('a range with one end beyond all numbers stays a range', () => {
  const all = { min: 1, max: 5 };
  assert.deepEqual(chosenRange(all, null, null), all);
  assert.deepEqual(chosenRange(all, 2, null), { min: 2, max: 5 });
  assert.deepEqual(chosenRange(all, 100, null), { min: 100, max: 104 });
  assert.deepEqual(chosenRange(all, 5, null), { min: 5, max: 9 });
  assert.deepEqual(chosenRange(all, null, -3), { min: -7, max: -3 });
  assert.deepEqual(chosenRange(all, 7, 9), { min: 7, max: 9 });
  assert.deepEqual(chosenRange({ min: 2, max: 2 }, 3, null), { min: 3, max: 4 });
});
