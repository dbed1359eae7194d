import assert from 'node:assert/strict';
import { test } from 'node:test';
import { RingIndex } from '../src/draw/pick';
import { NO_RING, type Rings } from '../src/protocol/frame';
import { makeFrame } from './draw_frames';

/** Rings from their corners; `outerOf` is NO_RING for outer rings. */
function ringsOf(corners: number[][], outerOf: number[]): Rings {
  const offsets = [0];
  for (const ring of corners) offsets.push(offsets[offsets.length - 1] + ring.length / 2);
  const area = corners.map((ring) => {
    let doubled = 0;
    for (let k = 0; k < ring.length; k += 2) {
      const next = (k + 2) % ring.length;
      doubled += ring[k] * ring[next + 1] - ring[next] * ring[k + 1];
    }
    return doubled / 2;
  });
  return {
    points: Float32Array.from(corners.flat()),
    offsets: Uint32Array.from(offsets),
    outerOf: Uint32Array.from(outerOf),
    identities: BigUint64Array.from(corners, (_, ring) => BigInt(ring + 1)),
    area: Float64Array.from(area),
    perimeter: new Float64Array(corners.length),
    particles: new Float64Array(corners.length),
    parents: corners.map(() => []),
    cuts: new Uint32Array(0),
    wetted: new Uint32Array(0), contacts: new Uint32Array(0), contactAngles: new Float32Array(0),
    normals: null,
    attributes: new Map(),
  };
}

const NESTED = ringsOf([
  [0, 0, 10, 0, 10, 10, 0, 10],
  [2, 2, 2, 8, 8, 8, 8, 2],
  [4, 4, 6, 4, 6, 6, 4, 6],
], [NO_RING, 0, NO_RING]);

/** Brute-force search over all segments. */
function bruteForce(rings: Rings, x: number, y: number): number | null {
  let inner: number | null = null;
  for (let ring = 0; ring < rings.outerOf.length; ++ring) {
    let odd = false;
    const [first, end] = [rings.offsets[ring], rings.offsets[ring + 1]];
    for (let k = first; k < end; ++k) {
      const next = k + 1 < end ? k + 1 : first;
      const [ax, ay] = [rings.points[2 * k], rings.points[2 * k + 1]];
      const [bx, by] = [rings.points[2 * next], rings.points[2 * next + 1]];
      if (ay > y !== by > y && x < ax + ((y - ay) * (bx - ax)) / (by - ay)) odd = !odd;
    }
    if (odd && (inner === null || Math.abs(rings.area[ring]) < Math.abs(rings.area[inner]))) {
      inner = ring;
    }
  }
  return inner !== null && rings.outerOf[inner] === NO_RING ? inner : null;
}

test('a position belongs to the innermost outer ring', () => {
  const index = new RingIndex(NESTED);
  assert.equal(index.ringAt(1, 5, 0), 0);
  assert.equal(index.ringAt(3, 5, 0), null);
  assert.equal(index.ringAt(5, 5, 0), 2);
  assert.equal(index.ringAt(11, 5, 0), null);
  assert.equal(index.ringAt(5, -1e9, 0), null);
});

test('a position near a line picks its ring', () => {
  const index = new RingIndex(NESTED);
  assert.equal(index.ringAt(2.2, 5, 0.5), 1);
  assert.equal(index.ringAt(1.8, 5, 0.5), 1);
  assert.equal(index.ringAt(5, 10.3, 0.5), 0);
  assert.equal(index.ringAt(5, 10.6, 0.5), null);
  assert.equal(index.ringAt(5, 6.1, 0.5), 2);
});

test('the index agrees with a search of every segment', () => {
  const { rings } = makeFrame({ cell: 0.2 });
  const index = new RingIndex(rings);
  let found = 0;
  let seed = 1;
  const random = (): number => (seed = (Math.imul(seed, 48271) >>> 0) % 0x7fffffff) / 0x7fffffff;
  for (let k = 0; k < 4000; ++k) {
    const [x, y] = [17 * random(), 11 * random()];
    const expected = bruteForce(rings, x, y);
    assert.equal(index.ringAt(x, y, 0), expected, `at ${x}, ${y}`);
    if (expected !== null) ++found;
  }
  assert.ok(found > 800 && found < 3600, `${found}`);
});

test('degenerate rings contain nothing', () => {
  assert.equal(new RingIndex(ringsOf([], [])).ringAt(0, 0, 1), null);
  const flat = new RingIndex(ringsOf([[0, 1, 5, 1, 9, 1]], [NO_RING]));
  assert.equal(flat.ringAt(5, 1.5, 0.1), null);
  assert.equal(flat.ringAt(5, 1.05, 0.1), 0);
  const point = new RingIndex(ringsOf([[3, 3]], [NO_RING]));
  assert.equal(point.ringAt(3, 3, 0.1), 0);
  assert.equal(point.ringAt(4, 3, 0.1), null);
});

test('tall segments do not exhaust the memory', () => {
  const comb: number[] = [];
  for (let k = 0; k < 20000; ++k) comb.push(k, k % 2 === 0 ? 0 : 1000);
  comb.push(20000, -1, -1, -1);
  const index = new RingIndex(ringsOf([comb], [NO_RING]));
  assert.equal(index.ringAt(11.0, 500, 0), 0);
  assert.equal(index.ringAt(10.0, 500, 0), null);
});
