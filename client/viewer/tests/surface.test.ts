// Tests the decoder of surfaces: against bytes of the C++ program, and with hostile bytes.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { before, test } from 'node:test';
import { fromBinary } from '@bufbuild/protobuf';
import { CoordinateFormat, PositionFormat, WatchStreamResponseSchema } from '@proto/v1/reconstruction_pb';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { bytesOf } from '../src/protocol/arrays';
import { decodeSpaceFrame } from '../src/protocol/decode';
import { decodeSurface, NO_SHELL, type Surface, type SurfaceMessage } from '../src/protocol/surface';
import { plainMessage } from './surface_message';

/** One frame in each format, from `partiemc replay --surface` through a server: two balls of 81 particles. */
const recorded = JSON.parse(readFileSync(new URL('../../tests/surface_frames.json', import.meta.url), 'utf8')) as Record<string, string>;

before(() => MeshoptDecoder.ready);

function frameOf(format: string) {
  const { response } = fromBinary(WatchStreamResponseSchema, Uint8Array.from(Buffer.from(recorded[format], 'base64')));
  assert.ok(response.case === 'frame' && response.value.frame);
  return decodeSpaceFrame(response.value.frame);
}

function surfaceOf(format: string): Surface {
  const { surface } = frameOf(format);
  assert.ok(surface);
  return decodeSurface(surface, MeshoptDecoder);
}

