// When the page writes the texts of frames.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { TextPace } from '../src/ui/text_pace';

const live = { player: { mode: 'live' } as const };
const paused = { player: { mode: 'paused' } as const };

/** Refreshes of a screen with 50 a second, in which a stream with a new frame every `every` ms writes its texts. */
function written(every: number): number[] {
  const pace = new TextPace();
  const times: number[] = [];
  let shown = -1;
  for (let now = 0; now < 1000; now += 20) {
    pace.begin(now);
    const frame = Math.floor(now / every);
    if (frame === shown || !pace.isDueFor(live)) continue;
    shown = frame;
    times.push(now);
    pace.written();
  }
  return times;
}

test('a fast stream writes its texts every 100 ms', () => {
  assert.deepEqual(written(5), [0, 100, 200, 300, 400, 500, 600, 700, 800, 900]);
});

test('a slow stream writes its texts with each frame', () => {
  assert.deepEqual(written(240), [0, 240, 480, 720, 960]);
});

test('all texts of a refresh are due together, and those of a paused track always', () => {
  const pace = new TextPace();
  pace.begin(1000);
  pace.written();
  assert.ok(pace.isDueFor(live));
  pace.begin(1020);
  assert.ok(!pace.isDueFor(live));
  assert.ok(pace.isDueFor(paused));
});
