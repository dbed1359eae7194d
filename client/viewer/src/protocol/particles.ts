import type { PositionFormat } from '@proto/v1/reconstruction_pb';

/** One frame of particles to send, with the bytes of a ParticleFrame. */
export interface Particles {
  time: number;
  positionFormat: PositionFormat;
  positions: Uint8Array;
  ids?: Uint8Array;
  volumes?: Uint8Array;
  velocities?: Uint8Array;
  scalars?: { name: string; values: Uint8Array }[];
}
