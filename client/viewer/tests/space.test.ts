// Tests of the picture of surfaces: camera, keys, picking, axes, selection, sections, look.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DEFAULT_LOOK, type Look } from '../src/draw/look';
import { decodeSurface } from '../src/protocol/surface';
import type { Frame } from '../src/protocol/frame';
import { inPlane, inSpace } from '../src/protocol/sections';
import { axesDrawing } from '../src/space/axes';
import {
  axesOf, type Camera, cornersOf, DEFAULT_VIEW, fitBox, panBy, parseSpaceView, pointAt, project, rayAt, type SpaceView, turnBy,
  type Vector, viewText, zoomAt,
} from '../src/space/camera';
import { clipOf, cutFaceOf } from '../src/space/clip';
import { DEFAULT_SPACE_LOOK, parseSpaceLook, type SpaceLook, spaceLookText } from '../src/space/look';
import { applySpaceKey } from '../src/space/navigation';
import { pickShell } from '../src/space/pick';
import { SELECTED, type SpaceDrawing, type SpaceState } from '../src/space/drawing';
import { boxOf, spaceFrameOf, SpaceScene } from '../src/space/scene';
import { cornersInPlane, planeBorders, sectionLines } from '../src/space/sections';
import { type PlacedShells, shellAt, shellsByPlace } from '../src/space/shells';
import { plainMessage } from './surface_message';

const size = { width: 800, height: 600 };
const view: SpaceView = { target: [3, -2, 1], turn: 0.7, tilt: 0.3, height: 10 };
const cameras = [true, false].map((isPerspective): Camera => ({ view, isPerspective, size }));
const codec = { decodeVertexBuffer() {}, decodeIndexBuffer() {} };
const surfaceAt = (...centres: Vector[]) => decodeSurface(plainMessage(centres), codec);
const isNear = (a: readonly number[], b: readonly number[], within = 1e-9) =>
  assert.ok(a.every((value, k) => Math.abs(value - b[k]) <= within), `${a} is not ${b}`);

test('the target is in the middle, and x is to the right of a camera in front', () => {
  for (const camera of cameras) {
    const at = project(camera, view.target);
    isNear([at?.x ?? NaN, at?.y ?? NaN], [400, 300]);
    const front: Camera = { ...camera, view: { ...view, turn: -Math.PI / 2, tilt: 0 } };
    const [right, up] = [project(front, [4, -2, 1]), project(front, [3, -2, 2])];
    isNear([right?.x ?? NaN, right?.y ?? NaN, up?.x ?? NaN, up?.y ?? NaN], [460, 300, 400, 240]);
  }
});

test('a ray meets the point under the pointer', () => {
  for (const camera of cameras) {
    const { from, along } = rayAt(camera, 123, 456);
    for (const share of [0.5, 1, 1.4]) {
      const at = project(camera, [0, 1, 2].map((k) => from[k] + share * along[k]) as unknown as Vector);
      isNear([at?.x ?? NaN, at?.y ?? NaN], [123, 456], 1e-6);
    }
  }
});

test('a zoom keeps the point under the pointer, a pan moves by pixels', () => {
  for (const camera of cameras) {
    const point = pointAt(camera, 150, 500);
    const zoomed = { ...camera, view: zoomAt(camera, 150, 500, 3) };
    assert.equal(zoomed.view.height, 10 / 3);
    const at = project(zoomed, point);
    isNear([at?.x ?? NaN, at?.y ?? NaN], [150, 500], 1e-6);
    const moved = project({ ...camera, view: panBy(camera, 30, -20) }, view.target);
    isNear([moved?.x ?? NaN, moved?.y ?? NaN], [430, 280], 1e-6);
  }
});

test('the content bounds the zoom, and a view beyond the bounds only comes back', () => {
  const content = { low: [0, 0, 0], high: [3, 4, 0] } as { low: Vector; high: Vector };
  for (const camera of cameras) {
    const zoomed = (height: number, factor: number) =>
      zoomAt({ ...camera, view: { ...view, height } }, 150, 500, factor, content).height;
    assert.equal(zoomed(10, 1e9), 5e-4);
    assert.equal(zoomed(10, 1e-9), 500);
    assert.equal(zoomed(10, 2), 5);
    assert.equal(zoomed(1e-6, 2), 1e-6);
    assert.equal(zoomed(1e-6, 0.5), 2e-6);
    assert.equal(zoomed(1e6, 0.5), 1e6);
    assert.equal(zoomed(1e6, 2), 5e5);
  }
});

