import { type View, type Size, toCss } from '../draw/view';
import type { Mesh, Rings } from '../protocol/frame';

/** Projects points relative to an origin to CSS pixels of a view. */
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

  /** Coordinates of point `k` as text in a path. */
  text(points: Float32Array, k: number): string {
    return `${short(this.x(points, k))} ${short(this.y(points, k))}`;
  }

  /** Whether the box of these points touches the picture. */
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

/** Rounds to hundredths of a pixel. */
export function short(pixels: number): string {
  return String(Math.round(pixels * 100) / 100);
}

/** Path of the rings. Rings outside the picture are left out. */
export function ringPath(rings: Rings, which: Iterable<number>, at: Projection): string {
  let path = '';
  for (const ring of which) {
    const [first, end] = [rings.offsets[ring], rings.offsets[ring + 1]];
    if (!at.sees(rings.points, range(first, end))) continue;
    for (let k = first; k < end; ++k) path += (k === first ? 'M' : 'L') + at.text(rings.points, k);
    path += 'Z';
  }
  return path;
}

/** Path of the rings without segments on a face of the periodic box. Rings outside the picture are left out. */
export function outlinePath(rings: Rings, which: Iterable<number>, at: Projection): string {
  const cuts = new Set(rings.cuts);
  let path = '';
  for (const ring of which) {
    const vertices = [...range(rings.offsets[ring], rings.offsets[ring + 1])];
    if (!vertices.some((k) => cuts.has(k))) {
      path += ringPath(rings, [ring], at);
      continue;
    }
    if (!at.sees(rings.points, vertices)) continue;
    vertices.forEach((k, place) => {
      const next = vertices[(place + 1) % vertices.length];
      if (!cuts.has(k)) path += `M${at.text(rings.points, k)}L${at.text(rings.points, next)}`;
    });
  }
  return path;
}

/** Paths of triangles, grouped by `keyOf`. A null key leaves a triangle out. */
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
    const path = `M${at.text(points, a)}L${at.text(points, b)}L${at.text(points, c)}Z`;
    paths.set(key, (paths.get(key) ?? '') + path);
  }
  return paths;
}

/** Paths of the edges, grouped by `keyOf` of their first point. Every edge occurs once. */
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
    const path = `M${at.text(points, from)}L${at.text(points, to)}`;
    paths.set(key, (paths.get(key) ?? '') + path);
  }
  return paths;
}

/** Path of dots: lines without length, for round line caps. */
export function dotPath(points: Float32Array, at: Projection): string {
  let path = '';
  for (let k = 0; k < points.length / 2; ++k) {
    if (at.sees(points, [k])) path += `M${at.text(points, k)}h0`;
  }
  return path;
}

/** Path of the normals of every `stride`-th vertex, `length` CSS pixels long. */
export function normalPath(
  points: Float32Array, normals: Float32Array, stride: number, length: number, at: Projection,
): string {
  let path = '';
  for (let k = 0; k < points.length / 2; k += stride) {
    if (!at.sees(points, [k])) continue;
    path += `M${at.text(points, k)}l${short(length * normals[2 * k])} ` +
      `${short(-length * normals[2 * k + 1])}`;
  }
  return path;
}

/** Paths of the segments of rings, grouped by the colour of a segment. */
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
      const begin = own === colour ? '' : `M${at.text(points, k)}`;
      colour = own;
      paths.set(own, `${paths.get(own) ?? ''}${begin}L${at.text(points, next)}`);
    }
  }
  return paths;
}

/**
 * Paths of the mesh, one for each of `bands` equal parts of the values from 0 to 1. Values are
 * linear in a triangle, so each triangle is cut at the limits of the bands.
 */
export function bandPaths(
  mesh: Mesh, valueOf: (point: number) => number, bands: number, at: Projection,
): string[] {
  const { points, triangles } = mesh;
  const paths = new Array<string>(bands).fill('');
  const bandOf = (value: number) => Math.max(0, Math.min(bands - 1, Math.floor(value * bands)));
  for (let k = 0; k < triangles.length; k += 3) {
    const corners = triangles.subarray(k, k + 3);
    if (!at.sees(points, corners)) continue;
    let rest = Array.from(corners, (point): Corner =>
      [at.x(points, point), at.y(points, point), valueOf(point)]);
    const values = rest.map(([, , value]) => value);
    if (!values.every(Number.isFinite)) continue;
    const last = bandOf(Math.max(...values));
    for (let band = bandOf(Math.min(...values)); band <= last; ++band) {
      const part = band === last ? rest : clip(rest, (band + 1) / bands, -1);
      if (part.length > 2) paths[band] += `M${part.map(([x, y]) => `${short(x)} ${short(y)}`).join('L')}Z`;
      rest = clip(rest, (band + 1) / bands, 1);
    }
  }
  return paths;
}

/** x, y, value. */
type Corner = [number, number, number];

/** The part of a convex polygon with values above `limit` (side 1) or below (side -1). */
function clip(polygon: Corner[], limit: number, side: 1 | -1): Corner[] {
  const kept: Corner[] = [];
  polygon.forEach((from, k) => {
    const to = polygon[(k + 1) % polygon.length];
    const isInside = side * (from[2] - limit) >= 0;
    if (isInside) kept.push(from);
    if (isInside === (side * (to[2] - limit) >= 0)) return;
    const share = (limit - from[2]) / (to[2] - from[2]);
    kept.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), limit]);
  });
  return kept;
}

function* range(first: number, end: number): Generator<number> {
  for (let k = first; k < end; ++k) yield k;
}
