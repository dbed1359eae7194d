import { number } from './format';

export type Point = readonly [number, number];

/** The quantity that clicks measure. */
export type MeasureMode = 'off' | 'distance' | 'angle' | 'ring';

export function distanceOf(a: Point, b: Point): number {
  return Math.hypot(b[0] - a[0], b[1] - a[1]);
}

/** The angle at `b` between `a` and `c`, in degrees from 0 to 180. */
export function angleOf(a: Point, b: Point, c: Point): number {
  const [ux, uy, vx, vy] = [a[0] - b[0], a[1] - b[1], c[0] - b[0], c[1] - b[1]];
  return Math.abs(Math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)) * 180 / Math.PI;
}

/** Number of points of a measurement. */
const POINTS: Record<MeasureMode, number> = { off: 0, distance: 2, angle: 3, ring: 1 };

/** One measurement in world coordinates: the points clicked, and in the mode `ring` the ring clicked. */
export class Measurement {
  points: Point[] = [];
  /** Identity of the ring that was clicked; null without one. */
  identity: bigint | null = null;

  constructor(public mode: MeasureMode = 'off') {}

  /** Adds a point. After the last point the next one begins a new measurement. */
  add(mode: MeasureMode, point: Point, identity: bigint | null): void {
    if (mode !== this.mode || this.points.length >= POINTS[mode]) this.clear();
    this.mode = mode;
    this.points.push(point);
    this.identity = identity;
  }

  clear(): void {
    this.points = [];
    this.identity = null;
  }

  /** The result; empty if points are missing. `ringText`: area of a ring. */
  text(ringText: (identity: bigint | null) => string): string {
    const [a, b, c] = this.points;
    if (this.mode === 'ring' && a) return ringText(this.identity);
    if (this.mode === 'distance' && b) {
      return `distance ${number(distanceOf(a, b))}, x ${number(b[0] - a[0])}, y ${number(b[1] - a[1])}`;
    }
    if (this.mode === 'angle' && c) return `angle ${number(angleOf(a, b, c), 4)}°`;
    return '';
  }
}
