// Measurements of an outline, by the same rules as in the core (core/GAUGES.md). Intersections are exact.
import { anglesOfRepose, contactAngles } from './angles';
import type { Gauge } from './kinds';
import { lineCrossings, type MeasuredRings, type Point } from './rings';

/**
 * The values of a gauge, in the order of its kind. A height, position, centroid or angle is NaN if
 * the outline does not have it. A length, an area or a number of crossings is 0 in this case.
 */
export function measure({ kind, numbers: n }: Gauge, outline: MeasuredRings): number[] {
  switch (kind) {
    case 'height': return heightAt(outline.rings, n[0]);
    case 'front': return front(outline.rings, [n[0], n[1]]);
    case 'wetted': return [wettedLength(outline.rings, [n[0], n[1]], [n[2], n[3]])];
    case 'box': return areaInBox(outline.rings, [n[0], n[1]], [n[2], n[3]]);
    case 'contact': return contactAngles(outline, [n[0], n[1]], [n[2], n[3]], n[4]);
    case 'repose': return anglesOfRepose(outline);
  }
}

function heightAt(rings: readonly Point[][], x: number): number[] {
  const heights = lineCrossings(rings, [x, 0], [0, 1]);
  return [heights[heights.length - 1] ?? NaN, heights[0] ?? NaN, heights.length];
}

function front(rings: readonly Point[][], [dx, dy]: Point): number[] {
  const length = Math.hypot(dx, dy);
  let farthest = [NaN, NaN, NaN];
  for (const ring of rings) {
    for (const [x, y] of ring) {
      const position = (dx * x + dy * y) / length;
      if (!(position <= farthest[0])) farthest = [position, x, y];
    }
  }
  return farthest;
}

function wettedLength(rings: readonly Point[][], from: Point, to: Point): number {
  const line: Point = [to[0] - from[0], to[1] - from[1]];
  const crossings = lineCrossings(rings, from, line).map((at) => Math.min(1, Math.max(0, at)));
  let inside = 0;
  for (let k = 0; k + 1 < crossings.length; k += 2) inside += crossings[k + 1] - crossings[k];
  return inside * Math.hypot(...line);
}

/** The part of a closed polygon where the linear function `depth` is not negative. */
function clipped(polygon: readonly Point[], depth: (point: Point) => number): Point[] {
  const kept: Point[] = [];
  polygon.forEach((b, k) => {
    const a = polygon[(k || polygon.length) - 1];
    const [depthOfA, depthOfB] = [depth(a), depth(b)];
    if ((depthOfA >= 0) !== (depthOfB >= 0)) {
      const share = depthOfA / (depthOfA - depthOfB);
      kept.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
    }
    if (depthOfB >= 0) kept.push(b);
  });
  return kept;
}

/** If a box lies in a hole, the areas of the clipped outer ring and hole cancel, up to this share of both. */
const ROUNDING = 1e-14;

/** Area of the outline within a box, and its centroid. Without area: 0 and NaN. */
function areaInBox(rings: readonly Point[][], min: Point, max: Point): number[] {
  // Relative to the middle of the box, so that the sums lose no digits far from the origin.
  const middle: Point = [min[0] + (max[0] - min[0]) / 2, min[1] + (max[1] - min[1]) / 2];
  let [twice, momentX, momentY, magnitude] = [0, 0, 0, 0];
  for (const ring of rings) {
    const walls = [
      ([x]: Point) => x - min[0], ([x]: Point) => max[0] - x,
      ([, y]: Point) => y - min[1], ([, y]: Point) => max[1] - y,
    ];
    const polygon = walls.reduce<readonly Point[]>((part, wall) => clipped(part, wall), ring)
      .map(([x, y]): Point => [x - middle[0], y - middle[1]]);
    polygon.forEach((a, k) => {
      const b = polygon[(k + 1) % polygon.length];
      const cross = a[0] * b[1] - b[0] * a[1];
      twice += cross;
      magnitude += Math.abs(cross);
      momentX += (a[0] + b[0]) * cross;
      momentY += (a[1] + b[1]) * cross;
    });
  }
  if (Math.abs(twice) <= ROUNDING * magnitude) return [0, NaN, NaN];
  return [twice / 2, middle[0] + momentX / (3 * twice), middle[1] + momentY / (3 * twice)];
}
