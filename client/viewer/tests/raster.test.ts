// Tests of pictures of surfaces without WebGL: their geometry against projected points and rays, colours, redrawing.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { packed, type Rgb, unpacked } from '../src/draw/colours';
import { decodeSurface, type Surface } from '../src/protocol/surface';
import { CanvasDrawing } from '../src/space/canvas_drawing';
import {
  type Camera, DEFAULT_VIEW, distanceOf, minus, nearOf, plus, project, projectAll, rayAt, type Vector,
} from '../src/space/camera';
import { type Clip, heightsOf, nearOfClip } from '../src/space/clip';
import { SELECTED, type SpaceState, type ValueColours } from '../src/space/drawing';
import type { Skin } from '../src/space/facet';
import { DEFAULT_SPACE_LOOK } from '../src/space/look';
import { pickShell } from '../src/space/pick';
import { Raster } from '../src/space/raster';
import { plainMessage } from './surface_message';

const codec = { decodeVertexBuffer() {}, decodeIndexBuffer() {} };
const surfaceAt = (...centres: Vector[]) => decodeSurface(plainMessage(centres, 'FLOAT32'), codec);
const SIZE = { width: 64, height: 48 };
const [BLACK, WHITE, RED]: Rgb[] = [[0, 0, 0], [1, 1, 1], [1, 0, 0]];
/** From the front: x to the right, z up. */
const FRONT = { turn: -Math.PI / 2, tilt: 0 };

function cameraAt(target: Vector, isPerspective: boolean, view: object = {}): Camera {
  return { view: { ...DEFAULT_VIEW, target, height: 4, ...view }, isPerspective, size: SIZE };
}

/** A skin with light 1 everywhere. */
function skinOf(surface: Surface, camera: Camera, other: Partial<Skin> = {}): Skin {
  const count = surface.positions.length / 3;
  const ones = new Float32Array(count).fill(1);
  return {
    triangles: surface.triangles, at: projectAll(camera, surface.positions, surface.origin), isPerspective: camera.isPerspective,
    tints: new Uint8Array(Uint32Array.from(ones, () => packed(WHITE) & 0xffffff).buffer), values: null, map: null,
    lights: { outside: ones, inside: ones, shine: new Float32Array(count) }, flatLight: () => null, heights: null,
    hasCutFace: false, cutFaceLight: 0.8, opacity: 1, hasFill: true, halfEdge: 0, edgeOpacity: 1, edge: RED, accent: RED,
    missing: BLACK, ...other,
  };
}

function drawn(skin: Skin): Raster {
  const raster = new Raster();
  raster.begin(SIZE.width, SIZE.height, BLACK);
  raster.drawTriangles(skin);
  return raster;
}

/** The colour in the middle, each part from 0 to 255. */
function middleOf({ pixels }: Raster): number[] {
  return unpacked(pixels[SIZE.width * SIZE.height / 2 + SIZE.width / 2]).map((part) => Math.round(255 * part));
}

test('all points are projected as one is', () => {
  const { positions, origin } = surfaceAt([10, 20, 30], [13, 19, 31]);
  for (const isPerspective of [true, false]) {
    const camera = cameraAt([11, 20, 30], isPerspective);
    const at = projectAll(camera, positions, origin);
    for (let k = 0; k < at.x.length; ++k) {
      const one = project(camera, plus(origin, [positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]]));
      assert.ok(one && Math.hypot(one.x - at.x[k], one.y - at.y[k]) < 1e-4);
      assert.ok(Math.abs(nearOf(camera, one.nearer) - at.near[k]) < 1e-6);
    }
    const { near: [behind] } = projectAll({ ...camera, view: { ...camera.view, ...FRONT } }, Float32Array.of(0, -99, 0), [11, 20, 30]);
    assert.equal(Number.isNaN(behind), isPerspective);
  }
});