test('a drag turns, and stops above the target', () => {
  const turned = turnBy(view, size, 60, 0);
  isNear([turned.turn, turned.tilt], [view.turn - Math.PI / 10, view.tilt]);
  assert.equal(turnBy(view, size, 0, 1e6).tilt, Math.PI / 2);
  assert.equal(turnBy(view, size, 0, -1e6).tilt, -Math.PI / 2);
});

test('a fitted box is in the picture, and fills it', () => {
  for (const box of [{ low: [0, 0, 0], high: [1, 2, 3] }, { low: [-5, 0, 0], high: [5, 0.1, 0.1] }] as { low: Vector; high: Vector }[]) {
    for (const camera of cameras) {
      for (const turn of [0, 1, 2.5]) {
        const fitted = { ...camera, view: fitBox({ ...camera, view: { ...view, turn } }, box) };
        const shares = cornersOf(box).map((corner) => {
          const at = project(fitted, corner);
          assert.ok(at);
          return Math.max(Math.abs(at.x - 400) / 400, Math.abs(at.y - 300) / 300);
        });
        assert.ok(Math.max(...shares) < 1 && Math.max(...shares) > 0.8, `${shares}`);
      }
    }
  }
});

test('keys turn, pan, zoom and fit', () => {
  let fits = 0;
  const scene = { view: { ...view }, extent: null, get camera(): Camera { return { view: this.view, isPerspective: true, size }; }, fit() { ++fits; } };
  assert.ok(applySpaceKey(scene, 'ArrowLeft', false));
  assert.notEqual(scene.view.turn, view.turn);
  assert.ok(applySpaceKey(scene, 'ArrowLeft', true));
  assert.notDeepEqual(scene.view.target, view.target);
  assert.ok(applySpaceKey(scene, '+', false) && scene.view.height < 10);
  assert.ok(applySpaceKey(scene, '0', false) && fits === 1);
  assert.equal(applySpaceKey(scene, 'x', false), false);
});

test('a view and a look survive an address', () => {
  assert.deepEqual(parseSpaceView(viewText(view)), view);
  for (const text of ['', '1,2,3', '1,2,3,4,5,0', '1,2,3,4,5,x']) assert.equal(parseSpaceView(text), null);
  assert.equal(parseSpaceView('1,2,3,4,0,1e300')?.height, 1e30, 'the camera stays within reach');
  assert.equal(spaceLookText(DEFAULT_SPACE_LOOK), '');
  const look: SpaceLook = {
    shading: 'flat', isTranslucent: true, isPerspective: false, clipAxis: 'y', clipHeld: null, clipAt: 0.25,
    isClipFlipped: true, hasCutFaces: false, hasPlanes: true,
  };
  assert.deepEqual(parseSpaceLook(spaceLookText(look)), look);
  for (const clipHeld of [null, [0.6, 0, -0.8] as const]) {
    const across: SpaceLook = { ...DEFAULT_SPACE_LOOK, clipAxis: 'view', clipHeld };
    assert.deepEqual(parseSpaceLook(spaceLookText(across)), across);
  }
  assert.deepEqual(parseSpaceLook('clip:w:7,nonsense,held:1:0:0'), DEFAULT_SPACE_LOOK);
  for (const held of ['held', 'held:1:2', 'held:9:9:9', 'held:x:0:1']) {
    assert.deepEqual(parseSpaceLook(`clip:view:0.5,${held}`), { ...DEFAULT_SPACE_LOOK, clipAxis: 'view' }, held);
  }
});

test('the nearest shell that is not cut away is picked', () => {
  const surface = surfaceAt([0, 0, 0], [5, 0, 0]);
  const from: Vector = [-9 - surface.origin[0], 0.1, 0.1];
  const pick = (along: Vector, isLine = false, at: number | null = null) =>
    pickShell(surface, from, along, isLine, at === null ? null : { normal: [-1, 0, 0], at: -at + surface.origin[0] });
  const hit = pick([1, 0, 0]);
  assert.equal(hit?.shell, 0);
  isNear([(hit?.point[0] ?? NaN) + surface.origin[0]], [-0.8], 1e-6);
  assert.equal(pick([1, 0, 0], false, 2)?.shell, 1, 'a plane at x = 2 cuts the first body away');
  assert.equal(pick([1, 0, 0], false, 0)?.shell, 0, 'a plane through a body shows its inside');
  assert.equal(pick([-1, 0, 0]), null);
  assert.equal(pick([-1, 0, 0], true)?.shell, 1, 'a line goes both ways, and the nearest is the last one');
  assert.equal(pick([0, 1, 0]), null);
});

