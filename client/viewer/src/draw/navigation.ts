import { panBy, zoomAt, type Size, type View } from './view';

/** The part of a scene that navigation uses. */
export interface Navigable {
  view: View;
  readonly size: Size;
  fit(): void;
}

/** Exponent of the zoom per CSS pixel of the wheel. A notch of 100 pixels zooms by 1.22. */
const WHEEL_RATE = 0.002;
/** The same for a pinch on a touchpad, which arrives as a wheel event with Ctrl. */
const PINCH_RATE = 0.01;
const LINE_PIXELS = 16;
const PAGE_PIXELS = 400;
/** Zoom and pan per key press. */
const KEY_ZOOM = 1.25;
const KEY_PAN = 48;
const FAST = 4;
/** A pointer that moves farther between press and release drags instead of clicking. */
const CLICK_PIXELS = 4;

const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [1, 0],
  ArrowRight: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** Zoom factor of a wheel event. */
export function wheelFactor(event: Pick<WheelEvent, 'deltaY' | 'deltaMode' | 'ctrlKey'>): number {
  const unit = event.deltaMode === 1 ? LINE_PIXELS : event.deltaMode === 2 ? PAGE_PIXELS : 1;
  const pixels = Math.min(Math.max(event.deltaY * unit, -PAGE_PIXELS), PAGE_PIXELS);
  return Math.exp(-pixels * (event.ctrlKey ? PINCH_RATE : WHEEL_RATE));
}

/**
 * Applies a key to the view: arrows pan, + and - zoom about the centre, 0 fits. Returns false for
 * other keys.
 */
export function applyKey(scene: Navigable, key: string, fast: boolean): boolean {
  const { width, height } = scene.size;
  const arrow = ARROWS[key];
  if (arrow) {
    const step = fast ? FAST * KEY_PAN : KEY_PAN;
    scene.view = panBy(scene.view, arrow[0] * step, arrow[1] * step);
  } else if (key === '+' || key === '=') {
    scene.view = zoomAt(scene.view, scene.size, width / 2, height / 2, KEY_ZOOM);
  } else if (key === '-' || key === '_') {
    scene.view = zoomAt(scene.view, scene.size, width / 2, height / 2, 1 / KEY_ZOOM);
  } else if (key === '0') {
    scene.fit();
  } else {
    return false;
  }
  return true;
}

/** Centre and distance of two fingers, or one pointer with distance 0. */
interface Grip {
  x: number;
  y: number;
  apart: number;
}

/**
 * Pans and zooms the scene by pointer, touch, wheel and keys, and calls `onChange`. A click that
 * ends a drag is not passed on. `scrolls`: the document scrolls, so the wheel zooms only with Ctrl
 * and a vertical swipe scrolls. Returns a function that detaches everything.
 */
export function attachNavigation(
  canvas: HTMLCanvasElement, scene: Navigable, onChange: () => void, scrolls = false,
): () => void {
  const pointers = new Map<number, { x: number; y: number }>();
  let travelled = 0;

  const onPointerDown = (event: PointerEvent): void => {
    if (event.pointerType === 'mouse' && event.button !== 0 && event.button !== 1) return;
    if (pointers.size === 0) travelled = 0;
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    canvas.setPointerCapture(event.pointerId);
  };

  const onPointerMove = (event: PointerEvent): void => {
    if (!pointers.has(event.pointerId)) return;
    const before = gripOf(pointers);
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    const after = gripOf(pointers);
    const [right, down] = [after.x - before.x, after.y - before.y];
    travelled += Math.hypot(right, down) + Math.abs(after.apart - before.apart);
    scene.view = panBy(scene.view, right, down);
    if (before.apart > 0 && after.apart > 0) {
      scene.view = zoomAt(scene.view, scene.size, after.x, after.y, after.apart / before.apart);
    }
    onChange();
  };

  const onPointerEnd = (event: PointerEvent): void => {
    pointers.delete(event.pointerId);
  };

  const onClick = (event: MouseEvent): void => {
    if (travelled > CLICK_PIXELS) event.stopImmediatePropagation();
    travelled = 0;
  };

  const onWheel = (event: WheelEvent): void => {
    if (scrolls && !event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    scene.view = zoomAt(
      scene.view, scene.size, event.offsetX, event.offsetY, wheelFactor(event));
    onChange();
  };

  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (!applyKey(scene, event.key, event.shiftKey)) return;
    event.preventDefault();
    onChange();
  };

  const controller = new AbortController();
  const { signal } = controller;
  canvas.style.touchAction = scrolls ? 'pan-y' : 'none';
  canvas.addEventListener('pointerdown', onPointerDown, { signal });
  canvas.addEventListener('pointermove', onPointerMove, { signal });
  canvas.addEventListener('pointerup', onPointerEnd, { signal });
  canvas.addEventListener('pointercancel', onPointerEnd, { signal });
  canvas.addEventListener('click', onClick, { signal, capture: true });
  canvas.addEventListener('wheel', onWheel, { signal, passive: false });
  canvas.addEventListener('keydown', onKeyDown, { signal });
  return () => controller.abort();
}

function gripOf(pointers: ReadonlyMap<number, { x: number; y: number }>): Grip {
  const [first, second] = pointers.values();
  if (!second) return { x: first.x, y: first.y, apart: 0 };
  return {
    x: (first.x + second.x) / 2,
    y: (first.y + second.y) / 2,
    apart: Math.hypot(first.x - second.x, first.y - second.y),
  };
}
