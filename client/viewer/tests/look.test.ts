import assert from 'node:assert/strict';
import { test } from 'node:test';
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
