import type { Frame } from '../protocol/frame';

/** A number of the frame at a position. */
export interface Value { name: string; value: number }

/** Barycentric coordinates of a position in a triangle; null outside it, and for a triangle without area. */
function weightsAt(ax: number, ay: number, bx: number, by: number, cx: number, cy: number,
                   x: number, y: number): [number, number, number] | null {
  const whole = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
  if (whole === 0) return null;
  const b = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / whole;
  const c = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / whole;
  return b >= 0 && c >= 0 && b + c <= 1 ? [1 - b - c, b, c] : null;
}

/** Index of the nearest point within a distance; -1 if there is none. */
function nearest(points: Float32Array, x: number, y: number, within: number): number {
  let best = within * within;
  let found = -1;
  for (let k = 0; k < points.length; k += 2) {
    const away = (points[k] - x) ** 2 + (points[k + 1] - y) ** 2;
    if (away > best) continue;
    best = away;
    found = k / 2;
  }
  return found;
}

/**
 * Values of the attributes at a position relative to the frame's origin: interpolated in the mesh as
 * the colours are, else of the nearest vertex, else of the nearest particle, within `tolerance`.
 */
export function valuesAt(frame: Frame, names: readonly string[], x: number, y: number, tolerance: number): Value[] {
  const { mesh, rings, particles, particleAttributes } = frame;
  const found = (read: (name: string) => number | undefined): Value[] => names
    .map((name) => ({ name, value: read(name) ?? NaN })).filter(({ value }) => Number.isFinite(value));
  if (mesh && names.some((name) => mesh.attribute(name))) {
    const { points, triangles } = mesh;
    for (let k = 0; k < triangles.length; k += 3) {
      const corners = [triangles[k], triangles[k + 1], triangles[k + 2]];
      const [ax, ay, bx, by, cx, cy] = corners.flatMap((corner) => [points[2 * corner], points[2 * corner + 1]]);
      const weights = weightsAt(ax, ay, bx, by, cx, cy, x, y);
      if (!weights) continue;
      return found((name) => {
        const values = mesh.attribute(name);
        return values && corners.reduce((sum, corner, i) => sum + weights[i] * values[corner], 0);
      });
    }
  }
  const vertex = nearest(rings.points, x, y, tolerance);
  const atVertex = vertex < 0 ? [] : found((name) => rings.attributes.get(name)?.[vertex]);
  if (atVertex.length > 0 || !particles || !particleAttributes) return atVertex;
  const particle = nearest(particles, x, y, tolerance);
  return particle < 0 ? [] : found((name) => particleAttributes.get(name)?.[particle]);
}
