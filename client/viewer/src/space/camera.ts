import type { Size } from '../draw/view';

export type Vector = readonly [number, number, number];

/** A camera that looks at a target. The z axis points up. */
export interface SpaceView {
  /** World coordinates of the target, which lies in the middle of the picture. */
  target: Vector;
  /** Direction of the camera, seen from the target: angle around z from the x axis, and above the horizon. In radians. */
  turn: number;
  tilt: number;
  /** Height of the picture at the target, in world units. */
  height: number;
}

/** A camera's view and its kind. */
export interface Camera { view: SpaceView; isPerspective: boolean; size: Size }

/** A box in world coordinates. */
export interface Box { low: Vector; high: Vector }

export const DEFAULT_VIEW: Readonly<SpaceView> = { target: [0, 0, 0], turn: -1.05, tilt: 0.42, height: 1 };

/** Vertical angle of a perspective picture, in degrees. */
export const FIELD_OF_VIEW = 35;
/** Smallest depth that a perspective camera shows, as a share of its distance from the target. */
export const NEAREST = 1e-3;
const HALF_ANGLE = Math.tan(FIELD_OF_VIEW / 2 * Math.PI / 180);
const MARGIN = 0.1;
/** A drag over the height of the picture turns by this angle. */
const TURN_RADIANS = Math.PI;
const STEEPEST = Math.PI / 2;
/** Limits of the picture's height, as shares of the content's diagonal. float32 resolves nothing smaller. */
const NEAREST_ZOOM = 1e-4;
const FARTHEST_ZOOM = 100;
/** Limits of the picture's height for any content, in world units. */
const SMALLEST_HEIGHT = 1e-30;
const LARGEST_HEIGHT = 1e30;

const limited = (height: number) => Math.min(Math.max(height, SMALLEST_HEIGHT), LARGEST_HEIGHT);

export const plus = (a: Vector, b: Vector, share = 1): Vector =>
  [a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]];
export const minus = (a: Vector, b: Vector): Vector => plus(a, b, -1);
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Vector k of an array. */
export function vectorAt(numbers: Float32Array, k: number): Vector {
  return [numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]];
}

/** Unit vectors of the picture: to the right, up, and to the camera. */
export function axesOf({ turn, tilt }: SpaceView): { right: Vector; up: Vector; back: Vector } {
  const [c, s, ct, st] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
  return { right: [-s, c, 0], up: [-st * c, -st * s, ct], back: [ct * c, ct * s, st] };
}

/** Distance of the camera from its target. */
export function distanceOf({ height }: SpaceView): number {
  return height / 2 / HALF_ANGLE;
}

/** World units per CSS pixel at the target. */
export function unitsPerPixel({ view, size }: Camera): number {
  return view.height / Math.max(1, size.height);
}

export function turnBy(view: SpaceView, size: Size, right: number, down: number): SpaceView {
  const rate = TURN_RADIANS / Math.max(1, size.height);
  const tilt = Math.min(Math.max(view.tilt + down * rate, -STEEPEST), STEEPEST);
  return { ...view, turn: (view.turn - right * rate) % (2 * Math.PI), tilt };
}

export function panBy(camera: Camera, rightPixels: number, down: number): SpaceView {
  const unit = unitsPerPixel(camera);
  const { right, up } = axesOf(camera.view);
  return { ...camera.view, target: plus(plus(camera.view.target, right, -rightPixels * unit), up, down * unit) };
}

/** The point under a CSS position, in the plane through the target that faces the camera. */
export function pointAt(camera: Camera, x: number, y: number): Vector {
  const unit = unitsPerPixel(camera);
  const { right, up } = axesOf(camera.view);
  const { width, height } = camera.size;
  return plus(plus(camera.view.target, right, (x - width / 2) * unit), up, (height / 2 - y) * unit);
}

/**
 * The view zoomed by `factor`. The point under the CSS position stays there. `content`: the box of the content, which
 * bounds the zoom; null: unknown. A view beyond these bounds can only zoom back towards them.
 */
export function zoomAt(camera: Camera, x: number, y: number, factor: number, content: Box | null = null): SpaceView {
  const { view } = camera;
  const size = content ? Math.hypot(...minus(content.high, content.low)) : 0;
  const [least, most] = size > 0 ? [NEAREST_ZOOM * size, FARTHEST_ZOOM * size] : [SMALLEST_HEIGHT, LARGEST_HEIGHT];
  const height = factor > 1 ? Math.max(limited(view.height / factor), Math.min(view.height, least))
    : Math.min(limited(view.height / factor), Math.max(view.height, most));
  const fixed = pointAt(camera, x, y);
  return { ...view, height, target: plus(fixed, minus(view.target, fixed), height / view.height) };
}

export function cornersOf({ low, high }: Box): Vector[] {
  return Array.from({ length: 8 }, (_, k): Vector =>
    [k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]]);
}