const clipped = (look: Partial<SpaceLook>): SpaceLook => ({ ...DEFAULT_SPACE_LOOK, clipAt: 0.25, ...look });
const cuboid = { low: [2, 0, 0], high: [6, 1, 2] } as const;

test('a clip plane lies across an axis, the view, or a held direction', () => {
  const cutOf = (look: Partial<SpaceLook>) => clipOf(clipped(look), view, cuboid, [1, 0, 0]);
  assert.equal(cutOf({}), null);
  assert.deepEqual(cutOf({ clipAxis: 'x' }), { normal: [1, 0, 0], at: 2 });
  assert.deepEqual(cutOf({ clipAxis: 'x', isClipFlipped: true }), { normal: [-1, 0, 0], at: -2 });
  const { back } = axesOf(view);
  const heights = cornersOf(cuboid).map(([x, y, z]) => (x - 1) * back[0] + y * back[1] + z * back[2]);
  const across = cutOf({ clipAxis: 'view' });
  isNear(across?.normal ?? [], back);
  isNear([across?.at ?? NaN], [0.75 * Math.min(...heights) + 0.25 * Math.max(...heights)]);
  isNear(cutOf({ clipAxis: 'view', clipHeld: [0, 0.6, 0.8] })?.normal ?? [], [0, 0.6, 0.8]);
});

test('a cut face is seen from the side that is cut away', () => {
  const origin: Vector = [1, 0, 0];
  for (const isPerspective of [true, false]) {
    for (const [turn, isClipFlipped, isSeen] of [[0, false, true], [0, true, false], [Math.PI, false, false], [Math.PI, true, true]] as const) {
      const camera: Camera = { view: { ...view, turn, tilt: 0 }, isPerspective, size };
      const faceOf = (look: Partial<SpaceLook>) => {
        const whole = clipped({ clipAxis: 'x', isClipFlipped, ...look });
        return cutFaceOf(clipOf(whole, camera.view, cuboid, origin), whole, camera, cuboid, origin);
      };
      const face = faceOf({});
      assert.equal(face !== null, isSeen, `${turn} ${isClipFlipped} ${isPerspective}`);
      assert.equal(faceOf({ hasCutFaces: false }), null);
      assert.equal(faceOf({ isTranslucent: true }), null);
      if (!face) continue;
      isNear(face.middle, [2, 0.5, 1]);
      assert.ok(face.halfWidth > Math.hypot(4, 1, 2) / 2);
    }
  }
});

test('a ray hits the cut face of a body, also in front of its cavity', () => {
  const surface = surfaceAt([0, 0, 0], [5, 0, 0]);
  const clip = { normal: [-1, 0, 0] as const, at: surface.origin[0] };
  const from: Vector = [-9 - surface.origin[0], 0.1, 0.1];
  const pick = (along: Vector, hasCutFace: boolean, isLine = false) => pickShell(surface, from, along, isLine, clip, hasCutFace);
  isNear([(pick([1, 0, 0], false)?.point[0] ?? NaN) + surface.origin[0]], [0.8], 1e-6);
  for (const isLine of [false, true]) {
    isNear([(pick([1, 0, 0], true, isLine)?.point[0] ?? NaN) + surface.origin[0]], [0], 1e-6);
  }
  const beside = pickShell(surface, [from[0], 0.1, 0.1], [5, 0.95, 0], false, clip, true);
  assert.equal(beside, null, 'the plane is empty there');
  const outside = pickShell({ ...surface, triangles: surface.triangles.map((corner) => corner % 6 + 6) }, from, [1, 0, 0], false, clip, true);
  isNear([(outside?.point[0] ?? NaN) + surface.origin[0]], [4.2], 1e-6);
  const cavity = { ...surface, outerOf: Uint32Array.of(1, surface.outerOf[1]) };
  assert.equal(pickShell(cavity, from, [1, 0, 0], false, clip, true)?.shell, 1);
});

