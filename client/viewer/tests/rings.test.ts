// Tests the decoder of outlines with damaged messages.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { CoordinateFormat, ReconstructedFrameSchema, type RingsSchema } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../src/protocol/arrays';
import { decodeFrame } from '../src/protocol/decode';
import { NO_RING } from '../src/protocol/frame';

type Fields = Exclude<MessageInitShape<typeof RingsSchema>, { $typeName: string }>;

const words = (...values: number[]) => bytesOf(Uint32Array.from(values));

/** A square with a triangular hole. */
const square: Fields = {
  points: bytesOf(Float64Array.of(0, 0, 9, 0, 9, 9, 0, 9, 1, 1, 2, 5, 5, 2)),
  offsets: words(0, 4, 7), outerOf: words(NO_RING, 0), identities: bytesOf(BigUint64Array.of(1n, 0n)),
  measures: [{ area: 81 }, { area: -7.5 }], normals: bytesOf(new Float32Array(14)),
};

/** The square with changed fields, and a mesh of one triangle. */
function frameOf(change: Fields, coordinateFormat = CoordinateFormat.FLOAT64) {
  return decodeFrame(create(ReconstructedFrameSchema, {
    sequence: 5n, coordinateFormat, rings: { ...square, ...change },
    mesh: { points: square.points, triangles: words(0, 1, 2), classes: Uint8Array.of(0) },
  }), 0);
}

test('intact rings are decoded', () => {
  const { rings, mesh, problem } = frameOf({});
  assert.equal(problem, undefined);
  assert.deepEqual([...rings.offsets], [0, 4, 7]);
  assert.deepEqual([...rings.outerOf], [NO_RING, 0]);
  assert.deepEqual([...rings.area], [81, -7.5]);
  assert.equal(mesh?.triangles.length, 3);
});

test('cuts are decoded', () => {
  assert.deepEqual([...frameOf({}).rings.cuts], []);
  assert.deepEqual([...frameOf({ cuts: words(1, 3) }).rings.cuts], [1, 3]);
});

test('points at walls are decoded', () => {
  const angles = Float32Array.of(0.5, 2.25);
  const { rings } = frameOf({ wetted: words(0, 1), contacts: words(2, 6), contactAngles: bytesOf(angles) });
  assert.deepEqual([[...rings.wetted], [...rings.contacts], [...rings.contactAngles]], [[0, 1], [2, 6], [0.5, 2.25]]);
  const dry = frameOf({}).rings;
  assert.deepEqual([dry.wetted.length, dry.contacts.length, dry.contactAngles.length], [0, 0, 0]);
});

test('rings without identities have the identity 0', () => {
  assert.deepEqual([...frameOf({ identities: new Uint8Array(0) }).rings.identities], [0n, 0n]);
});

test('a frame without rings is intact', () => {
  const empty = new Uint8Array(0);
  for (const offsets of [empty, words(0)]) {
    const { rings, problem } = frameOf({
      points: empty, offsets, outerOf: empty, identities: empty, measures: [], normals: empty,
    });
    assert.equal(problem, undefined);
    assert.deepEqual([...rings.offsets], [0]);
  }
});

test('a damaged message has no outline and names the field', () => {
  const cases: [Fields, RegExp][] = [
    [{ cuts: words(3, 7) }, /rings\.cuts must be ascending numbers of the 7 points\./],
    [{ cuts: words(3, 3) }, /rings\.cuts must be ascending/],
    [{ cuts: new Uint8Array(6) }, /rings\.cuts must be ascending/],
    [{ wetted: words(0, 7) }, /rings\.wetted must be ascending numbers of the 7 points\./],
    [{ wetted: new Uint8Array(3) }, /rings\.wetted must be ascending/],
    [{ contacts: words(2, 1), contactAngles: bytesOf(new Float32Array(2)) }, /rings\.contacts must be ascending/],
    [{ contacts: words(2) }, /rings\.contact_angles must be a finite number for each of the 1 contacts\./],
    [{ contactAngles: bytesOf(new Float32Array(1)) }, /rings\.contact_angles must be a finite number/],
    [{ contacts: words(2), contactAngles: bytesOf(Float32Array.of(NaN)) }, /rings\.contact_angles must be/],
    [{ contacts: words(2), contactAngles: new Uint8Array(5) }, /rings\.contact_angles must be/],
    [{ offsets: words(0, 4, 8) }, /rings\.offsets must end with the 7 points\./],
    [{ offsets: words(0, 4, 6) }, /rings\.offsets gives ring 1 fewer than 3\./],
    [{ offsets: words(0, 5, 3) }, /rings\.offsets gives ring 1 fewer than 3\./],
    [{ offsets: words(0, 4, 0xffffffff) }, /rings\.offsets must end/],
    [{ offsets: words(1, 4, 7) }, /rings\.offsets must begin with 0\./],
    [{ offsets: new Uint8Array(0) }, /rings\.offsets must begin with 0\./],
    [{ offsets: new Uint8Array(11) }, /rings\.offsets is no array of uint32\./],
    [{ offsets: words(0, 7) }, /rings\.outer_of must have a uint32 for each of the 1 rings\./],
    [{ points: new Uint8Array(111) }, /rings\.points is no array of points\./],
    [{ outerOf: words(NO_RING, 2) }, /rings\.outer_of names ring 2 for ring 1, which is no outer ring\./],
    [{ outerOf: words(1, 0) }, /rings\.outer_of names ring 1 for ring 0/],
    [{ identities: new Uint8Array(8) }, /rings\.identities must have a uint64/],
    [{ measures: [{}] }, /rings\.measures must have an entry/],
    [{ normals: new Uint8Array(8) }, /rings\.normals must have two floats for each of the 7 points\./],
  ];
  for (const [change, rule] of cases) {
    const { rings, mesh, problem, sequence } = frameOf(change);
    assert.match(problem ?? '', rule);
    assert.match(problem ?? '', /^Frame 5 cannot be shown: /);
    assert.equal(sequence, 5n);
    assert.equal(mesh, null);
    assert.deepEqual([rings.points.length, [...rings.offsets]], [0, [0]]);
  }
});

test('points relative to the origin have eight bytes', () => {
  const points = bytesOf(new Float32Array(14));
  assert.equal(frameOf({ points }, CoordinateFormat.FLOAT32_RELATIVE).problem, undefined);
  assert.match(frameOf({ points: points.subarray(4) }, CoordinateFormat.FLOAT32_RELATIVE).problem ?? '', /rings\.points/);
});

test('a damaged section leaves the other outlines', () => {
  const { problem, sections } = decodeFrame(create(ReconstructedFrameSchema, {
    sequence: 5n, rings: square, sections: [{ rings: { ...square, offsets: words(0, 4) } }, { rings: square }],
  }), 0);
  assert.equal(problem, undefined);
  assert.match(sections[0].problem ?? '', /^Frame 5 cannot be shown: rings\.offsets/);
  assert.equal(sections[1].rings.offsets.length, 3);
});
