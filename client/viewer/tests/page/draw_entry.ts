import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import {
  CoordinateFormat, Plane, WatchStreamResponseSchema,
} from '@proto/v1/reconstruction_pb';
import { attachNavigation, DEFAULT_LOOK, Scene, type Look } from '../../src/draw/index';
import { rgb, theme } from '../../src/draw/colours';
import { rampStops } from '../../src/draw/ramp';
import { toCss } from '../../src/draw/view';
import { clip, png } from '../../src/export/index';
import { bytesOf } from '../../src/protocol/arrays';
import { decodeFrame } from '../../src/protocol/decode';
import { type Frame, NO_RING } from '../../src/protocol/frame';
import { blobs, makeFrame, type FrameOptions } from '../draw_frames';

/** Functions for draw.mjs. */
const canvas = document.querySelector('canvas') as HTMLCanvasElement;
const scene = new Scene(canvas);
let changes = 0;
let clicks = 0;
attachNavigation(canvas, scene, () => ++changes);
canvas.addEventListener('click', () => ++clicks);

/** Draws a whole frame in one look. */
function picture(look: Partial<Look>, frame: Frame = makeFrame()): void {
  scene.resize();
  scene.setLook({ ...DEFAULT_LOOK, ...look });
  scene.show(frame);
  scene.fit();
  scene.draw();
}

/** RGBA of every pixel, the lowest row first. */
function pixels(): Uint8Array {
  const gl = canvas.getContext('webgl2') as WebGL2RenderingContext;
  scene.draw();
  const read = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, read);
  return read;
}

/** Drawn colours at world positions. */
function coloursAt(places: [number, number][]): number[][] {
  const read = pixels();
  const ratio = canvas.width / scene.size.width;
  return places.map(([x, y]) => {
    const [cssX, cssY] = toCss(scene.view, scene.size, x, y);
    const column = Math.floor(cssX * ratio);
    const row = canvas.height - 1 - Math.floor(cssY * ratio);
    const at = 4 * (row * canvas.width + column);
    return Array.from(read.subarray(at, at + 3));
  });
}

/** Area covered by a colour on the background, in device pixels. */
function ink(colour: readonly number[], dark = false): number {
  const read = pixels();
  const ground = theme(dark).background.map((part) => 255 * part);
  // Measures the colour channel with the largest difference from the background.
  const apart = colour.map((part, k) => Math.abs(part - ground[k]));
  const k = apart.indexOf(Math.max(...apart));
  let sum = 0;
  for (let at = k; at < read.length; at += 4) sum += read[at] - ground[k];
  return sum / (colour[k] - ground[k]);
}

/** A frame of one ring without a mesh. */
function polygon(corners: [number, number][]): Frame {
  const frame = makeFrame({ cell: 1 });
  const perimeter = corners.reduce((sum, [x, y], k) => {
    const [nextX, nextY] = corners[(k + 1) % corners.length];
    return sum + Math.hypot(nextX - x, nextY - y);
  }, 0);
  return {
    ...frame,
    mesh: null,
    particles: null,
    rings: {
      points: Float32Array.from(corners.flat()),
      offsets: Uint32Array.of(0, corners.length),
      outerOf: Uint32Array.of(NO_RING),
      identities: BigUint64Array.of(1n),
      area: Float64Array.of(1),
      perimeter: Float64Array.of(perimeter),
      particles: Float64Array.of(1),
      parents: [[]],
      cuts: new Uint32Array(0),
      wetted: new Uint32Array(0), contacts: new Uint32Array(0), contactAngles: new Float32Array(0),
      normals: null,
      attributes: new Map(),
    },
  };
}

