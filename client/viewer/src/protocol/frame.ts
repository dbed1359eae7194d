/** Where a mesh's triangle lies. */
export const TRIANGLE_CLASS = { band: 0, interior: 1 } as const;

export interface Rings {
  /** x, y of every point, relative to the frame's origin. */
  points: Float32Array;
  /** Ring k has the points [offsets[k], offsets[k + 1]). */
  offsets: Uint32Array;
  /** Of each ring its outer ring; NO_RING for an outer ring itself. */
  outerOf: Uint32Array;
  identities: BigUint64Array;
  area: Float64Array;
  perimeter: Float64Array;
  particles: Float64Array;
  /** Identities, in the frame before, of the rings that each ring continues. */
  parents: bigint[][];
  normals: Float32Array | null;
  /** Per point, by the scalar's name. */
  attributes: Map<string, Float32Array>;
}

export interface Mesh {
  readonly points: Float32Array;
  readonly triangles: Uint32Array;
  /** Of each triangle: 0 boundary band, 1 merged interior. */
  readonly classes: Uint8Array;
  /** The same numbers as bytes, aligned or not: what drawing takes, without a copy. */
  readonly bytes: { readonly points: Uint8Array; readonly triangles: Uint8Array };
}

export interface Statistics {
  particles: number;
  triangles: number;
  /** What fill `grid` would have made of the same rings. */
  trianglesGrid: number;
  area: number;
  perimeter: number;
  spacing: number;
  cellSize: number;
  milliseconds: number;
  stages: { stage: string; milliseconds: number }[];
  /** In words, what speaks against the result. */
  doubts: string[];
}

/** One result as it is drawn. Arrays are views into the message where alignment allows. */
export interface Frame {
  sequence: bigint;
  time: number;
  /** Of the message. */
  bytes: number;
  /** performance.now() when it came. */
  receivedAt: number;
  /** World coordinates of what all points are relative to. */
  origin: [number, number];
  rings: Rings;
  mesh: Mesh | null;
  /** x, y of every particle, relative to the origin. */
  particles: Float32Array | null;
  statistics: Statistics;
  ringsDigest: bigint;
  meshDigest: bigint;
}

/** In Rings.outerOf: the ring is an outer ring. */
export const NO_RING = 0xffffffff;
