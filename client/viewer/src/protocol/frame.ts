import { AttributeChannels, type Channels } from './channels';
import { NO_OUTER } from './checks';
import type { SurfaceMessage } from './surface';

/** Class of a mesh triangle: in the band of cells along the outline, or in the interior. */
export const TRIANGLE_CLASS = { band: 0, interior: 1 } as const;

export interface Rings {
  /** x, y of every vertex, relative to the frame's origin. */
  points: Float32Array;
  /** Ring k has the vertices [offsets[k], offsets[k + 1]). */
  offsets: Uint32Array;
  /** Outer ring of each hole; NO_RING for an outer ring. */
  outerOf: Uint32Array;
  identities: BigUint64Array;
  area: Float64Array;
  perimeter: Float64Array;
  particles: Float64Array;
  /** Identities, in the previous frame, of the rings that each ring continues. */
  parents: bigint[][];
  /** Vertices, ascending, whose segment to the next one lies on a face of the periodic box. */
  cuts: Uint32Array;
  /** Vertices, ascending, whose segment to the next one lies on a wall. */
  wetted: Uint32Array;
  /** Vertices, ascending, where an outline meets a wall, or a phase meets two others, or one and the outside. */
  contacts: Uint32Array;
  /** Of each contact: the angle of the fluid or phase there, in radians. */
  contactAngles: Float32Array;
  normals: Float32Array | null;
  /** Numbers per vertex. */
  attributes: Channels;
}

export interface Mesh {
  /** The first points are the vertices of the rings. */
  readonly points: Float32Array;
  readonly triangles: Uint32Array;
  /** TRIANGLE_CLASS of each triangle. */
  readonly classes: Uint8Array;
  /** `points` and `triangles` as bytes of any alignment, for an upload without a copy. */
  readonly bytes: { readonly points: Uint8Array; readonly triangles: Uint8Array };
  /** One number per point; undefined if the mesh lacks the channel. */
  attribute(name: string): Float32Array | undefined;
}

export interface Statistics {
  particles: number;
  triangles: number;
  /** Number of triangles that the fill method `grid` would make of the same rings. */
  trianglesGrid: number;
  area: number;
  perimeter: number;
  spacing: number;
  milliseconds: number;
  droppedHoles: number;
  droppedComponents: number;
  droppedSpray: number;
  selfIntersections: number;
  foldedTriangles: number;
  /** Of surfaces only. */
  volume?: number;
  /** Numbers for `Track.doubtText`. */
  doubts: number[];
}

/** The particles' own sizes. */
export interface ParticleSizes {
  /** By particle, in world units. */
  diameters: Float32Array;
  /** Particles are discs of these diameters (grains). Otherwise a diameter is the spacing that fits the particle. */
  areDiscs: boolean;
}

/** One result, ready to draw. Arrays are views into the message if its alignment allows. */
export interface Frame {
  sequence: bigint;
  time: number;
  /** World coordinates of the point that all positions are relative to. */
  origin: [number, number];
  rings: Rings;
  /** Sections of the frame, in the order of the stream's parameters. */
  sections: readonly Frame[];
  /** Other outlines in parallel planes, to draw as lines (`pictureOf`). */
  isolines: readonly Isoline[];
  mesh: Mesh | null;
  /** x, y of every particle, relative to the origin. */
  particles: Float32Array | null;
  /** Absent: all particles have the spacing of the frame. */
  particleSizes?: ParticleSizes | null;
  /** Numbers per particle; null if none are known. */
  particleAttributes: Channels | null;
  statistics: Statistics;
  ringsDigest: bigint;
  /** Null: not known. */
  meshDigest: bigint | null;
  /** Surfaces in space, not decoded yet. The outlines of such a frame are its sections. */
  surface?: SurfaceMessage;
  surfaceDigest?: bigint;
  /** Counts of the exact surface, if `surface` is simplified or missing (reports). */
  shells?: { bodies: number; cavities: number; genus: number };
  /** Why the frame cannot be shown, as a sentence. Absent for a frame that can. */
  problem?: string;
}

/** Another outline of the frame, drawn as lines. */
export interface Isoline {
  /** 0: the stream's own outline; k: section k - 1. */
  index: number;
  rings: Rings;
  /** As Frame.origin, in the coordinates of the picture. */
  origin: [number, number];
}

/** In Rings.outerOf: an outer ring. */
export const NO_RING = NO_OUTER;

/** Rings without measures, identities and attributes: lines to draw. */
export function bareRings(points: Float32Array, offsets: Uint32Array): Rings {
  const count = offsets.length - 1;
  return {
    points,
    offsets,
    outerOf: new Uint32Array(count).fill(NO_RING),
    identities: new BigUint64Array(count),
    area: new Float64Array(count),
    perimeter: new Float64Array(count),
    particles: new Float64Array(count),
    parents: Array.from({ length: count }, () => []),
    cuts: new Uint32Array(0),
    wetted: new Uint32Array(0),
    contacts: new Uint32Array(0),
    contactAngles: new Float32Array(0),
    normals: null,
    attributes: new AttributeChannels([]),
  };
}
