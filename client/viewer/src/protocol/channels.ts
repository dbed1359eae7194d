import { arrayOf } from './arrays';

/**
 * Numbers to colour points by: for each named channel, one number per point. A scalar `p` has the
 * channel `p`. A vector `v` has the channel `v`, its magnitude, and one for each of its two or three
 * components: `v x`, `v y`, `v z`.
 */
export interface Channels {
  get(channel: string): Float32Array | undefined;
  keys(): Iterable<string>;
}

/** An attribute of a message: float32, `components` per point, interleaved. */
export interface NamedValues { name: string; values: Uint8Array; components?: number }

const AXES = ['x', 'y', 'z'];

/** Channels of an attribute. */
export function channelsOf(name: string, components: number): string[] {
  if (components <= 1) return [name];
  return [name, ...AXES.slice(0, components).map((axis) => `${name} ${axis}`)];
}

/** Name of a channel for the user: adds `, magnitude` to that of a vector. `all`: the channels of the frame. */
export function channelLabel(channel: string, all: Iterable<string>): string {
  return [...all].includes(`${channel} x`) ? `${channel}, magnitude` : channel;
}

/** Channels of attributes, decoded when they are first read. */
export class AttributeChannels implements Channels {
  private readonly decoded = new Map<string, Float32Array>();

  constructor(private readonly attributes: readonly NamedValues[]) {}

  keys(): string[] {
    return this.attributes.flatMap(({ name, components = 1 }) => channelsOf(name, components));
  }

  get(channel: string): Float32Array | undefined {
    const known = this.decoded.get(channel);
    if (known) return known;
    for (const attribute of this.attributes) {
      const index = channelsOf(attribute.name, attribute.components ?? 1).indexOf(channel);
      if (index < 0) continue;
      const values = decode(attribute, index);
      this.decoded.set(channel, values);
      return values;
    }
    return undefined;
  }
}

/** `channel`: 0 for a scalar or the magnitude of a vector, k for component k - 1. */
function decode({ values, components = 1 }: NamedValues, channel: number): Float32Array {
  const numbers = arrayOf(Float32Array, values);
  if (components <= 1) return numbers;
  const out = new Float32Array(Math.floor(numbers.length / components));
  for (let k = 0; k < out.length; ++k) {
    const first = k * components;
    out[k] = channel > 0 ? numbers[first + channel - 1]
      : Math.hypot(numbers[first], numbers[first + 1], components > 2 ? numbers[first + 2] : 0);
  }
  return out;
}
