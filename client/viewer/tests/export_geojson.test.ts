import assert from 'node:assert/strict';
import { test } from 'node:test';
import { geojson } from '../src/export/geojson';
import { NO_RING } from '../src/protocol/frame';
import { makeFrame } from './draw_frames';

interface Feature {
  properties: Record<string, unknown>;
  geometry: { type: string; coordinates: [number, number][][] };
}

interface Collection {
  type: string;
  frame: number;
  time: number | null;
  features: Feature[];
}

function signedArea(ring: [number, number][]): number {
  return ring.slice(1).reduce((sum, [x, y], k) =>
    sum + ((ring[k][0] - ring[0][0]) * (y - ring[0][1]) -
           (x - ring[0][0]) * (ring[k][1] - ring[0][1])) / 2, 0);
}

const FRAME = makeFrame({ sequence: 12n, origin: [1e6, -2e6] });

test('each outer ring is a closed polygon with its holes', () => {
  const { type, frame, features } = JSON.parse(geojson(FRAME)) as Collection;
  assert.equal(type, 'FeatureCollection');
  assert.equal(frame, 12);
  const outers = FRAME.rings.outerOf.filter((outer) => outer === NO_RING).length;
  assert.equal(features.length, outers);
  assert.equal(features.reduce((sum, one) => sum + one.geometry.coordinates.length, 0),
    FRAME.rings.outerOf.length);
  for (const { geometry } of features) {
    assert.equal(geometry.type, 'Polygon');
    geometry.coordinates.forEach((ring, k) => {
      assert.deepEqual(ring[0], ring[ring.length - 1]);
      assert.ok(k === 0 ? signedArea(ring) > 0 : signedArea(ring) < 0);
    });
  }
});

test('coordinates are float64 world coordinates', () => {
  const { features } = JSON.parse(geojson(FRAME)) as Collection;
  const first = features[0].geometry.coordinates[0][0];
  assert.deepEqual(first, [1e6 + FRAME.rings.points[0], -2e6 + FRAME.rings.points[1]]);
  assert.notEqual(first[0], Math.fround(first[0]));
});

test('area and perimeter include the holes', () => {
  const { features } = JSON.parse(geojson(FRAME)) as Collection;
  for (const { properties, geometry } of features) {
    const area = geometry.coordinates.reduce((sum, ring) => sum + signedArea(ring), 0);
    assert.ok(Math.abs(Number(properties.area) - area) < 1e-5 * area);
  }
});

test('identities keep 64 bits; a time of NaN is null', () => {
  const large = 2n ** 64n - 1n;
  const rings = {
    ...FRAME.rings,
    identities: FRAME.rings.identities.map(() => large),
    parents: FRAME.rings.parents.map(() => [large - 1n, large]),
  };
  const text = geojson({ ...FRAME, rings, time: NaN });
  assert.match(text, /"identity":18446744073709551615,"parents":\[18446744073709551614,184467/);
  assert.equal((JSON.parse(text) as Collection).time, null);
});

test('an empty frame is an empty collection', () => {
  const rings = {
    ...FRAME.rings,
    points: new Float32Array(0),
    offsets: new Uint32Array(1),
    outerOf: new Uint32Array(0),
    identities: new BigUint64Array(0),
    parents: [],
  };
  assert.deepEqual((JSON.parse(geojson({ ...FRAME, rings })) as Collection).features, []);
});
