import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { ReconstructedFrameSchema, ReconstructionParametersSchema } from '@proto/v1/reconstruction_pb';
import { bytesOf } from '../src/protocol/arrays';
import { decodeFrame } from '../src/protocol/decode';
import { outlineName, outlinesOf, pictureOf, shiftBetween, type SectionPlane } from '../src/protocol/sections';
import { reportOutlines } from '../src/report/outlines';

const parameters = create(ReconstructionParametersSchema, {
  slice: { originZ: 0.5, normalZ: 1 },
  sections: [
    { isovalue: 0.3 },
    { slice: { originX: 1, originY: 2, originZ: 0.75, normalZ: 2 } },
    { slice: { originY: 0.25, normalY: -1 }, isovalue: 0.7 },
    { slice: { originX: 1, normalX: 1, normalY: 1 } },
  ],
});
const NAMES = [
  'z = 0.5', 'z = 0.5, isovalue 0.3', 'z = 0.75', 'y = 0.25, isovalue 0.7',
  'through (1, 0, 0), normal (1, 1, 0)',
];

test('outlines are named by plane and isovalue', () => {
  assert.deepEqual(outlinesOf(parameters).map(outlineName), NAMES);
  assert.deepEqual(outlinesOf(null).map(outlineName), ['Outline']);
});

test('the report has the same names', () => {
  // As written by DescribeParameters of client/output/report.cc.
  const rows = [
    ['slice', 'through (0, 0, 0.5), normal (0, 0, 1)'], ['section 1', 'isovalue 0.3'],
    ['section 2', 'slice through (1, 2, 0.75), normal (0, 0, 2)'],
    ['section 3', 'slice through (0, 0.25, 0), normal (0, -1, 0), isovalue 0.7'],
    ['section 4', 'slice through (1, 0, 0), normal (1, 1, 0)'],
  ] as const;
  assert.deepEqual(reportOutlines(rows).map(outlineName), NAMES);
});

const plane = (origin: SectionPlane['origin'], normal: SectionPlane['normal']) => ({ origin, normal });

test('parallel planes are shifted onto each other, others are not drawn together', () => {
  const own = plane([0, 0, 0.5], [0, 0, 1]);
  assert.deepEqual(shiftBetween(plane([1, 2, 9], [0, 0, 3]), own), [1, 2]);
  assert.deepEqual(shiftBetween(plane([4, 1, 2], [5, 0, 0]), plane([0, 0, 0], [1, 0, 0])), [1, 2]);
  assert.deepEqual(shiftBetween(plane([1, 7, 2], [0, -1, 0]), plane([0, 0, 0], [0, -1, 0])), [1, 2]);
  assert.equal(shiftBetween(plane([0, 0, 0], [0, 0, -1]), own), null, 'its axes are mirrored');
  assert.equal(shiftBetween(plane([0, 0, 0], [1, 0, 0]), own), null);
  assert.deepEqual(shiftBetween(null, null), [0, 0]);
});

/** A message with one ring of the given corners in each outline. */
function message(...corners: number[][]) {
  const rings = (points: number[]) => ({
    points: bytesOf(Float64Array.from(points)), offsets: bytesOf(Uint32Array.of(0, points.length / 2)),
    outerOf: bytesOf(Uint32Array.of(0xffffffff)), measures: [{}],
  });
  const [own, ...sections] = corners;
  return create(ReconstructedFrameSchema, {
    sequence: 7n, time: 1.5, rings: rings(own), particles: bytesOf(Float64Array.of(1, 1)), particleFormat: 2,
    sections: sections.map((points) => ({ rings: rings(points), ringsDigest: 9n })),
  });
}

test('a picture has all outlines of its plane as lines, and names another one', () => {
  const frame = decodeFrame(
    message([0, 0, 1, 0, 0, 1], [2, 0, 3, 0, 2, 1], [4, 0, 5, 0, 4, 1], [6, 0, 7, 0, 6, 1], [8, 0, 9, 0, 8, 1]), 0);
  const outlines = outlinesOf(parameters);
  const own = pictureOf(frame, outlines, 0);
  assert.deepEqual(own.isolines.map(({ index }) => index), [1, 2]);
  assert.deepEqual(own.isolines[1].origin, [5, 2], 'its origin (4, 0), moved by the origin of its plane');
  const other = pictureOf(frame, outlines, 2);
  assert.deepEqual(other.isolines.map(({ index }) => index), [0, 1]);
  assert.equal(other.ringsDigest, 9n);
  assert.deepEqual([other.sequence, other.time], [7n, 1.5]);
  assert.equal(other.particles, null, 'the particles are of another plane');
  assert.deepEqual(pictureOf(frame, outlines, 3).isolines, [], 'no other outline is parallel to y = 0.25');
  assert.equal(pictureOf(frame, outlines, 9).ringsDigest, frame.ringsDigest);
});

test('a plane above that of the particles has none', () => {
  const above = create(ReconstructionParametersSchema, {
    slice: { originZ: 0.5, normalZ: 1 }, sections: [{ slice: { originZ: 0.75, normalZ: 1 } }],
  });
  const frame = decodeFrame(message([0, 0, 1, 0, 0, 1], [0, 0, 1, 0, 0, 1]), 0);
  assert.equal(pictureOf(frame, outlinesOf(above), 1).particles, null);
});

test('isolines of 2D particles are drawn together', () => {
  const frame = decodeFrame(message([0, 0, 1, 0, 0, 1], [2, 0, 3, 0, 2, 1], [4, 0, 5, 0, 4, 1]), 0);
  const outlines = outlinesOf(create(ReconstructionParametersSchema, { sections: [{ isovalue: 0.3 }, { isovalue: 0.7 }] }));
  assert.deepEqual(outlines.map(outlineName), ['Outline', 'isovalue 0.3', 'isovalue 0.7']);
  assert.deepEqual(pictureOf(frame, outlines, 0).isolines.map(({ index }) => index), [1, 2]);
  const [x, y] = frame.origin;
  for (const shown of [1, 2]) {
    const picture = pictureOf(frame, outlines, shown);
    assert.notDeepEqual(picture.origin, frame.origin, 'each outline has an origin of its own');
    assert.deepEqual(
      [...picture.particles ?? []].map((part, k) => part + picture.origin[k % 2]),
      [...frame.particles ?? []].map((part, k) => part + [x, y][k % 2]), 'the particles stay in place');
    assert.equal(picture.particleAttributes, frame.particleAttributes);
  }
});
