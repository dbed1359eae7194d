import type { PeriodicBox } from '@proto/v1/reconstruction_pb';
import type { Particles } from '../protocol/particles';
import type { SectionPlane } from '../protocol/sections';

/** Dropped files as frames of particles, read on demand. */
export interface FrameSource {
  /** Name for the user. */
  readonly title: string;
  readonly count: number;
  /** World units; null: to be estimated. */
  readonly spacing: number | null;
  /** Whether 3D particles are reconstructed as surfaces. The planes are sections then. */
  readonly isSurface: boolean;
  /** Planes that cut 3D particles. The first is the picture, unless `isSurface`. Empty for 2D particles. */
  readonly slices: readonly SectionPlane[];
  /** The periodic box of the first frame, which is that of the stream. Absent: no axis is periodic. */
  readonly box?: PeriodicBox;
  /** Names of scalars that every frame has. */
  readonly scalars: string[];
  /** A warning about the files for the user, such as their truncation; empty without one. */
  readonly notice: string;
  /** Reads frame `index`, starting at 0. The frame has a box only if that differs from `box`. Throws InputError. */
  frame(index: number): Promise<Particles>;
}

/** Error of a file, with a remedy. */
export class InputError extends Error {}
