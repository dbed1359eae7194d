import assert from 'node:assert/strict';
import { test } from 'node:test';
import { pieceTints } from '../src/draw/pieces';
import { RingIndex } from '../src/draw/pick';
import { makeFrame, meshOf } from './draw_frames';

test('every triangle gets the colour of its outer ring', () => {
  for (const merge of [true, false]) {
    const { mesh, rings } = makeFrame({ cell: 0.2, merge });
    assert.ok(mesh);
    const tints = pieceTints(mesh, rings, (ring) => 1000 + ring);
    const index = new RingIndex(rings);
    const { points, triangles } = mesh;
    const seen = new Set<number>();
    for (let k = 0; k < triangles.length; k += 3) {
      const [a, b, c] = triangles.subarray(k, k + 3);
      const x = (points[2 * a] + points[2 * b] + points[2 * c]) / 3;
      const y = (points[2 * a + 1] + points[2 * b + 1] + points[2 * c + 1]) / 3;
      const ring = index.ringAt(x, y, 0);
      if (ring === null) continue;  // On the line.
      seen.add(ring);
      for (const corner of [a, b, c]) assert.equal(tints[corner], 1000 + ring);
    }
    assert.equal(seen.size, 6);
  }
});

test('a piece without ring vertices is found by position', () => {
  const { mesh, rings } = makeFrame({ cell: 0.5 });
  assert.ok(mesh);
  const count = mesh.points.length / 2;
  // A separate triangle inside the largest body.
  const points = Float32Array.from([...mesh.points, 9, 5, 9.2, 5, 9, 5.2]);
  const triangles = Uint32Array.from([...mesh.triangles, count, count + 1, count + 2]);
  const tints = pieceTints(
    meshOf(points, triangles, mesh.classes), rings, (ring) => 1000 + ring);
  const body = rings.area.indexOf(Math.max(...rings.area));
  assert.deepEqual([...tints.subarray(count)], [1000 + body, 1000 + body, 1000 + body]);
});
