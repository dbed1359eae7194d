/** The effects of gestures on a canvas. All lengths are in CSS pixels. */
export interface Gestures {
  /** A pointer is pressed. If this returns false, the pointer is ignored until it is pressed again. */
  press(event: PointerEvent): boolean;
  /** The pressed pointer, or the middle of two fingers (`hasTwo`), has moved by this distance. */
  drag(right: number, down: number, hasTwo: boolean): void;
  /** Two fingers, or the wheel, zoom by a factor about a place. */
  zoom(x: number, y: number, factor: number): void;
  /** Applies a key. False: the key has no meaning for the canvas, and the page may use it. */
  key(key: string, shift: boolean): boolean;
}

/** Exponent of the zoom per CSS pixel of the wheel. A notch of 100 pixels zooms by 1.22. */
const WHEEL_RATE = 0.002;
/** Exponent of the zoom per pixel of a pinch on a touchpad, which arrives as a wheel event with Ctrl. */
const PINCH_RATE = 0.01;
const LINE_PIXELS = 16;
const PAGE_PIXELS = 400;
/** A pointer that moves farther between press and release drags instead of clicking. */
const CLICK_PIXELS = 4;

/** Zoom per key press. */
export const KEY_ZOOM = 1.25;
/** Factor of the distance of a pan by a key with Shift. */
export const FAST = 4;

/** Movement of the content by each arrow key, to the right and down: opposite to the arrow. */
export const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
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

interface Place { x: number; y: number }

/** Centre and distance of two fingers, or one pointer with distance 0. */
interface Grip extends Place { apart: number }

function gripOf(pointers: ReadonlyMap<number, Place>): Grip {
  const [first, second] = pointers.values();
  if (!second) return { ...first, apart: 0 };
  return {
    x: (first.x + second.x) / 2,
    y: (first.y + second.y) / 2,
    apart: Math.hypot(first.x - second.x, first.y - second.y),
  };
}

/**
 * Applies pointer, touch, wheel and keys on a canvas, and then calls `onChange`. A click that ends a drag is not passed
 * on. `scrolls`: the document scrolls, so the wheel zooms only with Ctrl and a vertical swipe scrolls. `detach` removes
 * the listeners.
 */
export function attachGestures(canvas: HTMLCanvasElement, gestures: Gestures, onChange: () => void, scrolls = false): {
  detach(): void;
  isDragging(): boolean;
} {
  const pointers = new Map<number, Place>();
  let travelled = 0;

  const onPointerDown = (event: PointerEvent): void => {
    if (!gestures.press(event)) return;
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
    gestures.drag(right, down, pointers.size > 1);
    if (before.apart > 0 && after.apart > 0) gestures.zoom(after.x, after.y, after.apart / before.apart);
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
    gestures.zoom(event.offsetX, event.offsetY, wheelFactor(event));
    onChange();
  };

  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (!gestures.key(event.key, event.shiftKey)) return;
    event.preventDefault();
    onChange();
  };

  const controller = new AbortController();
  const { signal } = controller;
  canvas.style.touchAction = scrolls ? 'pan-y' : 'none';
  canvas.addEventListener('pointerdown', onPointerDown, { signal });
  canvas.addEventListener('pointermove', onPointerMove, { signal });
  // A canvas that is hidden during a drag loses the capture, and receives no release.
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
    canvas.addEventListener(name, onPointerEnd, { signal });
  }
  canvas.addEventListener('click', onClick, { signal, capture: true });
  canvas.addEventListener('wheel', onWheel, { signal, passive: false });
  canvas.addEventListener('keydown', onKeyDown, { signal });
  return { detach: () => controller.abort(), isDragging: () => pointers.size > 0 };
}
