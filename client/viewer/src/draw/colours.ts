/** Red, green, blue of sRGB, each from 0 to 1. */
export type Rgb = readonly [number, number, number];

/** The colours of a picture where everything of a kind has the same. */
export interface Theme {
  background: Rgb;
  /** Triangles between the outline and the merged interior. */
  band: Rgb;
  /** Triangles that were merged from whole cells. */
  interior: Rgb;
  /** The same two where only the outline is to have colours. */
  neutralBand: Rgb;
  neutralInterior: Rgb;
  edge: Rgb;
  outline: Rgb;
  hole: Rgb;
  particle: Rgb;
  normal: Rgb;
  /** Of what is selected. */
  accent: Rgb;
  /** Where there is no identity or no number to colour by. */
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
  accent: rgb('#ff9248'),
  missing: rgb('#7c8894'),
};

export function theme(dark: boolean): Theme {
  return dark ? DARK : LIGHT;
}

/** Of `#rrggbb`. */
export function rgb(hex: string): Rgb {
  const value = Number.parseInt(hex.slice(1), 16);
  return [(value >> 16) / 255, ((value >> 8) & 255) / 255, (value & 255) / 255];
}

/** As `#rrggbb`. */
export function hex(colour: Rgb): string {
  return '#' + colour.map((part) => byte(part).toString(16).padStart(2, '0')).join('');
}

/** As the graphics card reads it from a 32-bit number: red in the lowest byte, opaque. */
export function packed(colour: Rgb): number {
  const [red, green, blue] = colour;
  return (byte(red) | (byte(green) << 8) | (byte(blue) << 16) | (255 << 24)) >>> 0;
}

/** Of what `packed` made. */
export function unpacked(colour: number): Rgb {
  return [(colour & 255) / 255, ((colour >> 8) & 255) / 255, ((colour >> 16) & 255) / 255];
}

/** The way from one colour to another, `share` of it gone. */
export function mix(from: Rgb, to: Rgb, share: number): Rgb {
  return [
    from[0] + (to[0] - from[0]) * share,
    from[1] + (to[1] - from[1]) * share,
    from[2] + (to[2] - from[2]) * share,
  ];
}

/**
 * A colour by lightness (0 to 1), chroma (0 to about .3) and hue (in turns) of OKLCH, in which
 * equal steps look equal. Chroma shrinks until the screen can show the colour.
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
const GOLDEN_RATIO = 0x9e3779b1; // Times 2^-32.

/** By theme: for each tier of lightness all hues. Made when first needed. */
const identityColours: { light?: Rgb[]; dark?: Rgb[] } = {};

/**
 * The colour of an identity, given by its lower and upper 32 bits. Hues of successive identities
 * are a golden angle apart, so that neighbours in time differ; 0, not tracked, is grey.
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

/** Linear light as sRGB numbers it. */
function companded(light: number): number {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}