/** Signed volume of a shell, by the divergence theorem. */
function volumeOf({ positions, triangles, triangleOffsets }: Surface, shell: number): number {
  let sum = 0;
  for (let i = 3 * triangleOffsets[shell]; i < 3 * triangleOffsets[shell + 1]; i += 3) {
    const [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [0, 1, 2].map((k) => positions.subarray(3 * triangles[i + k]));
    sum += (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6;
  }
  return sum;
}

test('a surface has the same shells in all formats', () => {
  const exact = surfaceOf('float64');
  assert.ok(exact.measures.volume.length === 2);
  for (const format of ['float64', 'float32', 'compact']) {
    const surface = surfaceOf(format);
    assert.deepEqual(surface.pointOffsets, exact.pointOffsets);
    assert.deepEqual(surface.triangleOffsets, exact.triangleOffsets);
    assert.deepEqual([...surface.outerOf], [NO_SHELL, NO_SHELL]);
    assert.deepEqual(surface.identities, exact.identities);
    assert.equal(surface.edges.length, surface.triangles.length, 'a closed surface has 3 edges for 2 triangles');
    surface.measures.volume.forEach((volume, k) => {
      const found = volumeOf(surface, k);
      assert.ok(Math.abs(found - volume) < 1e-3 * volume, `${format}: the volume of shell ${k} is ${found}, not ${volume}`);
      for (let axis = 0; axis < 6; ++axis) {
        const at = (one: Surface) => one.boxes[6 * k + axis] + one.origin[axis % 3];
        assert.ok(Math.abs(at(surface) - at(exact)) < 1e-3, `${format}: the box of shell ${k} agrees`);
      }
    });
  }
});

test('normals, attributes and particles agree with the points', () => {
  for (const format of ['float64', 'float32', 'compact']) {
    const surface = surfaceOf(format);
    const { normals, positions, attributes, particles, origin, pointOffsets } = surface;
    const size = normals instanceof Int8Array ? 4 : 3;
    assert.equal(size, format === 'compact' ? 4 : 3);
    const count = positions.length / 3;
    assert.equal(normals.length, size * count);
    const middle = [0, 1, 2].map((axis) => (surface.boxes[axis] + surface.boxes[3 + axis]) / 2);
    for (let k = 0; k < pointOffsets[1]; ++k) {
      const outward = [0, 1, 2].reduce((sum, axis) => sum + normals[size * k + axis] * (positions[3 * k + axis] - middle[axis]), 0);
      assert.ok(outward > 0, `${format}: the normal of point ${k} points outward`);
    }
    assert.deepEqual(attributes.map(({ name, components }) => [name, components]), [['p', 1]]);
    // `p` is x of the particles in the first ball.
    for (let k = 0; k < pointOffsets[1]; ++k) {
      const x = positions[3 * k] + origin[0];
      const value = attributes[0].values[k];
      assert.ok(Math.abs(value - x) < 0.1, `${format}: the attribute at point ${k} is ${value}, not ${x}`);
    }
    assert.ok(particles && particles.length === 3 * 2 * 81, `${format}: ${particles?.length} coordinates of particles`);
    for (let k = 0; k < particles.length; k += 3) assert.ok(Math.abs(particles[k + 1] + origin[1] - 100) <= 2.01);
  }
});

test('a frame has its sections, and no outline of its own', () => {
  const { rings, sections, particles } = frameOf('compact');
  assert.equal(rings.identities.length, 0);
  assert.equal(particles, null);
  assert.equal(sections.length, 1);
  assert.equal(sections[0].rings.identities.length, 2);
});

test('normals of a surface without them are the means of its triangles', () => {
  const surface = decodeSurface(plainMessage([[0, 0, 0], [5, 0, 0]]), MeshoptDecoder);
  const { normals, positions } = surface;
  for (let k = 0; k < 6; ++k) {
    const dot = [0, 1, 2].reduce((sum, axis) => sum + normals[3 * k + axis] * (positions[3 * k + axis] + surface.origin[axis]), 0);
    const length = Math.hypot(...normals.subarray(3 * k, 3 * k + 3));
    assert.ok(Math.abs(dot / length - 1) < 1e-6);
  }
});

test('float32 is relative to the origin of the frame', () => {
  const surface = decodeSurface(plainMessage([[0, 0, 0]], 'FLOAT32'), MeshoptDecoder);
  assert.deepEqual(surface.origin, [10, 20, 30]);
  assert.ok(Math.abs(surface.positions[0] + 9) < 1e-6);
});

test('a frame without bodies is empty', () => {
  const message: SurfaceMessage = { ...plainMessage([]), hasSurface: false };
  assert.equal(decodeSurface(message, MeshoptDecoder).positions.length, 0);
});

test('particles without a body are relative to the origin', () => {
  const particles = bytesOf(Float32Array.of(11, 22, 33));
  const none: SurfaceMessage = {
    ...plainMessage([]), origin: [1, 2, 3], attributes: [], particles, particleFormat: PositionFormat.FLOAT32_3,
  };
  for (const hasSurface of [true, false]) {
    const surface = decodeSurface({ ...none, hasSurface }, MeshoptDecoder);
    assert.deepEqual(surface.origin, [1, 2, 3]);
    assert.deepEqual([...surface.particles ?? []], [10, 20, 30]);
  }
});

test('contradictions in a message are refused by name', () => {
  const two = () => plainMessage([[0, 0, 0], [5, 0, 0]]);
  const words = (...values: number[]) => bytesOf(Uint32Array.from(values));
  const cases: [Partial<SurfaceMessage>, RegExp][] = [
    [{ pointOffsets: words(0, 6, 3) }, /point_offsets gives shell 1/],
    [{ pointOffsets: words(1, 6, 12) }, /point_offsets must begin with 0/],
    [{ pointOffsets: new Uint8Array(7) }, /point_offsets is no array/],
    [{ pointOffsets: words(0, 6, 13) }, /points must be 13 points/],
    [{ pointOffsets: words(0, 6, 0xffffffff) }, /points must be 4294967295 points/],
    [{ triangleOffsets: words(0, 16) }, /triangle_offsets must have an entry/],
    [{ triangleOffsets: words(0, 8, 0xfffffff0) }, /triangles must have three uint32/],
    [{ outerOf: words(NO_SHELL) }, /outer_of must have a uint32/],
    [{ outerOf: words(NO_SHELL, 7) }, /outer_of names shell 7 for shell 1/],
    [{ outerOf: words(1, 0) }, /outer_of names shell 1 for shell 0/],
    [{ identities: new Uint8Array(8) }, /identities must have a uint64/],
    [{ measures: plainMessage([[0, 0, 0]]).measures }, /measures must have an entry/],
    [{ normals: new Uint8Array(12) }, /normals must have three floats/],
    [{ attributes: [{ name: 'p', components: 4, values: new Uint8Array(0) }] }, /attributes\[0\] must have 1 to 3/],
    [{ attributes: [{ name: 'p', components: 1, values: new Uint8Array(4) }] }, /attributes\[0\] must have values/],
    ...[words(8, 0), words(3, 3), words(16), new Uint8Array(3)].map((cuts): [Partial<SurfaceMessage>, RegExp] =>
      [{ cuts }, /cuts must be ascending numbers of the 16 triangles/]),
    [{ origin: [NaN, 0, 0] }, /origin/],
  ];
  for (const [change, rule] of cases) {
    assert.throws(() => decodeSurface({ ...two(), ...change }, MeshoptDecoder), rule);
  }
});

test('the points of cuts are marked', () => {
  const message = plainMessage([[0, 0, 0], [5, 0, 0]]);
  assert.equal(decodeSurface(message, MeshoptDecoder).inCut, null);
  message.cuts = bytesOf(Uint32Array.of(0, 8));  // With the points 0, 2 and 4 of each octahedron.
  assert.deepEqual([...decodeSurface(message, MeshoptDecoder).inCut ?? []], [255, 0, 255, 0, 255, 0, 255, 0, 255, 0, 255, 0]);
});

test('a triangle with a point of another shell is refused', () => {
  for (const [at, point] of [[0, 6], [30, 5], [2, 12], [5, 0xffffffff]]) {
    const message = plainMessage([[0, 0, 0], [5, 0, 0]]);
    const triangles = new Uint32Array(message.triangles.slice().buffer);
    triangles[at] = point;
    assert.throws(() => decodeSurface({ ...message, triangles: bytesOf(triangles) }, MeshoptDecoder), /triangles has a triangle/);
  }
});

test('a coordinate that is not finite is refused', () => {
  for (const bad of [NaN, Infinity]) {
    const message = plainMessage([[0, 0, 0]]);
    const points = new Float64Array(message.points.slice().buffer);
    points[4] = bad;
    assert.throws(() => decodeSurface({ ...message, points: bytesOf(points) }, MeshoptDecoder), /not finite/);
  }
});

test('garbage in a compact message gives an error or a surface within its limits', () => {
  const { surface: message } = frameOf('compact');
  assert.ok(message && message.format === CoordinateFormat.COMPACT);
  let seed = 12345;
  const random = (below: number) => {
    seed = (Math.imul(seed, 1103515245) + 12345) >>> 0;
    return Math.floor(seed / 2 ** 32 * below);
  };
  const fields = ['points', 'triangles', 'normals', 'pointOffsets', 'triangleOffsets', 'outerOf', 'identities'] as const;
  let refused = 0;
  for (let round = 0; round < 2000; ++round) {
    const field = fields[round % fields.length];
    const bytes = message[field].slice();
    for (let k = 0; k <= random(4); ++k) bytes[random(bytes.length)] = random(256);
    const cut = random(4) === 0 ? bytes.subarray(0, random(bytes.length)) : bytes;
    try {
      const { triangles, positions } = decodeSurface({ ...message, [field]: cut }, MeshoptDecoder);
      assert.ok(triangles.every((point) => point < positions.length / 3));
    } catch (error) {
      assert.match((error as Error).message, /^(surface\.|The origin)/, `round ${round} of ${field}`);
      ++refused;
    }
  }
  assert.ok(refused > 500, `${refused} refused`);
});

test('a compact message cannot ask for much more memory than it has bytes', () => {
  const { surface: message } = frameOf('compact');
  assert.ok(message);
  const words = (...values: number[]) => bytesOf(Uint32Array.from(values));
  const one: SurfaceMessage = {
    ...message, outerOf: words(NO_SHELL), identities: new Uint8Array(8), measures: plainMessage([[0, 0, 0]]).measures,
  };
  for (const [points, triangles, rule] of [[0xfffffff0, 8, /points has/], [4, 0xfffffff0, /points does not|triangles has/]] as const) {
    assert.throws(() => decodeSurface({ ...one, pointOffsets: words(0, points), triangleOffsets: words(0, triangles) }, MeshoptDecoder), rule);
  }
  for (const step of [0, -1, NaN, Infinity, 1e300]) {
    assert.throws(() => decodeSurface({ ...message, step }, MeshoptDecoder), /step is no length/);
  }
});
