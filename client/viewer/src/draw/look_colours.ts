import { NO_RING, type Rings } from '../protocol/frame';
import { identityColour, packed, type Rgb, theme } from './colours';
import { attributeOf, type Look } from './look';

/** Colours of triangles without a colour of their own. */
export function fillTones(look: Look): { band: Rgb; interior: Rgb } {
  const { band, interior, neutralBand, neutralInterior } = theme(look.dark);
  return attributeOf(look) === null
    ? { band, interior } : { band: neutralBand, interior: neutralInterior };
}

/** Returns a function from ring to colour, packed for the shaders. */
export function ringColours(rings: Rings, look: Look): (ring: number) => number {
  if (look.colour === 'identity') {
    const halves = identityHalves(rings);
    return (ring) => packed(identityColour(halves[2 * ring], halves[2 * ring + 1], look.dark));
  }
  const colours = theme(look.dark);
  const outline = packed(colours.outline);
  const hole = packed(colours.hole);
  return (ring) => (rings.outerOf[ring] === NO_RING ? outline : hole);
}

/** Lower and upper 32 bits of each identity. Numbers are many times faster than bigints. */
function identityHalves(rings: Rings): Uint32Array {
  const { buffer, byteOffset, length } = rings.identities;
  return new Uint32Array(buffer, byteOffset, 2 * length);
}