/** The message of a frame to a watcher. */
function message(frame: Frame): Uint8Array {
  const { rings, mesh } = frame;
  return toBinary(WatchStreamResponseSchema, create(WatchStreamResponseSchema, {
    response: {
      case: 'frame',
      value: {
        frame: {
          sequence: frame.sequence,
          coordinateFormat: CoordinateFormat.FLOAT32_RELATIVE,
          rings: {
            points: bytesOf(rings.points),
            offsets: bytesOf(rings.offsets),
            outerOf: bytesOf(rings.outerOf),
            identities: bytesOf(rings.identities),
            measures: Array.from(rings.area, (area, ring) => ({
              area, perimeter: rings.perimeter[ring], parentIdentities: rings.parents[ring],
            })),
          },
          mesh: mesh
            ? {
              points: bytesOf(mesh.points),
              triangles: bytesOf(mesh.triangles),
              classes: mesh.classes,
            }
            : undefined,
        },
      },
    },
  }));
}

function decoded(bytes: Uint8Array): Frame {
  const { response } = fromBinary(WatchStreamResponseSchema, bytes);
  if (response.case !== 'frame' || !response.value.frame) throw new Error('no frame');
  return decodeFrame(response.value.frame, bytes.length, performance.now(), Plane.XY);
}

/** Decodes a message that starts at an offset in its buffer. */
function sent(frame: Frame, shift: number): Frame {
  const bytes = message(frame);
  const buffer = new Uint8Array(bytes.length + shift);
  buffer.set(bytes, shift);
  return decoded(buffer.subarray(shift));
}

/** Size of a mesh, and main-thread milliseconds per frame. */
interface Times {
  points: number;
  triangles: number;
  bytes: number;
  decode: number[];
  show: number[];
  draw: number[];
}

/** Decodes, shows and draws a frame at each refresh of the screen. */
async function times(look: Partial<Look>, options: FrameOptions, count: number): Promise<Times> {
  const frames = [0, 1, 2, 3].map((k) => makeFrame({ ...options, level: blobs(0.1 * k) }));
  const messages = frames.map(message);
  const result: Times = {
    points: (frames[0].mesh?.points.length ?? 0) / 2,
    triangles: (frames[0].mesh?.triangles.length ?? 0) / 3,
    bytes: messages[0].length,
    decode: [],
    show: [],
    draw: [],
  };
  picture(look, frames[0]);
  for (let k = 0; k < count; ++k) {
    await new Promise(requestAnimationFrame);
    const begin = performance.now();
    const frame = decoded(messages[k % messages.length]);
    const decodedAt = performance.now();
    scene.show(frame);
    const shownAt = performance.now();
    scene.draw();
    result.draw.push(performance.now() - shownAt);
    result.show.push(shownAt - decodedAt);
    result.decode.push(decodedAt - begin);
  }
  return result;
}

/** Type, size and first bytes of an export. */
async function head(blob: Promise<Blob>): Promise<{ type: string; size: number; bytes: number[] }> {
  const one = await blob;
  const bytes = new Uint8Array(await one.slice(0, 4).arrayBuffer());
  return { type: one.type, size: one.size, bytes: Array.from(bytes) };
}

/** Records a clip of a moving view. */
async function film(refreshes: number): Promise<Blob> {
  const recording = clip(scene, () => []);
  recording.start();
  for (let k = 0; k < refreshes; ++k) {
    await new Promise(requestAnimationFrame);
    scene.view = { ...scene.view, x: scene.view.x + 0.05 };
    scene.draw();
  }
  return recording.stop();
}

/** Loses and restores the drawing context. */
async function loseContext(): Promise<void> {
  const gl = canvas.getContext('webgl2') as WebGL2RenderingContext;
  const extension = gl.getExtension('WEBGL_lose_context');
  const event = (name: string): Promise<Event> =>
    new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true }));
  const lost = event('webglcontextlost');
  extension?.loseContext();
  await lost;
  scene.show(makeFrame());
  scene.draw();
  const restored = event('webglcontextrestored');
  // The browser allows the context to be restored only after the event of the loss has been handled.
  setTimeout(() => extension?.restoreContext());
  await restored;
}

const bench = {
  scene, canvas, picture, pixels, coloursAt, ink, polygon, sent, times, head, film, loseContext,
  makeFrame, theme, rgb, rampStops, png: () => png(scene, []),
  changes: () => changes, clicks: () => clicks,
};
export type Bench = typeof bench;
Object.assign(window, { bench });
