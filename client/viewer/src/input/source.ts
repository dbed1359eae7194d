import type { Particles } from '../protocol/particles';

/** Frames of particles that were dropped on the page, read as they are needed. */
export interface FrameSource {
  /** For a person: what it is. */
  readonly title: string;
  readonly count: number;
  /** World units; null where it has to be estimated. */
  readonly spacing: number | null;
  /** Names of scalars that every frame has. */
  readonly scalars: string[];
  /** Frame `index`, from 0 on. Throws InputError. */
  frame(index: number): Promise<Particles>;
}

/** What is wrong with a file, and what to do. */
export class InputError extends Error {}