test('axes lie at the border of the box and have numbers', () => {
  for (const camera of cameras) {
    const box = { low: [0, 0, 0], high: [10, 10, 10] } as const;
    const fitted = { ...camera, view: fitBox({ ...camera, view: { ...DEFAULT_VIEW } }, box) };
    const { lines, texts } = axesDrawing(fitted, box);
    assert.ok(['x', 'y', 'z'].every((name) => texts.some(({ text }) => text === name)));
    assert.ok(texts.length > 6 && lines.length > 9);
    const left = Math.min(...cornersOf(box).map((corner) => project(fitted, corner)?.x ?? NaN));
    const z = texts.find(({ text }) => text === 'z');
    assert.ok(z && z.x < left + 1, 'z is at the left');
  }
});

const frame = (sequence: number): Frame => ({ sequence: BigInt(sequence), sections: [], statistics: { spacing: 1 } }) as unknown as Frame;

test('a selected body is followed through a merge, also over missed frames', () => {
  const canvas = { clientWidth: 0, clientHeight: 0 } as HTMLCanvasElement;
  const shown = (sequence: number, identities: bigint[], parents: bigint[][], ...centres: Vector[]) => {
    const surface = surfaceAt(...centres);
    surface.identities = BigUint64Array.from(identities);
    surface.measures.parents = parents;
    return spaceFrameOf(frame(sequence), surface);
  };
  for (const next of [2, 5]) {
    const scene = new SpaceScene(canvas);
    scene.show(shown(1, [1n, 2n], [[], []], [0, 0, 0], [3, 0, 0]), []);
    scene.select(2n);
    assert.deepEqual(scene.selectedShells, [1]);
    scene.show(shown(next, [7n, 1n], [[1n, 2n], []], [3, 0, 0], [9, 0, 0]), []);
    assert.deepEqual(scene.selectedShells, [0], `frame ${next}`);
    scene.show(shown(1, [1n, 2n], [[], []], [0, 0, 0], [3, 0, 0]), []);
    assert.deepEqual(scene.selectedShells, [1], 'back in the first frame');
  }
});

/** Shells with cubic boxes of width 2. */
function cubesAt(centres: readonly Vector[], firstIdentity: number, origin: [number, number, number] = [0, 0, 0]): PlacedShells {
  const boxes = centres.flatMap((centre) => [-1, 1].flatMap((side) => centre.map((at, axis) => at - origin[axis] + side)));
  return {
    origin, boxes: Float32Array.from(boxes), outerOf: new Uint32Array(centres.length),
    identities: BigUint64Array.from(centres, (_, k) => BigInt(firstIdentity + k)),
  };
}

test('the shell at a place is the smallest one around it', () => {
  const shells = cubesAt([[0, 0, 0], [5, 0, 0]], 1, [100, 0, 0]);
  const around: PlacedShells = { ...shells, outerOf: new Uint32Array(3), boxes: Float32Array.of(-999, -9, -9, 9, 9, 9, ...shells.boxes) };
  assert.equal(shellAt(around, [0.5, 0.5, 0.5]), 1);
  assert.equal(shellAt(around, [5.5, 0.5, 0.5]), 2);
  assert.equal(shellAt(around, [2, 0, 0]), 0);
  assert.equal(shellAt(shells, [1.001, 0, 0]), null);
  assert.equal(shellAt(shells, [1.001, 0, 0], 1e-3), 0, 'within the rounding');
});

test('a spray is searched for the selected body once', () => {
  const count = 500;
  let reads = 0;
  const spray = (firstIdentity: number): PlacedShells => {
    const shells = cubesAt(Array.from({ length: count }, (_, k): Vector => [4 * k, 0, 0]), firstIdentity);
    const get = (boxes: Float32Array, at: string | symbol): unknown => {
      ++reads;
      return Reflect.get(boxes, at);
    };
    return { ...shells, boxes: new Proxy(shells.boxes, { get }) };
  };
  assert.deepEqual(shellsByPlace(spray(1), [7], spray(1e6)), [7]);
  // A comparison of all pairs of bodies reads more than count * count numbers.
  assert.ok(reads < 40 * count, `${reads} reads`);
});

const hiddenCanvas = { clientWidth: 0, clientHeight: 0 } as HTMLCanvasElement;

test('a refused frame keeps the box of the frames before it', () => {
  const scene = new SpaceScene(hiddenCanvas);
  scene.show(spaceFrameOf(frame(1), surfaceAt([0, 0, 0])), []);
  const { extent } = scene;
  scene.show(null, []);
  scene.show(spaceFrameOf(frame(2), surfaceAt([0, 0, 0.5])), []);
  assert.deepEqual(extent, { low: [-1, -1, -1], high: [1, 1, 1] });
  assert.deepEqual(scene.extent, { low: [-1, -1, -1], high: [1, 1, 1.5] });
  scene.clear();
  assert.equal(scene.extent, null);
});

