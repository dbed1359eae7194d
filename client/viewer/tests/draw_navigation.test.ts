import assert from 'node:assert/strict';
import { test } from 'node:test';
import { wheelFactor } from '../src/draw/gestures';
import { applyKey, attachNavigation, type Navigable } from '../src/draw/navigation';
import { toCss, toWorld } from '../src/draw/view';

class FakeScene implements Navigable {
  view = { x: 0, y: 0, scale: 10 };
  size = { width: 600, height: 400 };
  fits = 0;
  fit(): void {
    ++this.fits;
  }
}

/** The part of a canvas that `attachNavigation` uses. */
class FakeCanvas extends EventTarget {
  style = { touchAction: '' };
  setPointerCapture(): void {}

  send(type: string, properties: Record<string, unknown>): Event {
    const event = Object.assign(new Event(type, { cancelable: true }), properties);
    this.dispatchEvent(event);
    return event;
  }

  pointer(type: string, pointerId: number, offsetX: number, offsetY: number): void {
    this.send(type, { pointerId, offsetX, offsetY, pointerType: 'touch', button: 0 });
  }
}

function attached(): { canvas: FakeCanvas; scene: FakeScene; changes: () => number;
                       detach: () => void } {
  const canvas = new FakeCanvas();
  const scene = new FakeScene();
  let count = 0;
  const detach = attachNavigation(
    canvas as unknown as HTMLCanvasElement, scene, () => ++count);
  return { canvas, scene, changes: () => count, detach };
}

test('the wheel zooms alike in pixels, lines and pinches', () => {
  const wheel = (deltaY: number, deltaMode = 0, ctrlKey = false): number =>
    wheelFactor({ deltaY, deltaMode, ctrlKey });
  assert.ok(wheel(-100) > 1.1 && wheel(-100) < 1.5);
  assert.ok(Math.abs(wheel(-100) * wheel(100) - 1) < 1e-12);
  assert.equal(wheel(3, 1), wheel(48));
  assert.ok(wheel(-5, 0, true) > wheel(-5));
  assert.ok(wheel(-1e9) < 3, 'a broken wheel does not lose the view');
});

test('the wheel zooms about the cursor without scrolling', () => {
  const { canvas, scene, changes } = attached();
  const under = toWorld(scene.view, scene.size, 120, 333);
  const event = canvas.send('wheel',
    { deltaY: -240, deltaMode: 0, ctrlKey: false, offsetX: 120, offsetY: 333 });
  const [x, y] = toCss(scene.view, scene.size, ...under);
  assert.ok(scene.view.scale > 10 && Math.hypot(x - 120, y - 333) < 1e-9);
  assert.ok(event.defaultPrevented);
  assert.equal(changes(), 1);
});

test('a drag pans by its distance', () => {
  const { canvas, scene } = attached();
  const held = toWorld(scene.view, scene.size, 50, 60);
  canvas.pointer('pointerdown', 1, 50, 60);
  canvas.pointer('pointermove', 1, 90, 20);
  canvas.pointer('pointermove', 1, 250, 160);
  canvas.pointer('pointerup', 1, 250, 160);
  const at = toCss(scene.view, scene.size, ...held);
  assert.ok(Math.hypot(at[0] - 250, at[1] - 160) < 1e-9);
  canvas.pointer('pointermove', 1, 0, 0);
  assert.deepEqual(toCss(scene.view, scene.size, ...held), at, 'released');
});

test('a drag ends when the canvas loses the pointer', () => {
  const { canvas, changes } = attached();
  canvas.pointer('pointerdown', 1, 50, 60);
  canvas.pointer('lostpointercapture', 1, 50, 60);
  canvas.pointer('pointermove', 1, 90, 20);
  assert.equal(changes(), 0);
});

test('two fingers zoom about their centre', () => {
  const { canvas, scene } = attached();
  const between = toWorld(scene.view, scene.size, 200, 100);
  canvas.pointer('pointerdown', 1, 150, 100);
  canvas.pointer('pointerdown', 2, 250, 100);
  canvas.pointer('pointermove', 1, 100, 100);
  canvas.pointer('pointermove', 2, 300, 100);
  assert.ok(Math.abs(scene.view.scale - 20) < 1e-9);
  const [x, y] = toCss(scene.view, scene.size, ...between);
  assert.ok(Math.hypot(x - 200, y - 100) < 1e-9);
});

test('a drag does not click', () => {
  const { canvas } = attached();
  let clicks = 0;
  canvas.addEventListener('click', () => ++clicks);
  canvas.pointer('pointerdown', 1, 10, 10);
  canvas.pointer('pointermove', 1, 60, 10);
  canvas.pointer('pointerup', 1, 60, 10);
  canvas.send('click', {});
  assert.equal(clicks, 0);
  canvas.pointer('pointerdown', 1, 60, 10);
  canvas.pointer('pointermove', 1, 61, 11);
  canvas.pointer('pointerup', 1, 61, 11);
  canvas.send('click', {});
  assert.equal(clicks, 1);
});

test('keys pan, zoom and fit; others are ignored', () => {
  const scene = new FakeScene();
  assert.ok(applyKey(scene, 'ArrowRight', false) && scene.view.x > 0);
  const slow = scene.view.x;
  assert.ok(applyKey(scene, 'ArrowLeft', true) && scene.view.x < -slow);
  assert.ok(applyKey(scene, 'ArrowUp', false) && scene.view.y > 0);
  const { x, y } = scene.view;
  assert.ok(applyKey(scene, '+', false) && scene.view.scale > 10);
  assert.ok(applyKey(scene, '-', false) && Math.abs(scene.view.scale - 10) < 1e-9);
  assert.ok(Math.hypot(scene.view.x - x, scene.view.y - y) < 1e-9);
  assert.ok(applyKey(scene, '0', false) && scene.fits === 1);
  assert.equal(applyKey(scene, 'Tab', false), false);
});

test('browser shortcuts are ignored', () => {
  const { canvas, scene } = attached();
  const event = canvas.send('keydown', { key: '+', ctrlKey: true });
  assert.equal(scene.view.scale, 10);
  assert.equal(event.defaultPrevented, false);
});

test('a detached navigation is inactive', () => {
  const { canvas, scene, changes, detach } = attached();
  detach();
  canvas.send('keydown', { key: '+' });
  assert.equal(scene.view.scale, 10);
  assert.equal(changes(), 0);
});
