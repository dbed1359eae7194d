import assert from 'node:assert/strict';
import test from 'node:test';
import { Player, type Range } from '../src/stream/player';
import { PlayoutClock } from '../src/stream/playout_clock';

test('bursts of frames are drawn evenly', () => {
  const clock = new PlayoutClock(100);
  // Frames arrive at fifty per second, in bursts of five.
  const shown: number[] = [];
  let sequence = 0;
  for (let now = 0; now < 4000; now += 10) {
    if (now % 100 === 0) for (let k = 0; k < 5; ++k) clock.arrived(++sequence, now);
    const position = clock.position(now);
    if (now >= 2000 && position !== null) shown.push(position);
  }
  const steps = shown.slice(1).map((position, k) => position - shown[k]);
  assert.ok(steps.every((step) => step >= 0), 'never back');
  assert.ok(Math.max(...steps) <= 2, `at most two frames in 10 ms, not ${Math.max(...steps)}`);
  const perSecond = (shown[shown.length - 1] - shown[0]) / (shown.length * 0.01);
  assert.ok(Math.abs(perSecond - 50) < 3, `${perSecond} frames a second`);
});

test('drawing follows arrivals at the latency', () => {
  const clock = new PlayoutClock(100);
  for (let k = 0; k <= 100; ++k) clock.arrived(k, 10 * k);
  assert.ok(Math.abs((clock.position(1000) ?? NaN) - 90) < 0.5);
  assert.equal(clock.position(5000), 100, 'the newest is the last that there is');
});

test('the clock adapts after a pause', () => {
  const clock = new PlayoutClock(100);
  for (let k = 0; k < 50; ++k) clock.arrived(k, 20 * k);
  for (let k = 50; k < 100; ++k) clock.arrived(k, 10_000 + 10 * k);
  assert.ok(Math.abs(clock.rate - 100) < 1, `${clock.rate}`);
});

test('no frame is drawn after a later one', () => {
  const clock = new PlayoutClock(100);
  clock.passed(10);
  assert.equal(clock.position(0), 10, 'a frame of the history is drawn at once');
  clock.arrived(11, 10);
  assert.equal(clock.position(10), 10, 'the first arrival does not take the position back');
  assert.equal(clock.position(200), 11);
  clock.arrived(12, 5000);
  assert.equal(clock.position(5000), 11, 'nor does an arrival after a long pause');
  assert.equal(clock.position(5200), 12);
  clock.arrived(1, 5300);
  assert.ok((clock.position(5300) ?? NaN) <= 1, 'a stream that starts again does');
});

function player(range: Range | null, live = true): Player {
  return new Player({ range: () => range, rate: () => 10, livePosition: () => range?.last ?? null }, live);
}

test('pause, play and follow move the position', () => {
  const range = { first: 1, last: 100 };
  const it = player(range);
  assert.equal(it.tick(0), 100);
  it.pause();
  range.last = 200;
  assert.equal(it.tick(1000), 100);
  it.play();
  assert.equal(it.tick(2000), 110, 'ten frames a second');
  it.follow();
  assert.equal(it.tick(2100), 200);
});

test('a pause in a gap stays at the visible frame', () => {
  const it = player({ first: 0, last: 30 });
  it.tick(0);
  it.pause(22);
  it.tick(100);
  assert.deepEqual([it.mode, it.sequence], ['paused', 22]);
});

test('double speed catches up, then follows', () => {
  const it = player({ first: 1, last: 100 });
  it.tick(0);
  it.seek(90);
  it.speed = 2;
  it.play();
  assert.equal(it.tick(500), 100);
  it.tick(1000);
  assert.equal(it.mode, 'live');
});

test('files stop at their last frame or loop', () => {
  const it = player({ first: 1, last: 20 }, false);
  it.tick(0);
  it.tick(5000);
  assert.deepEqual([it.mode, it.sequence], ['paused', 20]);
  it.loop = true;
  it.play();
  assert.equal(it.sequence, 1, 'from the end, from the beginning');
  it.tick(6950);
  it.tick(7100);
  assert.deepEqual([it.mode, it.sequence], ['playing', 1]);
});

test('seek stays within the range', () => {
  const it = player({ first: 5, last: 20 });
  it.seek(1);
  assert.equal(it.sequence, 5);
  it.seek(99);
  assert.equal(it.sequence, 20);
  assert.equal(it.mode, 'paused');
});

test('an evicted position moves to the oldest frame', () => {
  const range = { first: 1, last: 50 };
  const it = player(range);
  it.seek(3);
  it.play();
  range.first = 30;
  it.tick(0);
  assert.equal(it.sequence, 30);
});
