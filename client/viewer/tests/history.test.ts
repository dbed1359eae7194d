import assert from 'node:assert/strict';
import test from 'node:test';
import { History, type Entry } from '../src/stream/history';
import { Player } from '../src/stream/player';
import type { Track } from '../src/stream/track';
import { TimeLink } from '../src/ui/time_link';

const ENTRY = 600;  // Size of an entry without its message.

function entry(sequence: number, bytes = 400): Entry {
  return {
    sequence, time: sequence / 10, receivedAt: 0, bytes,
    summary: { area: 0, rings: 0, holes: 0, triangles: 0, trianglesGrid: 0, milliseconds: 0, stages: [],
               received: 0, drawn: 0, dropped: 0, latency: NaN },
    frame: () => { throw new Error('unused'); },
  };
}

function sequences(history: History): number[] {
  return Array.from({ length: history.size }, (_, k) => history.entry(k).sequence);
}

test('the oldest frames are evicted at the byte limit', () => {
  const history = new History(5 * (400 + ENTRY));
  for (let k = 1; k <= 20; ++k) assert.ok(history.insert(entry(k), Infinity));
  assert.deepEqual(sequences(history), [16, 17, 18, 19, 20]);
  assert.ok(history.bytes <= 5 * (400 + ENTRY));
});

test("frames from the player's position on are kept", () => {
  const history = new History(5 * (400 + ENTRY));
  for (let k = 1; k <= 5; ++k) history.insert(entry(k), Infinity);
  assert.ok(history.insert(entry(6), 2), 'frame 1 lies before the place');
  assert.ok(!history.insert(entry(7), 2), 'frame 2 is being looked at');
  assert.deepEqual(sequences(history), [2, 3, 4, 5, 6]);
});

test('late frames are inserted in order, once', () => {
  const history = new History(1 << 20);
  for (const k of [10, 11, 5, 6, 7, 6, 12]) assert.ok(history.insert(entry(k), Infinity));
  assert.deepEqual(sequences(history), [5, 6, 7, 10, 11, 12]);
});

test('late frames do not evict newer ones', () => {
  const history = new History(3 * (400 + ENTRY));
  for (const k of [10, 11, 12]) history.insert(entry(k), Infinity);
  assert.ok(!history.insert(entry(9), Infinity));
  assert.deepEqual(sequences(history), [10, 11, 12]);
});

test('a position between frames is the previous frame', () => {
  const history = new History(1 << 20);
  for (const k of [3, 5, 9]) history.insert(entry(k), Infinity);
  assert.equal(history.atOrBefore(8)?.sequence, 5);
  assert.equal(history.atOrBefore(2), null);
  assert.equal(history.after(5)?.sequence, 9);
  assert.equal(history.after(9), null);
  assert.equal(history.get(4), null);
});

test('a frame that does not fit evicts nothing', () => {
  const history = new History(5 * (400 + ENTRY));
  for (let k = 1; k <= 5; ++k) history.insert(entry(k), Infinity);
  assert.ok(!history.insert(entry(6, 1300), 2), 'without frame 1 it would still be too large');
  assert.deepEqual(sequences(history), [1, 2, 3, 4, 5]);
});

test('a frame larger than the whole limit is kept alone', () => {
  const history = new History(1000);
  history.insert(entry(1), Infinity);
  assert.ok(history.insert(entry(2, 5000), Infinity));
  assert.deepEqual(sequences(history), [2]);
});

test('a frame is found by its time', () => {
  const history = new History(1e6);
  assert.equal(history.nearestInTime(1), null);
  for (let k = 1; k <= 20; ++k) history.insert(entry(k), Infinity);
  const at = (time: number) => history.nearestInTime(time)?.sequence;
  assert.deepEqual([at(-1), at(0.62), at(0.3 + Number.EPSILON), at(9)], [1, 6, 3, 20]);
});

/** A track with the times of its frames. */
function track(live: boolean, times: number[]): Track {
  const history = new History(1e6);
  times.forEach((time, k) => history.insert({ ...entry(k + 1), time }, Infinity));
  const range = () => ({ first: 1, last: times.length });
  const player = new Player({ range, rate: () => 30, livePosition: () => times.length }, live);
  player.tick(0);
  return { player, history, entryAt: (sequence: number) => history.get(sequence) } as unknown as Track;
}

test('linked tracks show the time of the chosen one', () => {
  const slow = track(false, [0, 0.25, 0.5, 0.75, 1]);
  const fast = track(false, [0, 0.125, 0.25, 0.375, 0.5, 0.625]);
  const link = new TimeLink();
  slow.player.seek(3);
  link.refresh(slow, [slow, fast]);
  assert.deepEqual([fast.player.sequence, fast.player.mode, link.holds(fast)], [5, 'paused', true]);
  slow.player.seek(5);
  link.refresh(slow, [slow, fast]);
  assert.equal(fast.player.sequence, 6, 'its last frame');
  slow.player.seek(1);
  slow.player.play();
  link.refresh(slow, [slow, fast]);
  link.refresh(fast, [slow, fast]);
  assert.equal(fast.player.mode, 'playing', 'the chosen one goes on playing');
  assert.equal(slow.player.mode, 'paused');
  const held = slow.player.sequence;
  assert.ok(held !== null);
  link.choose(slow);
  assert.equal(slow.player.mode, 'playing');
  slow.player.seek(held);  // To the frame where it was held, before the next refresh.
  link.refresh(slow, [slow, fast]);
  assert.deepEqual([slow.player.mode, slow.player.sequence], ['paused', held], 'the user has paused it');
  fast.player.seek(1);
  link.refresh(fast, [slow, fast]);
  link.isOn = false;
  fast.player.seek(6);
  link.refresh(fast, [slow, fast]);
  assert.equal(slow.player.sequence, 1);
});

test('linked streams follow their newest frame again', () => {
  const one = track(true, [0, 1, 2]);
  const other = track(true, [0, 1, 2, 3]);
  const link = new TimeLink();
  link.refresh(one, [one, other]);
  assert.equal(other.player.mode, 'live');
  one.player.seek(2);
  link.refresh(one, [one, other]);
  assert.deepEqual([other.player.mode, other.player.sequence], ['paused', 2]);
  one.player.follow();
  link.refresh(one, [one, other]);
  assert.deepEqual([other.player.mode, link.holds(other)], ['live', false]);
});
