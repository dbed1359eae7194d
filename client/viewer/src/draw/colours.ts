/** sRGB: red, green, blue from 0 to 1. */
export type Rgb = readonly [number, number, number];

/** Colours of a picture in one theme. */
export interface Theme {
  background: Rgb;
  /** Triangles between the outline and the merged interior. */
  band: Rgb;
  /** Triangles of merged whole cells. */
  interior: Rgb;
  /** `band` and `interior` while the outline shows an attribute that the mesh lacks. */
  neutralBand: Rgb;
  neutralInterior: Rgb;
  edge: Rgb;
  outline: Rgb;
  hole: Rgb;
  particle: Rgb;
  normal: Rgb;
  isoline: Rgb;
  /** Selected rings. */
  accent: Rgb;
  /** Rings without an identity, points without a number. */
  missing: Rgb;
}

const LIGHT: Theme = {
  background: rgb('#fbfcfd'),
  band: rgb('#bfd8ee'),
  interior: rgb('#dfecf7'),
  neutralBand: rgb('#dfe5ea'),
  neutralInterior: rgb('#eef1f4'),
  edge: rgb('#5f93c0'),
  outline: rgb('#0b4f86'),
  hole: rgb('#2b86a8'),
  particle: rgb('#44596b'),
  normal: rgb('#2e8560'),
  isoline: rgb('#a3470f'),
  accent: rgb('#d9480f'),
  missing: rgb('#76838f'),
};

const DARK: Theme = {
  background: rgb('#0e1318'),
  band: rgb('#234a6d'),
  interior: rgb('#172f45'),
  neutralBand: rgb('#2a333c'),
  neutralInterior: rgb('#1b2229'),
  edge: rgb('#5b8fbd'),
  outline: rgb('#9fd0ff'),
  hole: rgb('#58b9cf'),
  particle: rgb('#a9bac8'),
  normal: rgb('#6fcf9f'),
  isoline: rgb('#f2a271'),
  accent: rgb('#ff9248'),
  missing: rgb('#7c8894'),
};

export function theme(dark: boolean): Theme {
  return dark ? DARK : LIGHT;
}

/** Parses `#rrggbb`. */
export function rgb(hex: string): Rgb {
  const value = Number.parseInt(hex.slice(1), 16);
  return [(value >> 16) / 255, ((value >> 8) & 255) / 255, (value & 255) / 255];
}

/** Returns `#rrggbb`. */
export function hex(colour: Rgb): string {
  return '#' + colour.map((part) => byte(part).toString(16).padStart(2, '0')).join('');
}

/** The colour as a 32-bit number for the shaders: red in the lowest byte, opaque. */
export function packed(colour: Rgb): number {
  const [red, green, blue] = colour;
  return (byte(red) | (byte(green) << 8) | (byte(blue) << 16) | (255 << 24)) >>> 0;
}

/** The inverse of `packed`. */
export function unpacked(colour: number): Rgb {
  return [(colour & 255) / 255, ((colour >> 8) & 255) / 255, ((colour >> 16) & 255) / 255];
}

export function mix(from: Rgb, to: Rgb, share: number): Rgb {
  return [
    from[0] + (to[0] - from[0]) * share,
    from[1] + (to[1] - from[1]) * share,
    from[2] + (to[2] - from[2]) * share,
  ];
}

/**
 * A colour by lightness (0 to 1), chroma (0 to about .3) and hue (in turns) of OKLCH. Equal steps
 * in OKLCH look equal. Chroma is reduced until the colour lies in sRGB.
 */
export function oklch(lightness: number, chroma: number, hue: number): Rgb {
  for (let share = 1; share > 0; share -= 0.05) {
    const angle = 2 * Math.PI * hue;
    const colour = fromOklab(
      lightness, share * chroma * Math.cos(angle), share * chroma * Math.sin(angle));
    if (colour.every((part) => part >= -1e-4 && part <= 1.0001)) return colour;
  }
  return fromOklab(lightness, 0, 0);
}

const HUES = 256;
const TIERS = 2;
const GOLDEN_RATIO = 0x9e3779b1; // 0.618 * 2^32.

/** All hues of each tier of lightness, by theme. Made at first use. */
const identityColours: { light?: Rgb[]; dark?: Rgb[] } = {};

/**
 * The colour of an identity, given by its lower and upper 32 bits. Hues of successive identities
 * are a golden angle apart, so that neighbours in time differ. 0 (not tracked) is grey.
 */
export function identityColour(low: number, high: number, dark: boolean): Rgb {
  if (low === 0 && high === 0) return theme(dark).missing;
  const hash = Math.imul(low ^ Math.imul(high, 0x85ebca6b), GOLDEN_RATIO) >>> 0;
  const tier = (low ^ (low >>> 1)) & 1;
  return identityPalette(dark)[tier * HUES + (hash >>> 24)];
}

function identityPalette(dark: boolean): Rgb[] {
  const name = dark ? 'dark' : 'light';
  return (identityColours[name] ??= Array.from({ length: TIERS * HUES }, (_, k) => {
    const tier = Math.floor(k / HUES);
    const lightness = dark ? 0.76 + 0.08 * tier : 0.56 - 0.09 * tier;
    return oklch(lightness, dark ? 0.13 : 0.15, (k % HUES) / HUES);
  }));
}

function byte(part: number): number {
  return Math.round(Math.min(Math.max(part, 0), 1) * 255);
}

/** Björn Ottosson, "A perceptual color space for image processing", 2020. */
function fromOklab(lightness: number, a: number, b: number): Rgb {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    companded(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    companded(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    companded(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

/** Converts linear light to an sRGB component. */
function companded(light: number): number {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}
