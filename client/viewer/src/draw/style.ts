/** Sizes of screen and exported pictures, in CSS pixels unless stated otherwise. */

/** Width of an edge between two triangles, in CSS pixels. */
export const EDGE_WIDTH = 1;
export const EDGE_ALPHA = 0.8;

/** Share of the identity's colour in triangles and edges; the rest is background. */
export const BAND_TINT = 0.52;
export const INTERIOR_TINT = 0.34;
export const EDGE_TINT = 0.8;

export const NORMAL_WIDTH = 1.5;
/** Length of a drawn normal in particle spacings, and its limits in CSS pixels. */
const NORMAL_SPACINGS = 1.2;
const SHORTEST_NORMAL = 6;
const LONGEST_NORMAL = 40;
/** Smallest distance between drawn normals, in CSS pixels. */
const NORMAL_GAP = 4;

export const ISOLINE_WIDTH = 1.2;

export const PARTICLE_ALPHA = 0.85;
/** Diameter of a particle's dot in particle spacings, and its limits in CSS pixels. */
const DOT_SPACINGS = 0.4;
const SMALLEST_DOT = 1.25;
const LARGEST_DOT = 12;

/** Diameter of a particle's dot, from the spacing of the particles; both in pixels. */
export function dotDiameter(spacing: number): number {
  return Math.min(Math.max(DOT_SPACINGS * spacing, SMALLEST_DOT), LARGEST_DOT);
}

/** Share of the diameter of a particle with an own size that its dot has, and its opacity; `areDiscs`: grains. */
export function ownDot(areDiscs: boolean): { share: number; alpha: number } {
  return areDiscs ? { share: 1, alpha: 0.4 } : { share: DOT_SPACINGS, alpha: PARTICLE_ALPHA };
}

/** Diameter of the dot of a particle with an own size, from `diameter` times `share`, in pixels. */
export function ownDotDiameter(diameter: number): number {
  return Math.max(diameter, SMALLEST_DOT);
}

/** Length of a drawn normal, from the spacing of the particles; both in pixels. */
export function normalLength(spacing: number): number {
  return Math.min(Math.max(NORMAL_SPACINGS * spacing, SHORTEST_NORMAL), LONGEST_NORMAL);
}

/**
 * Number of vertices from one drawn normal to the next, for `count` vertices at a distance of `gap`
 * pixels. A power of two, so that few normals appear or vanish during a zoom.
 */
export function normalStride(gap: number, count: number): number {
  let stride = 1;
  while (gap * stride < NORMAL_GAP && stride < count) stride *= 2;
  return stride;
}
