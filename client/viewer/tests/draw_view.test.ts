import assert from 'node:assert/strict';
import { test } from 'node:test';
import { boundsOf, fitBounds, panBy, toCss, toWorld, type View, zoomAt } from '../src/draw/view';

const SIZE = { width: 800, height: 500 };
const VIEW: View = { x: 12.5, y: -3, scale: 40 };

function near(actual: readonly number[], expected: readonly number[], tolerance = 1e-9): void {
  actual.forEach((one, k) => assert.ok(Math.abs(one - expected[k]) <= tolerance, `${actual}`));
}

test('the view is the canvas centre, and world y points up', () => {
  near(toWorld(VIEW, SIZE, 400, 250), [12.5, -3]);
  near(toWorld(VIEW, SIZE, 440, 210), [13.5, -2]);
});

test('world and CSS coordinates convert both ways', () => {
  const [cssX, cssY] = toCss(VIEW, SIZE, 17.25, 4.125);
  near(toWorld(VIEW, SIZE, cssX, cssY), [17.25, 4.125]);
});

test('a zoom keeps the position under the cursor', () => {
  let view = VIEW;
  const under = toWorld(view, SIZE, 113, 402);
  for (const factor of [1.2, 3, 0.1, 40, 1e-3]) {
    view = zoomAt(view, SIZE, 113, 402, factor);
    near(toCss(view, SIZE, under[0], under[1]), [113, 402], 1e-6);
  }
  near([view.scale], [40 * 1.2 * 3 * 0.1 * 40 * 1e-3], 1e-9);
});

test('zoom stays within single precision', () => {
  let view = VIEW;
  for (let k = 0; k < 400; ++k) view = zoomAt(view, SIZE, 1, 1, 10);
  assert.equal(view.scale, 1e30);
  for (let k = 0; k < 400; ++k) view = zoomAt(view, SIZE, 1, 1, 0.1);
  assert.equal(view.scale, 1e-30);
});

test('a pan by pixels moves the content by pixels', () => {
  const before = toCss(VIEW, SIZE, 1, 2);
  near(toCss(panBy(VIEW, 30, -7), SIZE, 1, 2), [before[0] + 30, before[1] - 7]);
});

test('fitted bounds are centred and touch the margin', () => {
  const view = fitBounds({ left: -1, right: 9, bottom: 100, top: 101 }, SIZE);
  const [left, bottom] = toCss(view, SIZE, -1, 100);
  const [right, top] = toCss(view, SIZE, 9, 101);
  near([left, SIZE.width - right, top], [48, 48, SIZE.height - bottom], 1e-6);
});

test('a single point and an empty canvas have a view', () => {
  assert.equal(fitBounds({ left: 2, right: 2, bottom: 3, top: 3 }, SIZE).scale, 1);
  const box = { left: 0, right: 1, bottom: 0, top: 1 };
  assert.equal(fitBounds(box, { width: 0, height: 0 }).scale, 1);
});

test('bounds are world coordinates of finite points', () => {
  const points = Float32Array.of(1, 2, NaN, 9, 3, -4, Infinity, 0);
  assert.deepEqual(boundsOf(points, [1000, 10]), { left: 1001, bottom: 6, right: 1003, top: 12 });
  assert.equal(boundsOf(new Float32Array(0), [0, 0]), null);
});
