/** The visible part of the world. World y points up, CSS y points down. */
export interface View {
  /** World coordinates of the canvas centre. */
  x: number;
  y: number;
  /** CSS pixels per unit of length. */
  scale: number;
}

/** Size of a canvas, in CSS pixels. */
export interface Size {
  width: number;
  height: number;
}

/** A box in world coordinates. */
export interface Bounds {
  left: number;
  bottom: number;
  right: number;
  top: number;
}

/** Limits of View.scale: shaders compute in single precision. */
const SMALLEST_SCALE = 1e-30;
const LARGEST_SCALE = 1e30;

/** Margin around fitted bounds, as a share of the canvas. */
const MARGIN = 0.06;

export function toWorld(view: View, size: Size, cssX: number, cssY: number): [number, number] {
  return [
    view.x + (cssX - size.width / 2) / view.scale,
    view.y - (cssY - size.height / 2) / view.scale,
  ];
}

export function toCss(view: View, size: Size, x: number, y: number): [number, number] {
  return [
    (x - view.x) * view.scale + size.width / 2,
    (view.y - y) * view.scale + size.height / 2,
  ];
}

/** The view zoomed by `factor` about a CSS position. */
export function zoomAt(view: View, size: Size, cssX: number, cssY: number, factor: number): View {
  const scale = Math.min(Math.max(view.scale * factor, SMALLEST_SCALE), LARGEST_SCALE);
  const [x, y] = toWorld(view, size, cssX, cssY);
  return {
    x: x - (cssX - size.width / 2) / scale,
    y: y + (cssY - size.height / 2) / scale,
    scale,
  };
}

/** The view with its content moved by CSS pixels. */
export function panBy(view: View, right: number, down: number): View {
  return { x: view.x - right / view.scale, y: view.y + down / view.scale, scale: view.scale };
}

/** The view in which the bounds fill the canvas, with a margin. */
export function fitBounds(bounds: Bounds, size: Size): View {
  const room = 1 - 2 * MARGIN;
  const horizontal = (size.width * room) / (bounds.right - bounds.left);
  const vertical = (size.height * room) / (bounds.top - bounds.bottom);
  const scale = Math.min(horizontal, vertical);
  return {
    x: (bounds.left + bounds.right) / 2,
    y: (bounds.bottom + bounds.top) / 2,
    scale: Number.isFinite(scale) && scale > 0 ? Math.min(scale, LARGEST_SCALE) : 1,
  };
}

/** The box of the finite points; null if there are none. */
export function boundsOf(points: Float32Array, origin: readonly [number, number]): Bounds | null {
  let [left, bottom, right, top] = [Infinity, Infinity, -Infinity, -Infinity];
  for (let k = 0; k + 1 < points.length; k += 2) {
    const x = points[k];
    const y = points[k + 1];
    if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
    if (x < left) left = x;
    if (x > right) right = x;
    if (y < bottom) bottom = y;
    if (y > top) top = y;
  }
  if (left > right) return null;
  return {
    left: left + origin[0],
    bottom: bottom + origin[1],
    right: right + origin[0],
    top: top + origin[1],
  };
}

export function union(a: Bounds, b: Bounds): Bounds {
  return {
    left: Math.min(a.left, b.left), bottom: Math.min(a.bottom, b.bottom),
    right: Math.max(a.right, b.right), top: Math.max(a.top, b.top),
  };
}
