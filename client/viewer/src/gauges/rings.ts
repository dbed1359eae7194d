import { type Frame, NO_RING } from '../protocol/frame';

export type Point = readonly [number, number];

/** The rings of a frame in world coordinates. */
export interface MeasuredRings {
  rings: Point[][];
  /** The outer ring with the largest area; null without rings. */
  largest: Point[] | null;
  spacing: number;
}

export function ringsOf({ origin: [x, y], rings, statistics }: Frame): MeasuredRings {
  const { points, offsets, outerOf, area } = rings;
  const all = Array.from({ length: offsets.length - 1 }, (_, ring) =>
    Array.from({ length: offsets[ring + 1] - offsets[ring] }, (_, k): Point => {
      const at = 2 * (offsets[ring] + k);
      return [x + points[at], y + points[at + 1]];
    }));
  let largest: number | null = null;
  for (let k = 0; k < all.length; ++k) {
    if (outerOf[k] === NO_RING && (largest === null || area[k] > area[largest])) largest = k;
  }
  return { rings: all, largest: largest === null ? null : all[largest], spacing: statistics.spacing };
}

/** Positions at which a line crosses rings, ascending: 0 at `origin`, 1 at `origin + direction`. */
export function lineCrossings(rings: readonly Point[][], origin: Point, direction: Point): number[] {
  const [dx, dy] = direction;
  const squared = dx * dx + dy * dy;
  const side = ([x, y]: Point) => dx * (y - origin[1]) - dy * (x - origin[0]);
  const along = ([x, y]: Point) => (dx * (x - origin[0]) + dy * (y - origin[1])) / squared;
  const crossings: number[] = [];
  for (const ring of rings) {
    let a = ring[ring.length - 1];
    let sideOfA = side(a);
    for (const b of ring) {
      const sideOfB = side(b);
      if ((sideOfA >= 0) !== (sideOfB >= 0)) {
        crossings.push(along(a) + sideOfA / (sideOfA - sideOfB) * (along(b) - along(a)));
      }
      [a, sideOfA] = [b, sideOfB];
    }
  }
  return crossings.sort((a, b) => a - b);
}
