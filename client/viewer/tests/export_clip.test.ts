// The recording of clips, with a recorder and a canvas that stand in for the browser's.
import assert from 'node:assert/strict';
import { afterEach, beforeEach, test } from 'node:test';
import { clip } from '../src/export/clip';
import type { Drawn } from '../src/export/canvas_copy';
import { clipButton } from '../src/ui/export_panel';

let formats: string[];
let copies: number;
let copied: { width: number; height: number };

class Recorder {
  static isTypeSupported(format: string): boolean { return formats.includes(format); }
  ondataavailable: (event: { data: string }) => void = () => {};
  onstop: () => void = () => {};
  onerror: () => void = () => {};
  readonly stream = { getTracks: () => [{ stop: () => {} }] };

  constructor(_: unknown, readonly options: { mimeType: string }) {}

  start(): void {}

  stop(): void {
    this.ondataavailable({ data: `a video of ${this.options.mimeType}` });
    this.onstop();
  }
}

const context = new Proxy({}, { get: () => () => {}, set: () => true });
const browser = {
  MediaRecorder: Recorder,
  document: {
    createElement: () => {
      const canvas = { width: 0, height: 0, getContext: () => context, captureStream: () => ({}) };
      copied = canvas;
      return canvas;
    },
  },
};

beforeEach(() => {
  formats = ['video/webm;codecs=vp8', 'video/webm'];
  copies = 0;
  Object.assign(globalThis, browser);
});
afterEach(() => {
  for (const name of Object.keys(browser)) delete (globalThis as Record<string, unknown>)[name];
});

function scene(isOnCanvas = true): Drawn {
  return {
    isOnCanvas, drawn: null, draw: () => {}, size: { width: 400, height: 300 },
    canvas: { width: 400, height: 300 } as unknown as HTMLCanvasElement,
  };
}

test('a clip has a picture for every drawing, in the best format', async () => {
  const drawn = scene();
  const recording = clip(drawn, () => {
    ++copies;
    return [];
  });
  recording.start();
  assert.equal(copies, 1, 'the first picture');
  drawn.drawn?.();
  drawn.drawn?.();
  assert.equal(copies, 3);
  const video = await recording.stop();
  assert.equal(video.type, 'video/webm');
  assert.match(await video.text(), /vp8/);
  assert.equal(drawn.drawn, null);
});

test('coarse pictures do not change the pixels of a clip, another size of the page does', async () => {
  const drawn = scene();
  const resize = (canvas: HTMLCanvasElement | Drawn['size'], width: number, height: number) =>
    Object.assign(canvas, { width, height });
  resize(drawn.canvas, 800, 600);
  const recording = clip(drawn, () => []);
  recording.start();
  assert.deepEqual([copied.width, copied.height], [800, 600]);
  resize(drawn.canvas, 400, 300);
  drawn.drawn?.();
  assert.deepEqual([copied.width, copied.height], [800, 600]);
  resize(drawn.size, 200, 100);
  resize(drawn.canvas, 200, 100);
  drawn.drawn?.();
  assert.deepEqual([copied.width, copied.height], [200, 100]);
  await recording.stop();
});

test('a clip is recorded once at a time', async () => {
  const recording = clip(scene(), () => []);
  await assert.rejects(recording.stop(), /No clip/);
  recording.start();
  assert.throws(() => recording.start(), /already/);
  await recording.stop();
  recording.start();
  await recording.stop();
});

test('a browser that cannot record says so', () => {
  formats = [];
  assert.throws(() => clip(scene(), () => []).start(), /cannot record WebM/);
  assert.throws(() => clip(scene(false), () => []), /without WebGL/);
});

test('the button records, or stops a recording', () => {
  assert.deepEqual(clipButton(false, true),
    { text: 'Record clip', title: 'Records the picture as a video until the next click.', isDisabled: false });
  const running = clipButton(true, false);
  assert.equal(running.text, 'Stop and save');
  assert.equal(running.isDisabled, false, 'also while a picture without WebGL is chosen');
  const missing = clipButton(false, false);
  assert.ok(missing.isDisabled && /Save the picture as SVG/.test(missing.title));
});
