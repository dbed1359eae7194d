import type { PositionFormat } from '@proto/v1/reconstruction_pb';

/** One frame of particles as it is sent: bytes as in ParticleFrame. */
export interface Particles {
  time: number;
  positionFormat: PositionFormat;
  positions: Uint8Array;
  ids?: Uint8Array;
  volumes?: Uint8Array;
  velocities?: Uint8Array;
  scalars?: { name: string; values: Uint8Array }[];
}