test('particles are coloured only by numbers of each of them', () => {
  Object.assign(globalThis, { devicePixelRatio: 1 });
  const surface = { ...surfaceAt([0, 0, 0]), particles: new Float32Array(9) };
  for (const [count, isColoured] of [[3, true], [2, false]] as const) {
    const particleAttributes = new Map([['p', new Float32Array(count)]]);
    const scene = new SpaceScene(hiddenCanvas);
    const states: SpaceState[] = [];
    const drawing = { show() {}, setTints() {}, setSections() {}, draw: (state: SpaceState) => { states.push(state); }, destroy() {} };
    scene.attach(drawing satisfies SpaceDrawing);
    scene.setLook({ ...DEFAULT_LOOK, colour: 'p' }, DEFAULT_SPACE_LOOK);
    scene.show(spaceFrameOf({ ...frame(1), particleAttributes }, surface), []);
    scene.draw();
    assert.equal(states[0].values?.points?.length, 6);
    assert.equal(states[0].values?.particles !== null, isColoured, `${count} numbers for 3 particles`);
  }
});

test('a look recomputes only the tints and sections it changes', () => {
  const scene = new SpaceScene(hiddenCanvas);
  let [tints, sections] = [0, 0];
  const drawing = { show() {}, setTints: () => { ++tints; }, setSections: () => { ++sections; }, draw() {}, destroy() {} };
  scene.attach(drawing satisfies SpaceDrawing);
  scene.show(spaceFrameOf(frame(1), surfaceAt([0, 0, 0])), []);
  const isSet = (look: Partial<Look>, spaceLook: Partial<SpaceLook>, ofTints: number, ofSections: number) => {
    [tints, sections] = [0, 0];
    scene.setLook({ ...DEFAULT_LOOK, ...look }, { ...DEFAULT_SPACE_LOOK, ...spaceLook });
    assert.deepEqual([tints, sections], [ofTints, ofSections]);
  };
  isSet({}, { clipAxis: 'x', clipAt: 0.3 }, 0, 0);
  isSet({ edges: true, lineWidth: 3 }, { clipAxis: 'x', clipAt: 0.4 }, 0, 0);
  isSet({ colour: 'identity' }, {}, 1, 0);
  isSet({ colour: 'identity', hidden: [1] }, {}, 0, 1);
  isSet({ colour: 'identity', sections: false }, { hasPlanes: true }, 0, 1);
  isSet({ colour: 'identity', sections: false, dark: true }, { hasPlanes: true }, 1, 1);
});

test('a drawing does not read the canvas from the page', () => {
  Object.assign(globalThis, { devicePixelRatio: 1 });
  let reads = 0;
  const canvas = { get clientWidth() { ++reads; return 80; }, clientHeight: 60 } as HTMLCanvasElement;
  const scene = new SpaceScene(canvas);
  scene.resize();
  reads = 0;
  scene.draw();
  scene.fitExtent();
  assert.deepEqual([reads, scene.size], [0, { width: 80, height: 60 }]);
});

test('a section with other points than its rings is refused', () => {
  const points = Float32Array.of(0, 0, 1, 0, 0, 2);
  for (const [offsets, isRight] of [[[0, 3], true], [[0, 4_000_000_000], false], [[0, 2], false], [[1, 3], false], [[0, 3, 2, 3], false]] as const) {
    const sections = [{ rings: { points, offsets: Uint32Array.from(offsets) }, origin: [0, 0] }];
    const show = () => spaceFrameOf({ ...frame(1), sections } as unknown as Frame, surfaceAt([0, 0, 0]));
    if (isRight) assert.doesNotThrow(show);
    else assert.throws(show, /sections\[0\]\.offsets/, `${offsets}`);
  }
});

test('the box of a frame grows with its bodies, or has its particles', () => {
  const surface = surfaceAt([0, 0, 0], [5, 0, 0]);
  assert.deepEqual(boxOf(surface), { low: [-1, -1, -1], high: [6, 1, 1] });
  const empty = decodeSurface({ ...plainMessage([]), hasSurface: false }, codec);
  assert.equal(boxOf(empty), null);
  assert.deepEqual(boxOf({ ...empty, particles: Float32Array.of(1, 2, 3, 0, 5, 1) }), { low: [0, 2, 1], high: [1, 5, 3] });
});

