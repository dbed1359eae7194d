import { type View, type Size, toCss } from '../draw/view';
import type { Mesh, Rings } from '../protocol/frame';

/** Points relative to an origin, as a picture of this view and size has them, in CSS pixels. */
export class Projection {
  private readonly scale: number;
  private readonly left: number;
  private readonly top: number;

  constructor(view: View, private readonly size: Size, origin: readonly [number, number]) {
    this.scale = view.scale;
    [this.left, this.top] = toCss(view, size, origin[0], origin[1]);
  }

  x(points: Float32Array, k: number): number {
    return this.left + points[2 * k] * this.scale;
  }

  y(points: Float32Array, k: number): number {
    return this.top - points[2 * k + 1] * this.scale;
  }

  /** As a path's coordinates. */
  place(points: Float32Array, k: number): string {
    return `${short(this.x(points, k))} ${short(this.y(points, k))}`;
  }

  /** Whether a figure through these points may be seen: their box touches the picture's. */
  sees(points: Float32Array, members: Iterable<number>): boolean {
    let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const k of members) {
      left = Math.min(left, this.x(points, k));
      right = Math.max(right, this.x(points, k));
      top = Math.min(top, this.y(points, k));
      bottom = Math.max(bottom, this.y(points, k));
    }
    return right >= 0 && bottom >= 0 && left <= this.size.width && top <= this.size.height;
  }
}

/** Hundredths of a pixel: finer than any screen shows. */
export function short(pixels: number): string {
  return String(Math.round(pixels * 100) / 100);
}

/** The rings as closed figures; those out of sight are left out. */
export function ringPath(rings: Rings, which: Iterable<number>, at: Projection): string {
  let path = '';
  for (const ring of which) {
    const [first, end] = [rings.offsets[ring], rings.offsets[ring + 1]];
    if (!at.sees(rings.points, range(first, end))) continue;
    for (let k = first; k < end; ++k) path += (k === first ? 'M' : 'L') + at.place(rings.points, k);
    path += 'Z';
  }
  return path;
}

/** Triangles as closed figures, by what `keyOf` makes of each; null leaves one out. */
export function trianglePaths<Key>(
  mesh: Mesh, keyOf: (triangle: number) => Key | null, at: Projection,
): Map<Key, string> {
  const { points, triangles } = mesh;
  const paths = new Map<Key, string>();
  for (let k = 0; k < triangles.length; k += 3) {
    const key = keyOf(k / 3);
    const corners = triangles.subarray(k, k + 3);
    if (key === null || !at.sees(points, corners)) continue;
    const [a, b, c] = corners;
    const path = `M${at.place(points, a)}L${at.place(points, b)}L${at.place(points, c)}Z`;
    paths.set(key, (paths.get(key) ?? '') + path);
  }
  return paths;
}

/** Edges of the triangles by what `keyOf` makes of a point of each, every edge once. */
export function edgePaths<Key>(
  mesh: Mesh, keyOf: (point: number) => Key, at: Projection,
): Map<Key, string> {
  const { points, triangles } = mesh;
  const count = points.length / 2;
  const drawn = new Set<number>();
  const paths = new Map<Key, string>();
  for (let k = 0; k < triangles.length; ++k) {
    const from = triangles[k];
    const to = triangles[k % 3 === 2 ? k - 2 : k + 1];
    const edge = Math.min(from, to) * count + Math.max(from, to);
    if (drawn.has(edge) || !at.sees(points, [from, to])) continue;
    drawn.add(edge);
    const key = keyOf(from);
    const path = `M${at.place(points, from)}L${at.place(points, to)}`;
    paths.set(key, (paths.get(key) ?? '') + path);
  }
  return paths;
}

/** A line without length and with round ends is a dot. */
export function dotPath(points: Float32Array, at: Projection): string {
  let path = '';
  for (let k = 0; k < points.length / 2; ++k) {
    if (at.sees(points, [k])) path += `M${at.place(points, k)}h0`;
  }
  return path;
}

/** Lines of so many CSS pixels along the normals of every n-th point. */
export function normalPath(
  points: Float32Array, normals: Float32Array, stride: number, length: number, at: Projection,
): string {
  let path = '';
  for (let k = 0; k < points.length / 2; k += stride) {
    if (!at.sees(points, [k])) continue;
    path += `M${at.place(points, k)}l${short(length * normals[2 * k])} ` +
      `${short(-length * normals[2 * k + 1])}`;
  }
  return path;
}

/**
 * The rings cut where their colour changes, by colour: `colourOf` is that of the segment between a
 * point and the next.
 */
export function segmentPaths(
  rings: Rings, colourOf: (point: number, next: number) => string, at: Projection,
): Map<string, string> {
  const { points, offsets } = rings;
  const paths = new Map<string, string>();
  for (let ring = 0; ring + 1 < offsets.length; ++ring) {
    const [first, end] = [offsets[ring], offsets[ring + 1]];
    if (!at.sees(points, range(first, end))) continue;
    let colour = '';
    for (let k = first; k < end; ++k) {
      const next = k + 1 < end ? k + 1 : first;
      const own = colourOf(k, next);
      const begin = own === colour ? '' : `M${at.place(points, k)}`;
      colour = own;
      paths.set(own, `${paths.get(own) ?? ''}${begin}L${at.place(points, next)}`);
    }
  }
  return paths;
}

function* range(first: number, end: number): Generator<number> {
  for (let k = first; k < end; ++k) yield k;
}
