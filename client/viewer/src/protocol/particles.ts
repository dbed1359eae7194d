import type { PeriodicBox, PositionFormat } from '@proto/v1/reconstruction_pb';
import { AttributeChannels, type Channels } from './channels';
import { particleBytes } from './positions';

/** One frame of particles to send, with the bytes of a ParticleFrame. */
export interface Particles {
  time: number;
  positionFormat: PositionFormat;
  positions: Uint8Array;
  ids?: Uint8Array;
  volumes?: Uint8Array;
  velocities?: Uint8Array;
  scalars?: { name: string; values: Uint8Array; components?: number }[];
  /** The periodic box of this frame. Absent: the box of the stream. */
  box?: PeriodicBox;
}

/** Numbers of the particles to colour by: their scalars and their velocity. */
export function particleChannels({ positionFormat, positions, velocities, scalars }: Particles): Channels {
  const attributes = [...scalars ?? []];
  if (!velocities || velocities.length === 0) return new AttributeChannels(attributes);
  const count = positions.length / particleBytes(positionFormat);
  const components = Math.round(velocities.length / (4 * count));
  return new AttributeChannels([...attributes, { name: 'velocity', values: velocities, components }]);
}