test('sections lie in their planes', () => {
  const plane = { origin: [1, 2, 3], normal: [1, -2, 0.5] } as const;
  const rings = { points: Float32Array.of(0, 0, 1, 0, 0, 2), offsets: Uint32Array.of(0, 3) };
  const withSection = { sections: [{ rings, origin: [4, 5] }] } as unknown as Frame;
  const outlines = [{ plane: null, isovalue: null, isSurface: true }, { plane, isovalue: null }];
  const [{ positions }] = sectionLines(withSection, outlines, DEFAULT_LOOK, [1, 1, 1]);
  assert.equal(positions.length, 3 * 6);
  const expected = [[4, 5], [5, 5], [5, 5], [4, 7], [4, 7], [4, 5]];
  expected.forEach(([u, v], k) => {
    const at = [0, 1, 2].map((axis) => positions[3 * k + axis] + 1) as unknown as Vector;
    isNear(inPlane(plane, at), [u, v, 0], 1e-5);
    isNear(at, inSpace(plane, u, v), 1e-5);
  });
  assert.deepEqual(sectionLines(withSection, outlines, { ...DEFAULT_LOOK, hidden: [1] }, [0, 0, 0]), []);
  assert.deepEqual(sectionLines(withSection, outlines, { ...DEFAULT_LOOK, sections: false }, [0, 0, 0]), []);
});

test('the border of a plane goes around the box', () => {
  const plane = (origin: Vector, normal: Vector) => ({ origin, normal });
  assert.deepEqual(cornersInPlane(cuboid, plane([0, 0, 3], [0, 0, 1])), [], 'above the box');
  const across = cornersInPlane(cuboid, plane([0, 0, 0.5], [0, 0, 1]));
  assert.equal(across.length, 4);
  across.forEach((corner, k) => {
    const next = across[(k + 1) % 4];
    assert.equal(corner[2], 0.5);
    assert.equal(Number(corner[0] !== next[0]) + Number(corner[1] !== next[1]), 1, 'along one edge');
  });
  assert.equal(cornersInPlane({ low: [0, 0, 0], high: [1, 1, 1] }, plane([0.5, 0.5, 0.5], [1, 1, 1])).length, 6);
  const outlines = [{ plane: null, isovalue: null, isSurface: true }, { plane: plane([0, 0, 0.5], [0, 0, 1]), isovalue: null }];
  const [{ positions, isBorder }] = planeBorders(outlines, DEFAULT_LOOK, cuboid, [1, 1, 1]);
  assert.ok(isBorder && positions.length === 4 * 2 * 3);
  assert.deepEqual([...positions.slice(3, 6)], [...positions.slice(6, 9)]);
  assert.deepEqual(planeBorders(outlines, { ...DEFAULT_LOOK, hidden: [1] }, cuboid, [0, 0, 0]), []);
  assert.deepEqual(planeBorders(outlines, { ...DEFAULT_LOOK, sections: false }, cuboid, [0, 0, 0]), []);
});

test('a cavity has the colour of its body, and its body is selected in a cut', () => {
  const surface = { ...surfaceAt([0, 0, 0], [0, 0, 0]), outerOf: Uint32Array.of(0xffffffff, 0) };
  const scene = new SpaceScene(hiddenCanvas);
  let tints = new Uint8Array(0);
  const drawing = { show() {}, setTints: (now: Uint8Array) => { tints = now.slice(); }, setSections() {}, draw() {}, destroy() {} };
  scene.attach(drawing satisfies SpaceDrawing);
  scene.setLook({ ...DEFAULT_LOOK, colour: 'identity' }, DEFAULT_SPACE_LOOK);
  scene.show(spaceFrameOf(frame(1), surface), []);
  const tintOf = (shell: number) => [...tints.slice(24 * shell, 24 * shell + 4)];
  assert.deepEqual(tintOf(1), tintOf(0));
  assert.equal(tintOf(0)[3], 0);
  scene.select(1n);
  assert.deepEqual([tintOf(0)[3], tintOf(1)[3]], [SELECTED.shell + SELECTED.body, SELECTED.body]);
  scene.select(2n);
  assert.deepEqual([tintOf(0)[3], tintOf(1)[3]], [0, SELECTED.shell]);
});
