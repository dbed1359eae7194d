import type { Particles } from '../protocol/particles';

/** Dropped files as frames of particles, read on demand. */
export interface FrameSource {
  /** Name for the user. */
  readonly title: string;
  readonly count: number;
  /** World units; null: to be estimated. */
  readonly spacing: number | null;
  /** Names of scalars that every frame has. */
  readonly scalars: string[];
  /** Reads frame `index`, starting at 0. Throws InputError. */
  frame(index: number): Promise<Particles>;
}

/** Error of a file, with a remedy. */
export class InputError extends Error {}
