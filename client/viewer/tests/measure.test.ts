import assert from 'node:assert/strict';
import { test } from 'node:test';
import { valuesAt } from '../src/draw/values';
import { bytesOf } from '../src/protocol/arrays';
import { AttributeChannels } from '../src/protocol/channels';
import { bareRings } from '../src/protocol/frame';
import { angleOf, distanceOf, Measurement } from '../src/ui/measure';
import { axisMarks } from '../src/ui/axes';
import { makeFrame } from './draw_frames';

test('distances and angles', () => {
  assert.equal(distanceOf([1, 1], [4, 5]), 5);
  assert.ok(Math.abs(angleOf([1, 0], [0, 0], [0, 2]) - 90) < 1e-12);
  assert.ok(Math.abs(angleOf([1, 0], [0, 0], [1, -1]) - 45) < 1e-12, 'without a sign');
  assert.ok(Math.abs(angleOf([3, 1], [1, 1], [-1, 1]) - 180) < 1e-12);
});

test('a measurement has its points, then the next one begins', () => {
  const one = new Measurement();
  const text = () => one.text((identity) => `ring ${identity}`);
  one.add('distance', [0, 0], null);
  assert.equal(text(), '');
  one.add('distance', [3, 4], null);
  assert.equal(text(), 'distance 5, x 3, y 4');
  one.add('distance', [9, 9], null);
  assert.deepEqual(one.points, [[9, 9]]);
  one.add('angle', [1, 0], null);
  assert.equal(one.points.length, 1, 'another mode begins anew');
  one.add('angle', [0, 0], null);
  one.add('angle', [0, 1], null);
  assert.equal(text(), 'angle 90°');
  one.add('ring', [0, 0], 7n);
  assert.equal(text(), 'ring 7');
  one.clear();
  assert.equal(text(), '');
});

test('coordinates stand where they are', () => {
  const { x, y } = axisMarks({ x: 5, y: 2, scale: 10 }, { width: 100, height: 40 });
  assert.deepEqual(x.map(({ text }) => text), ['0', '5', '10']);
  assert.deepEqual(x.map(({ at }) => at), [0, 50, 100]);
  assert.deepEqual(y.map(({ at, text }) => [at, text]), [[40, '0'], [20, '2'], [0, '4']]);
});

const channel = (name: string, values: number[]) =>
  new AttributeChannels([{ name, values: bytesOf(Float32Array.from(values)) }]);

test('values are interpolated in the mesh', () => {
  const frame = makeFrame();
  const points = Float32Array.of(0, 0, 4, 0, 0, 4, 4, 4);
  const values = Float32Array.of(0, 4, 40, 44);
  const mesh = {
    ...frame.mesh!, points, triangles: Uint32Array.of(0, 1, 2, 1, 3, 2),
    attribute: (name: string) => (name === 'p' ? values : undefined),
  };
  const at = (x: number, y: number) => valuesAt({ ...frame, mesh, particles: null }, ['p', 'q'], x, y, 0.1);
  for (const [x, y] of [[1, 1], [3, 3.5], [0.5, 3]]) {
    const [{ name, value }, ...rest] = at(x, y);
    assert.equal(name, 'p');
    assert.ok(Math.abs(value - x - 10 * y) < 1e-5, `${value} at ${x}, ${y}`);
    assert.deepEqual(rest, []);
  }
  assert.deepEqual(at(9, 9), [], 'none outside');
});

test('without a mesh, values are those of a near particle', () => {
  const rings = bareRings(new Float32Array(0), Uint32Array.of(0));
  const frame = {
    ...makeFrame(), mesh: null, rings, particles: Float32Array.of(0, 0, 1, 0),
    particleAttributes: channel('p', [5, 6]),
  };
  assert.deepEqual(valuesAt(frame, ['p'], 0.9, 0, 0.2), [{ name: 'p', value: 6 }]);
  assert.deepEqual(valuesAt(frame, ['p'], 0.5, 0, 0.2), []);
});
