import { NO_RING, type Rings } from '../protocol/frame';
import { identityColour, oklch, packed, type Rgb, theme } from './colours';
import { attributeOf, type Look } from './look';

/** Hues of successive sections differ by a golden angle. The first section has the hue ISOLINE_HUE. */
const GOLDEN_TURN = (3 - Math.sqrt(5)) / 2;
const ISOLINE_HUE = 0.13;

/** Colours of triangles that show neither an identity nor an attribute. */
export function fillTones(look: Look): { band: Rgb; interior: Rgb } {
  const { band, interior, neutralBand, neutralInterior } = theme(look.dark);
  return attributeOf(look) === null
    ? { band, interior } : { band: neutralBand, interior: neutralInterior };
}

/** The colour of an outline drawn as lines: 0 is the stream's own, k is section k - 1. */
export function isolineColour(index: number, dark: boolean): Rgb {
  if (index === 0) return theme(dark).outline;
  if (index === 1) return theme(dark).isoline;
  return oklch(dark ? 0.78 : 0.55, 0.15, (index - 1) * GOLDEN_TURN + ISOLINE_HUE);
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
