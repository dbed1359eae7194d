import { Output, type ReconstructionParameters, type SlicePlane } from '@proto/v1/reconstruction_pb';
import type { Frame, Isoline } from './frame';

type Vector = readonly [number, number, number];

/** A plane that cuts 3D particles. */
export interface SectionPlane { origin: Vector; normal: Vector }

/** An outline of a frame: 0 is the stream's own, the others are its sections, in order. */
export interface Outline {
  /** Null: the particles are 2D. */
  plane: SectionPlane | null;
  /** The outline is this isoline of the density; null: the outline of the body. */
  isovalue: number | null;
  /** The phase whose particles the outline encloses; absent: all particles. */
  phase?: number;
  /** True for the stream's own result if it is a surface. */
  isSurface?: boolean;
}

const AXES = ['x', 'y', 'z'];

/** Name of an outline for the user: `z = 0.5, isovalue 0.3`. */
export function outlineName({ plane, isovalue, isSurface, phase }: Outline): string {
  if (isSurface) return 'Surface';
  if (phase !== undefined) return `Phase ${phase}`;
  const parts = [plane ? planeName(plane) : '', isovalue === null ? '' : `isovalue ${isovalue}`];
  return parts.filter(Boolean).join(', ') || 'Outline';
}

function planeName({ origin, normal }: SectionPlane): string {
  const along = normal.flatMap((part, axis) => part === 0 ? [] : [axis]);
  if (along.length === 1) return `${AXES[along[0]]} = ${origin[along[0]]}`;
  return `through (${origin.join(', ')}), normal (${normal.join(', ')})`;
}

/** The outlines of a stream's frames. */
export function outlinesOf(parameters: ReconstructionParameters | null): Outline[] {
  const own: Outline = { plane: planeOf(parameters?.slice) ?? null, isovalue: parameters?.isovalue ?? null };
  if (parameters?.output === Output.SURFACE) own.isSurface = true;
  return [own, ...(parameters?.sections ?? []).map(({ slice, isovalue, phase }) =>
    ({ plane: planeOf(slice) ?? own.plane, isovalue: isovalue ?? null, ...(phase === undefined ? {} : { phase }) }))];
}

function planeOf(slice: SlicePlane | undefined): SectionPlane | undefined {
  return slice && {
    origin: [slice.originX, slice.originY, slice.originZ],
    normal: [slice.normalX, slice.normalY, slice.normalZ],
  };
}

/**
 * The picture of outline `shown` of a frame, or of outline 0 if `shown` is missing. All other outlines
 * in parallel planes become its isolines. A frame without sections is returned unchanged.
 */
export function pictureOf(frame: Frame, outlines: readonly Outline[], shown: number): Frame {
  const { sections } = frame;
  if (sections.length === 0) return frame;
  const all = [frame, ...sections];
  const base = all[shown] ? shown : 0;
  const isolines = all.flatMap(({ rings, origin }, index): Isoline[] => {
    const shift = index === base ? null : shiftBetween(outlines[index]?.plane, outlines[base]?.plane);
    return shift ? [{ index, rings, origin: [origin[0] + shift[0], origin[1] + shift[1]] }] : [];
  });
  if (base === 0) return { ...frame, isolines };
  // Particles are shown only in the plane of the stream's own outline, because they lie around it.
  const isOwnPlane = isSamePlane(outlines[0]?.plane, outlines[base]?.plane);
  return {
    ...all[base], sections, isolines,
    particles: isOwnPlane ? moved(frame.particles, frame.origin, all[base].origin) : null,
    particleSizes: isOwnPlane ? frame.particleSizes : null,
    particleAttributes: isOwnPlane ? frame.particleAttributes : null,
  };
}

function isSamePlane(a: SectionPlane | null | undefined, b: SectionPlane | null | undefined): boolean {
  return shiftBetween(a, b) !== null && (!a || !b || a.origin.every((part, k) => part === b.origin[k]));
}

/** Converts points relative to the origin `from` to points relative to the origin `to`. */
function moved(points: Float32Array | null, from: [number, number], to: [number, number]): Float32Array | null {
  const shift = [from[0] - to[0], from[1] - to[1]];
  return points && points.map((value, k) => value + shift[k % 2]);
}

/**
 * Coordinates in plane `to` of the point (0, 0) of plane `from`, projected along the normal. Zeros if
 * both planes are missing. Null if one is missing, or if the planes are not parallel or have opposite
 * normals.
 */
export function shiftBetween(
  from: SectionPlane | null | undefined, to: SectionPlane | null | undefined,
): [number, number] | null {
  if (!from && !to) return [0, 0];
  if (!from || !to) return null;
  const [a, b] = [unit(from.normal), unit(to.normal)];
  if (dot(a, b) < 1 - 1e-12) return null;
  const apart: Vector = [
    from.origin[0] - to.origin[0], from.origin[1] - to.origin[1], from.origin[2] - to.origin[2],
  ];
  const [first, second] = axesOf(b);
  return [dot(apart, first), dot(apart, second)];
}

/** The axes of coordinates in a plane, as SlicePlane of the protocol defines them. */
function axesOf(normal: Vector): [Vector, Vector] {
  const [x, y, z] = normal.map(Math.abs);
  const axis: Vector = x > y && x > z ? [0, 1, 0] : [1, 0, 0];
  const along = dot(axis, normal);
  const first = unit([
    axis[0] - along * normal[0], axis[1] - along * normal[1], axis[2] - along * normal[2],
  ]);
  return [first, [
    normal[1] * first[2] - normal[2] * first[1],
    normal[2] * first[0] - normal[0] * first[2],
    normal[0] * first[1] - normal[1] * first[0],
  ]];
}

/** The point of a plane with the coordinates (u, v). */
export function inSpace({ origin, normal }: SectionPlane, u: number, v: number): [number, number, number] {
  const [first, second] = axesOf(unit(normal));
  return [
    origin[0] + u * first[0] + v * second[0], origin[1] + u * first[1] + v * second[1],
    origin[2] + u * first[2] + v * second[2],
  ];
}

/** The two coordinates in a plane of a point's projection, and the point's signed height above the plane. */
export function inPlane({ origin, normal }: SectionPlane, [x, y, z]: Vector): Vector {
  const up = unit(normal);
  const [first, second] = axesOf(up);
  const apart: Vector = [x - origin[0], y - origin[1], z - origin[2]];
  return [dot(apart, first), dot(apart, second), dot(apart, up)];
}

function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function unit([x, y, z]: Vector): Vector {
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}
