/** Measures that the screen and exported pictures share, in CSS pixels unless they say. */

/** Of an edge between two triangles. */
export const EDGE_WIDTH = 1;
export const EDGE_ALPHA = 0.8;

/** How much of an identity's colour triangles and edges get; the rest is the background. */
export const BAND_TINT = 0.52;
export const INTERIOR_TINT = 0.34;
export const EDGE_TINT = 0.8;

export const NORMAL_WIDTH = 1.5;
/** Length of a normal in spacings, and its bounds. */
const NORMAL_SPACINGS = 1.2;
const SHORTEST_NORMAL = 6;
const LONGEST_NORMAL = 40;
/** Between the normals that are drawn. */
const NORMAL_GAP = 4;

export const PARTICLE_ALPHA = 0.85;
/** Diameter of a particle's dot in spacings, and its bounds. */
const DOT_SPACINGS = 0.4;
const SMALLEST_DOT = 1.25;
const LARGEST_DOT = 12;

/** Diameter of a particle's dot where particles are so far apart. */
export function dotDiameter(spacing: number): number {
  return Math.min(Math.max(DOT_SPACINGS * spacing, SMALLEST_DOT), LARGEST_DOT);
}

/** Length of a normal where particles are so far apart. */
export function normalLength(spacing: number): number {
  return Math.min(Math.max(NORMAL_SPACINGS * spacing, SHORTEST_NORMAL), LONGEST_NORMAL);
}

/**
 * Of `count` vertices so far apart, every n-th shows its normal, n being a power of two, so that
 * few appear or vanish as one zooms.
 */
export function normalStride(gap: number, count: number): number {
  let stride = 1;
  while (gap * stride < NORMAL_GAP && stride < count) stride *= 2;
  return stride;
}
