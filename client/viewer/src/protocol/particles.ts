import {
  Boundary, type PeriodicBox, type PositionFormat, type ReconstructionParameters, Sizes,
} from '@proto/v1/reconstruction_pb';
import { arrayOf } from './arrays';
import { AttributeChannels, type Channels } from './channels';
import type { ParticleSizes } from './frame';
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

/** The parameters that decide how particles are drawn. */
export type SizeParameters = Pick<ReconstructionParameters, 'sizes' | 'boundary'>;

/** The own sizes of particles in a plane; null if `parameters` do not use them, or the particles have no volumes. */
export function particleSizes(
  { positionFormat, positions, volumes }: Particles, parameters: SizeParameters | null,
): ParticleSizes | null {
  if (parameters?.sizes !== Sizes.OWN || volumes?.length !== 4 * positions.length / particleBytes(positionFormat)) return null;
  return {
    diameters: arrayOf(Float32Array, volumes).map(Math.sqrt),
    areDiscs: parameters.boundary === Boundary.GRAINS,
  };
}
