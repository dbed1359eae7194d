import { wheelFactor } from '../draw/navigation';
import { type Camera, panBy, type SpaceView, turnBy, zoomAt } from './camera';

/** The part of a scene that navigation uses. */
export interface Turnable { view: SpaceView; readonly camera: Camera; fit(): void }

const KEY_ZOOM = 1.25;
const KEY_PIXELS = 24;
const FAST = 4;
/** A pointer that moves farther between press and release drags instead of clicking. */
const CLICK_PIXELS = 4;

const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
};

/** Applies a key: arrows turn, with Shift they pan; + and - zoom, 0 fits. Returns false for other keys. */
export function applySpaceKey(scene: Turnable, key: string, shift: boolean): boolean {
  const { camera } = scene;
  const { width, height } = camera.size;
  const arrow = ARROWS[key];
  if (arrow && shift) scene.view = panBy(camera, arrow[0] * FAST * KEY_PIXELS, arrow[1] * FAST * KEY_PIXELS);
  else if (arrow) scene.view = turnBy(scene.view, camera.size, arrow[0] * KEY_PIXELS, arrow[1] * KEY_PIXELS);
  else if (key === '+' || key === '=') scene.view = zoomAt(camera, width / 2, height / 2, KEY_ZOOM);
  else if (key === '-' || key === '_') scene.view = zoomAt(camera, width / 2, height / 2, 1 / KEY_ZOOM);
  else if (key === '0') scene.fit();
  else return false;
  return true;
}

interface Grip { x: number; y: number; apart: number }

function gripOf(pointers: ReadonlyMap<number, { x: number; y: number }>): Grip {
  const [first, second] = pointers.values();
  if (!second) return { ...first, apart: 0 };
  return { x: (first.x + second.x) / 2, y: (first.y + second.y) / 2, apart: Math.hypot(first.x - second.x, first.y - second.y) };
}

/**
 * Turns by a drag, pans by a drag with Shift or another button or two fingers, zooms to the pointer by the wheel or two
 * fingers, and takes keys. A click that ends a drag is not passed on. Returns a function: true during a drag.
 */
export function attachSpaceNavigation(canvas: HTMLCanvasElement, scene: Turnable, onChange: () => void): () => boolean {
  const pointers = new Map<number, { x: number; y: number }>();
  let isPanning = false;
  let travelled = 0;
  canvas.style.touchAction = 'none';
  canvas.addEventListener('pointerdown', (event) => {
    if (pointers.size === 0) travelled = 0;
    isPanning = event.shiftKey || event.button !== 0;
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!pointers.has(event.pointerId)) return;
    const before = gripOf(pointers);
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    const after = gripOf(pointers);
    const [right, down] = [after.x - before.x, after.y - before.y];
    travelled += Math.hypot(right, down) + Math.abs(after.apart - before.apart);
    if (isPanning || after.apart > 0) scene.view = panBy(scene.camera, right, down);
    else scene.view = turnBy(scene.view, scene.camera.size, right, down);
    if (before.apart > 0 && after.apart > 0) {
      scene.view = zoomAt(scene.camera, after.x, after.y, after.apart / before.apart);
    }
    onChange();
  });
  for (const name of ['pointerup', 'pointercancel'] as const) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('click', (event) => {
    if (travelled > CLICK_PIXELS) event.stopImmediatePropagation();
    travelled = 0;
  }, { capture: true });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    scene.view = zoomAt(scene.camera, event.offsetX, event.offsetY, wheelFactor(event));
    onChange();
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (!applySpaceKey(scene, event.key, event.shiftKey)) return;
    event.preventDefault();
    onChange();
  });
  return () => pointers.size > 0;
}
