// Frames with surfaces in a report: their numbers, which client/output/report.cc writes, and their pictures.
import { bareRings, type Frame, type Statistics } from '../protocol/frame';
import type { Summary } from '../stream/history';
import { STAGES } from '../stream/summary';
import { count } from '../ui/format';
import type { SpacePart } from './space_part';

/** Numbers of a frame. Null: not finite. */
export interface SurfaceNumbers {
  /** Index of the frame in the input. */
  frame: number;
  particles: number;
  triangles: number;
  bodies: number;
  cavities: number;
  genus: number;
  dropped_holes: number;
  dropped_components: number;
  dropped_spray: number;
  doubts: string[];
  time: number | null;
  area: number | null;
  volume: number | null;
  spacing: number | null;
  milliseconds: number | null;
  stages: Record<string, number>;
  /** False: the report has reached its limit of size. */
  has_picture: boolean;
  triangles_shown: number;
  particles_shown: number;
  particles_given: number;
  surface_digest: string;
}

/** A number of the report, which writes null for one that is not finite. */
export const orNaN = (value: number | null) => value ?? NaN;

export function surfaceSummary(numbers: SurfaceNumbers): Summary {
  return {
    area: orNaN(numbers.area), volume: orNaN(numbers.volume), rings: numbers.bodies, holes: numbers.cavities,
    triangles: numbers.triangles, trianglesGrid: NaN, milliseconds: orNaN(numbers.milliseconds),
    stages: STAGES.map((name) => numbers.stages[name] ?? 0), received: NaN, drawn: NaN, dropped: NaN, latency: 0,
  };
}

/** Parts of the frame that the report leaves out; empty if it has all. */
export function surfaceOmissions(numbers: SurfaceNumbers): string {
  const { triangles, triangles_shown: shown, particles_shown: dots, particles_given: given } = numbers;
  if (!numbers.has_picture) return 'The report has reached its limit of size, so this frame has no picture.';
  const surface = shown === triangles ? ''
    : shown === 0 ? 'The surface is too large for the report.'
      : `The surface is simplified to ${count(shown)} of ${count(triangles)} triangles.`;
  return [surface, dots < given ? `The report has ${count(dots)} of ${count(given)} particles.` : ''].filter(Boolean).join(' ');
}

/** `part`: null if the browser cannot run it. */
export function surfaceFrame(base64: string, numbers: SurfaceNumbers, sequence: number, doubts: number[],
  part: SpacePart | null): Frame {
  const statistics: Statistics = {
    particles: numbers.particles, triangles: numbers.triangles, trianglesGrid: NaN, area: orNaN(numbers.area),
    volume: orNaN(numbers.volume), perimeter: NaN, spacing: orNaN(numbers.spacing), milliseconds: orNaN(numbers.milliseconds),
    droppedHoles: numbers.dropped_holes, droppedComponents: numbers.dropped_components,
    droppedSpray: numbers.dropped_spray, selfIntersections: 0, foldedTriangles: 0, doubts,
  };
  const all = {
    sequence: BigInt(sequence), time: orNaN(numbers.time), statistics,
    surfaceDigest: BigInt(`0x${numbers.surface_digest}`),
    shells: { bodies: numbers.bodies, cavities: numbers.cavities, genus: numbers.genus },
  };
  if (part) {
    const frame = part.frameOf(numbers.has_picture ? base64 : '');
    return { ...frame, ...all, sections: frame.sections.map((section) => ({ ...section, sequence: all.sequence, time: all.time })) };
  }
  return {
    ...all, origin: [0, 0], rings: bareRings(new Float32Array(0), new Uint32Array(1)), sections: [], isolines: [], mesh: null,
    particles: null, particleAttributes: null, ringsDigest: 0n, meshDigest: null,
    problem: 'This browser cannot draw surfaces, because it lacks DecompressionStream.',
  };
}
