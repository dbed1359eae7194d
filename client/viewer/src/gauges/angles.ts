// Contact angles and angles of repose, by the same fits as in the core.
import { lineCrossings, type MeasuredRings, type Point } from './rings';

/** Width of the zone along a wall in which an outline is rounded, in spacings. Fits leave this zone out. */
const ROUNDED_SPACINGS = 1;
/** Number of samples of the upper surface. A flank lies between these fractions of the peak's height. */
const SURFACE_SAMPLES = 200;
const [FLANK_FROM, FLANK_TO] = [0.2, 0.8];
const MOST_STEPS = 50;

const degrees = (radians: number) => radians * 180 / Math.PI;
const meanOf = (values: readonly number[]) => values.reduce((sum, value) => sum + value, 0) / values.length;

/** Taubin's circle through at least four points; null if there is none. */
function fitCircle(points: readonly Point[]): { centre: Point; radius: number } | null {
  if (points.length < 4) return null;
  const mean: Point = [meanOf(points.map(([x]) => x)), meanOf(points.map(([, y]) => y))];
  let [xx, xy, yy, xz, yz, zz] = [0, 0, 0, 0, 0, 0];
  for (const point of points) {
    const [x, y] = [point[0] - mean[0], point[1] - mean[1]];
    const z = x * x + y * y;
    xx += x * x;
    xy += x * y;
    yy += y * y;
    xz += x * z;
    yz += y * z;
    zz += z * z;
  }
  [xx, xy, yy, xz, yz, zz] = [xx, xy, yy, xz, yz, zz].map((moment) => moment / points.length);
  // Newton's iteration from 0 finds the smallest root of the characteristic polynomial.
  const z = xx + yy;
  const covariance = xx * yy - xy * xy;
  const variance = zz - z * z;
  const a3 = 4 * z;
  const a2 = -3 * z * z - zz;
  const a1 = variance * z + 4 * covariance * z - xz * xz - yz * yz;
  const a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - variance * covariance;
  let [root, value] = [0, a0];
  for (let step = 0; step < MOST_STEPS; ++step) {
    const next = root - value / (a1 + root * (2 * a2 + 3 * a3 * root));
    if (next === root || !Number.isFinite(next)) break;
    const nextValue = a0 + next * (a1 + next * (a2 + next * a3));
    if (Math.abs(nextValue) >= Math.abs(value)) break;
    [root, value] = [next, nextValue];
  }
  const determinant = root * root - root * z + covariance;
  const x = (xz * (yy - root) - yz * xy) / determinant / 2;
  const y = (yz * (xx - root) - xz * xy) / determinant / 2;
  const radius = Math.sqrt(x * x + y * y + z);
  return Number.isFinite(radius) ? { centre: [mean[0] + x, mean[1] + y], radius } : null;
}

/** Slope of the straight line through points; NaN if there is none. */
function fitSlope(points: readonly Point[]): number {
  if (points.length < 2) return NaN;
  const [x0, y0] = [meanOf(points.map(([x]) => x)), meanOf(points.map(([, y]) => y))];
  let [xx, xy] = [0, 0];
  for (const [x, y] of points) {
    xx += (x - x0) * (x - x0);
    xy += (x - x0) * (y - y0);
  }
  return xx === 0 ? NaN : xy / xx;
}

interface Contact { place: number; angle: number }

/**
 * One contact point and its angle in degrees, by a circle. `points`: coordinates along the wall and heights above it.
 * `rounded`: height below which points are left out. `reach`: only points within this distance of the outermost of the
 * lowest points left are fitted. `first`: 1 for the start of the contact, -1 for its end. NaN without a contact.
 */
function findContact(points: readonly Point[], reach: number, rounded: number, first: 1 | -1): Contact {
  const none = { place: NaN, angle: NaN };
  const free = points.filter(([, height]) => height >= rounded);
  if (free.length === 0) return none;
  const lowest = free.reduce((least, [, height]) => Math.min(least, height), Infinity);
  const side = free.filter(([, height]) => height <= lowest + rounded)
    .reduce((outermost, point) => (first * point[0] < first * outermost[0] ? point : outermost), [first * Infinity, 0]);
  const circle = fitCircle(free.filter(([x, y]) => Math.hypot(x - side[0], y - side[1]) <= reach));
  if (!circle || Math.abs(circle.centre[1]) > circle.radius) return none;
  // The wall cuts the circle at +-radius sin(angle). The centre of a meniscus is outside the body: the angle is the
  // supplement.
  const angle = Math.acos(-circle.centre[1] / circle.radius);
  const isMeniscus = first * (circle.centre[0] - side[0]) < 0;
  const toward = isMeniscus ? first : -first;
  return {
    place: circle.centre[0] + toward * circle.radius * Math.sin(angle),
    angle: degrees(isMeniscus ? Math.PI - angle : angle),
  };
}

/**
 * The contact of the largest body with a wall, whose body side is the left of `direction`. Returns the angles at start
 * and end of the contact, in degrees, then their places along the wall from `origin`. NaN without a contact.
 */
export function contactAngles({ largest, spacing }: MeasuredRings, origin: Point, direction: Point, reach: number): number[] {
  if (!largest) return [NaN, NaN, NaN, NaN];
  const length = Math.hypot(...direction);
  const [ax, ay] = [direction[0] / length, direction[1] / length];
  const points = largest.map(([x, y]): Point =>
    [ax * (x - origin[0]) + ay * (y - origin[1]), ax * (y - origin[1]) - ay * (x - origin[0])]);
  const rounded = ROUNDED_SPACINGS * spacing;
  const [start, end] = [findContact(points, reach, rounded, 1), findContact(points, reach, rounded, -1)];
  return [start.angle, end.angle, start.place, end.place];
}

/**
 * Angles of repose of the largest body: of its left and its right flank against the horizontal, in
 * degrees. A flank is the upper surface on one side of the peak, between FLANK_FROM and FLANK_TO of
 * the peak's height. NaN for a flank of fewer than two samples, and without a body.
 */
export function anglesOfRepose({ largest }: MeasuredRings): number[] {
  if (!largest) return [NaN, NaN];
  let [left, right, base] = [Infinity, -Infinity, Infinity];
  for (const [x, y] of largest) [left, right, base] = [Math.min(left, x), Math.max(right, x), Math.min(base, y)];
  const surface: Point[] = [];
  for (let k = 0; k < SURFACE_SAMPLES; ++k) {
    const x = left + (right - left) * (k + 0.5) / SURFACE_SAMPLES;
    const top = lineCrossings([largest], [x, 0], [0, 1]).pop();
    if (top !== undefined) surface.push([x, top - base]);
  }
  if (surface.length === 0) return [NaN, NaN];
  const peak = surface.reduce((highest, point) => (point[1] > highest[1] ? point : highest));
  const flanks = surface.filter(([, height]) => height >= FLANK_FROM * peak[1] && height <= FLANK_TO * peak[1]);
  const angle = (points: readonly Point[]) => degrees(Math.atan(fitSlope(points)));
  return [angle(flanks.filter(([x]) => x < peak[0])), -angle(flanks.filter(([x]) => !(x < peak[0])))];
}