test('a pixel shows what a ray through its middle hits, at its depth', () => {
  const surface = surfaceAt([10, 20, 30], [10.8, 20.5, 30.4], [9, 21, 29]);
  const { origin } = surface;
  const middle: Vector = [10, 20.3, 30];
  const normal: Vector = [0.6, -0.8, 0];
  const clips: (Clip | null)[] = [null, { normal, at: 0.2 }, { normal: minus([0, 0, 0], normal), at: 0.1 }];
  for (const isPerspective of [true, false]) {
    for (const [k, clip] of clips.entries()) {
      for (const hasCutFace of k === 1 ? [false, true] : [false]) {
        const camera = cameraAt(middle, isPerspective, { turn: -0.9 + 0.3 * k, tilt: 0.3 });
        const raster = drawn(skinOf(surface, camera, { heights: heightsOf(surface.positions, clip), hasCutFace }));
        if (clip && hasCutFace) raster.closeCuts(nearOfClip(camera, clip, origin));
        let [hits, others] = [0, 0];
        for (let y = 0; y < SIZE.height; ++y) {
          for (let x = 0; x < SIZE.width; ++x) {
            const { from, along } = rayAt(camera, x + 0.5, y + 0.5);
            const hit = pickShell(surface, minus(from, origin), along, !isPerspective, clip, hasCutFace);
            const near = raster.near[y * SIZE.width + x];
            hits += Number(hit !== null);
            const seen = hit && project(camera, plus(origin, hit.point));
            const expected = seen ? nearOf(camera, seen.nearer) : -Infinity;
            // At silhouettes and at the rim of the cut, rounding decides.
            others += Number(!(near === expected || Math.abs(near - expected) < 1e-5 * distanceOf(camera.view)));
          }
        }
        assert.ok(hits > 300, `${hits} pixels`);
        assert.ok(others <= 3, `${others} of ${hits} pixels differ, clip ${k}`);
      }
    }
  }
});

test('tints, the selection, numbers and missing numbers colour triangles', () => {
  const surface = surfaceAt([10, 20, 30]);
  const camera = cameraAt([10, 20, 30], true, FRONT);
  const white = skinOf(surface, camera);
  assert.deepEqual(middleOf(drawn(white)), [255, 255, 255]);
  const selected = white.tints.map((part, k) => (k % 4 === 3 ? SELECTED.shell + SELECTED.body : part));
  assert.deepEqual(middleOf(drawn({ ...white, tints: selected })), [255, 97, 97]);
  const ofBody = white.tints.map((part, k) => (k % 4 === 3 ? SELECTED.body : part));
  assert.deepEqual(middleOf(drawn({ ...white, tints: ofBody })), [255, 255, 255], 'the cavity of the body');
  const texels = Uint8Array.from({ length: 1024 }, (_, k) => (k % 4 === 0 ? k >> 2 : 0));
  const map: ValueColours = { points: null, particles: null, min: 0, max: 2, texels };
  const mapped = (value: number) => middleOf(drawn({ ...white, map, values: new Float32Array(6).fill(value) }));
  assert.deepEqual([0, 1, 2, 9].map((value) => mapped(value)[0]), [0, 128, 255, 255]);
  assert.deepEqual(middleOf(drawn({ ...white, map, missing: [0, 1, 0], values: new Float32Array(6).fill(NaN) })), [0, 255, 0]);
});

test('the highlight brightens, insides are darker, a cut face has one light', () => {
  const surface = surfaceAt([10, 20, 30]);
  const camera = cameraAt([10, 20, 30], false, FRONT);
  const grey = { tints: new Uint8Array(24).map((_, k) => (k % 4 === 3 ? 0 : 100)) };
  const lights = (outside: number, shine: number) => ({
    outside: new Float32Array(6).fill(outside), inside: new Float32Array(6).fill(0.5), shine: new Float32Array(6).fill(shine),
  });
  assert.deepEqual(middleOf(drawn(skinOf(surface, camera, { ...grey, lights: lights(0.5, 0.2) }))), [101, 101, 101], 'half of 100 and a fifth of 255');
  const flat = skinOf(surface, camera, { ...grey, flatLight: () => [0.7, 0] });
  assert.deepEqual(middleOf(drawn(flat)), [70, 70, 70]);
  // The plane cuts the front half away.
  const heights = heightsOf(surface.positions, { normal: [0, -1, 0], at: -20 + surface.origin[1] });
  const opened = skinOf(surface, camera, { ...grey, lights: lights(1, 1), heights });
  assert.deepEqual(middleOf(drawn(opened)), [31, 31, 31], '0.62 of half the light');
  assert.deepEqual(middleOf(drawn({ ...opened, hasCutFace: true })), [80, 80, 80]);
});