/** The view from the same direction that shows the whole box. */
export function fitBox(camera: Camera, box: Box): SpaceView {
  const { view, isPerspective, size } = camera;
  const target = plus(box.low, minus(box.high, box.low), 0.5);
  const { right, up, back } = axesOf(view);
  const aspect = Math.max(1, size.width) / Math.max(1, size.height);
  let height = 0;
  for (const corner of cornersOf(box)) {
    const apart = minus(corner, target);
    const reach = Math.max(Math.abs(dot(apart, up)), Math.abs(dot(apart, right)) / aspect) / (1 - MARGIN);
    const nearer = isPerspective ? HALF_ANGLE * dot(apart, back) : 0;
    height = Math.max(height, 2 * (reach + nearer));
  }
  return { ...view, target, height: height > 0 ? limited(height) : 1 };
}

/** CSS position of a point, and its distance from the target's plane towards the camera. Null: behind the camera. */
export function project(camera: Camera, point: Vector): { x: number; y: number; nearer: number } | null {
  const { view, isPerspective, size } = camera;
  const { right, up, back } = axesOf(view);
  const apart = minus(point, view.target);
  const nearer = dot(apart, back);
  const distance = distanceOf(view);
  if (isPerspective && nearer >= distance) return null;
  const scale = (isPerspective ? distance / (distance - nearer) : 1) / unitsPerPixel(camera);
  return { x: size.width / 2 + dot(apart, right) * scale, y: size.height / 2 - dot(apart, up) * scale, nearer };
}

/** Points in CSS pixels. Larger numbers of `near` are nearer; planes and lines have linear numbers. NaN: behind the camera. */
export interface Projected { x: Float32Array; y: Float32Array; near: Float32Array }

/** The numbers of `Projected.near` at a distance from the target's plane towards the camera. */
export function nearOf({ view, isPerspective }: Camera, nearer: number): number {
  if (!isPerspective) return nearer;
  const distance = distanceOf(view);
  return distance - nearer > NEAREST * distance ? 1 / (distance - nearer) : NaN;
}

/** Projects all points, which are relative to `origin`. */
export function projectAll(camera: Camera, positions: Float32Array, origin: Vector): Projected {
  const { view, isPerspective, size } = camera;
  const { right, up, back } = axesOf(view);
  const [tx, ty, tz] = minus(view.target, origin);
  const [unit, distance, count] = [unitsPerPixel(camera), distanceOf(view), positions.length / 3];
  const at = { x: new Float32Array(count), y: new Float32Array(count), near: new Float32Array(count) };
  for (let k = 0, i = 0; k < count; ++k, i += 3) {
    const [px, py, pz] = [positions[i] - tx, positions[i + 1] - ty, positions[i + 2] - tz];
    const near = nearOf(camera, px * back[0] + py * back[1] + pz * back[2]);
    const scale = (isPerspective ? distance * near : 1) / unit;
    at.x[k] = size.width / 2 + scale * (px * right[0] + py * right[1] + pz * right[2]);
    at.y[k] = size.height / 2 - scale * (px * up[0] + py * up[1] + pz * up[2]);
    at.near[k] = near;
  }
  return at;
}

/** The ray through a CSS position, from the camera or (parallel view) from the target's plane. `along`: any length. */
export function rayAt(camera: Camera, x: number, y: number): { from: Vector; along: Vector } {
  const { view, isPerspective } = camera;
  const { back } = axesOf(view);
  const at = pointAt(camera, x, y);
  if (!isPerspective) return { from: at, along: [-back[0], -back[1], -back[2]] };
  const from = plus(view.target, back, distanceOf(view));
  return { from, along: minus(at, from) };
}

export function unionOf(a: Box | null, b: Box): Box {
  if (!a) return b;
  const pick = (choose: (...of: number[]) => number, one: Vector, other: Vector): Vector =>
    [choose(one[0], other[0]), choose(one[1], other[1]), choose(one[2], other[2])];
  return { low: pick(Math.min, a.low, b.low), high: pick(Math.max, a.high, b.high) };
}

/** Text of a view for the page's address: `1,2,3,-1.05,0.42,10` has target, turn, tilt and height. */
export function viewText({ target, turn, tilt, height }: SpaceView): string {
  return [...target, turn, tilt, height].map((value) => Number(value.toPrecision(6))).join(',');
}

export function parseSpaceView(text: string | null): SpaceView | null {
  const [x, y, z, turn, tilt, height] = (text ?? '').split(',').map(Number);
  if (![x, y, z, turn, tilt, height].every(Number.isFinite) || !(height > 0)) return null;
  return { target: [x, y, z], turn, tilt: Math.min(Math.max(tilt, -STEEPEST), STEEPEST), height: limited(height) };
}
