import assert from 'node:assert/strict';
import { test } from 'node:test';
import { foldsAtFirst, isEmbedded } from '../src/ui/layout';

test('?embed shows the picture alone', () => {
  assert.ok(isEmbedded('?embed'));
  assert.ok(isEmbedded('?embed=1'));
  assert.ok(!isEmbedded(''));
  assert.ok(!isEmbedded('?other=embed'));
});

test('a phone begins with the picture; a wide screen as the user chose', () => {
  assert.ok(foldsAtFirst(true, 'open'));
  assert.ok(foldsAtFirst(false, 'folded'));
  assert.ok(!foldsAtFirst(false, 'open'));
  assert.ok(!foldsAtFirst(false, null));
});