test('edges, wire frames and translucent surfaces show what is behind them', () => {
  const surface = surfaceAt([10, 20, 30]);
  const camera = cameraAt([10, 20, 30], false, { ...FRONT, turn: -1.2, tilt: 0.2 });
  const count = (raster: Raster, colour: Rgb) => raster.pixels.filter((pixel) => pixel === packed(colour)).length;
  const filled = skinOf(surface, camera, { halfEdge: 1 });
  const all = count(drawn({ ...filled, halfEdge: 0 }), WHITE);
  const red = count(drawn(filled), RED);
  assert.ok(red > 60 && red < all);
  assert.equal(count(drawn(filled), WHITE), all - red);
  const wires = drawn({ ...filled, hasFill: false });
  assert.ok(count(wires, RED) > red, 'the edges of the far side, too');
  assert.ok(wires.near.every((near) => near === -Infinity), 'they hide nothing');
  const glass = middleOf(drawn(skinOf(surface, camera, { opacity: 0.5 })));
  // The inside has 0.62 of the light: half of it, then half of that and of 255.
  assert.ok(Math.abs(glass[0] - (0.62 * 255 / 4 + 255 / 2)) < 2, `${glass}`);
});

test('dots are hidden by surfaces, and hide farther dots', () => {
  const surface = surfaceAt([10, 20, 30]);
  const camera = cameraAt([10, 20, 30], true, FRONT);
  const places = (...ys: number[]) => Float32Array.from(ys.flatMap((y) => [0, y, 0]));
  const dots = (positions: Float32Array, colour: Rgb) => ({
    at: projectAll(camera, positions, [10, 20, 30]), diameterOf: () => 9, values: null, map: null, heights: null, colour, missing: BLACK,
  });
  const raster = drawn(skinOf(surface, camera));
  raster.drawDots(dots(places(2), RED));
  assert.deepEqual(middleOf(raster), [255, 255, 255], 'behind the body');
  raster.drawDots(dots(places(-2), RED));
  raster.drawDots(dots(places(-1.5), WHITE));
  const [red, green] = middleOf(raster);
  assert.ok(red > 240 && green === 0);
  const [x, y] = [SIZE.width / 2 + 0.5, SIZE.height / 2 + 0.5];
  const nearAt = (nearer: number) => nearOf(camera, nearer);
  assert.deepEqual([nearAt(1.9), nearAt(2.1)].map((near) => raster.shows(x, y, near)), [false, true]);
  assert.equal(raster.shows(-1, y, 1), false);
});

const state = (view: object = {}): SpaceState => ({
  camera: cameraAt([10, 20, 30], true, view), look: DEFAULT_SPACE_LOOK, hasSurface: true, hasEdges: false, hasParticles: false,
  theme: { background: BLACK, edge: RED, particle: RED, accent: RED, missing: BLACK, ambient: 0.3 },
  spacing: 1, lineWidth: 2, clip: null, cutFace: null, values: null, ratio: 1, near: 1, far: 9, origin: [10, 20, 30],
});

test('a moving picture is coarse, a still one fine, and the same one is drawn once', (context) => {
  context.mock.timers.enable({ apis: ['setTimeout'] });
  Object.assign(globalThis, {
    ImageData: class { constructor(readonly data: Uint8ClampedArray, readonly width: number) {} }, Path2D: class { moveTo() {} lineTo() {} },
  });
  const widths: number[] = [];
  const strokes: number[] = [];
  const pen = {
    globalAlpha: 1, putImageData: ({ width, data }: ImageData) => {
      assert.ok(data.some((part) => part > 0 && part < 255), 'a lit surface');
      widths.push(width);
    },
    stroke() { strokes.push(this.globalAlpha); },
  };
  const canvas = { width: 0, height: 0, getContext: () => pen } as unknown as HTMLCanvasElement;
  const drawing = new CanvasDrawing(canvas);
  const surface = surfaceAt([10, 20, 30]);
  drawing.show(surface);
  drawing.setTints(new Uint8Array(24).fill(200));
  drawing.draw(state());
  drawing.draw(state());
  assert.deepEqual(widths, [64]);
  drawing.draw(state({ turn: 1 }));
  context.mock.timers.tick(1000);
  assert.deepEqual(widths, [64, 64, 128]);
  assert.equal(canvas.width, 128);
  drawing.draw(state({ turn: 1 }));
  assert.equal(widths.length, 3);
  drawing.setSections([{ positions: Float32Array.of(0, -3, 0, 1, -3, 0), colour: RED, isBorder: false }]);
  drawing.draw(state({ turn: 1 }));
  assert.deepEqual([widths.length, strokes], [4, [0.35, 1]]);
  drawing.destroy();
  context.mock.timers.tick(1000);
  assert.equal(widths.length, 4);
});

test('a browser without canvases is named', () => {
  const canvas = { getContext: () => null } as unknown as HTMLCanvasElement;
  assert.throws(() => new CanvasDrawing(canvas), /neither WebGL 2 nor canvases\.$/);
});
