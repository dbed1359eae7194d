import { hex, oklch, type Rgb } from './colours';

/** Colours in a legend. */
const STOPS = 9;

/**
 * Colour maps: lightness, chroma and hue in degrees of a number from 0 to 1. The dark theme uses
 * lighter colours, so that all colours contrast with the background.
 */
const MAPS = {
  // Lightness in equal steps.
  'violet-yellow': (t: number, dark: boolean) =>
    [dark ? 0.52 + 0.4 * t : 0.3 + 0.36 * t, 0.16 - 0.02 * t, 300 - 200 * t],
  // Diverging map for numbers on both sides of zero: the middle is grey.
  'blue-red': (t: number, dark: boolean) => {
    const away = Math.abs(2 * t - 1);
    return [dark ? 0.9 - 0.26 * away : 0.64 - 0.22 * away, 0.19 * away, t < 0.5 ? 255 : 27];
  },
  grey: (t: number, dark: boolean) => [dark ? 0.5 + 0.45 * t : 0.22 + 0.42 * t, 0, 0],
} as const;

export type MapName = keyof typeof MAPS;
export const MAP_NAMES = Object.keys(MAPS) as MapName[];

export interface Ramp { dark: boolean; map: MapName }

/** The colour of a number from 0 to 1. */
export function rampColour(share: number, { dark, map }: Ramp): Rgb {
  const [lightness, chroma, hue] = MAPS[map](Math.min(Math.max(share, 0), 1), dark);
  return oklch(lightness, chroma, hue / 360);
}

/** Colours of a legend, as `#rrggbb`. */
export function rampStops(ramp: Ramp): string[] {
  return Array.from({ length: STOPS }, (_, k) => hex(rampColour(k / (STOPS - 1), ramp)));
}

/** Colours as RGBA bytes, from the smallest to the largest number. */
export function rampTexels(count: number, ramp: Ramp): Uint8Array {
  const texels = new Uint8Array(4 * count);
  for (let k = 0; k < count; ++k) {
    const colour = rampColour(k / (count - 1), ramp);
    for (let part = 0; part < 3; ++part) {
      texels[4 * k + part] = Math.round(255 * Math.min(Math.max(colour[part], 0), 1));
    }
    texels[4 * k + 3] = 255;
  }
  return texels;
}

/** Smallest and largest number of an attribute. */
export interface Range {
  min: number;
  max: number;
}

/** Position of a number in a range: 0 at `min`, 1 at `max`, not limited. 0 in an empty range. */
export function shareOf({ min, max }: Range, value: number): number {
  return max > min ? (value - min) / (max - min) : 0;
}

/**
 * The range of the colours. `all`: the range of the numbers. `from` and `to`: the chosen ends; null: as
 * of `all`. If the only chosen end is beyond all numbers, the other end moves beyond it, so that all
 * numbers have the colour of the nearer end. If both are chosen and `from` is not below `to`: `all`.
 */
export function chosenRange(all: Range, from: number | null, to: number | null): Range {
  const width = all.max - all.min || 1;
  const min = from ?? (to !== null && to <= all.min ? to - width : all.min);
  const max = to ?? (min >= all.max && from !== null ? min + width : all.max);
  return min < max ? { min, max } : all;
}

/** Range of the finite numbers; null if there are none. */
export function rangeOf(values: Float32Array): Range | null {
  let min = Infinity;
  let max = -Infinity;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    if (value < min) min = value;
    if (value > max) max = value;
  }
  return min <= max ? { min, max } : null;
}

/** `range`, extended by the finite numbers of `values`. A null range has no numbers. */
export function widened(range: Range | null, values: Float32Array): Range | null {
  const more = rangeOf(values);
  if (!range || !more) return range ?? more;
  return { min: Math.min(more.min, range.min), max: Math.max(more.max, range.max) };
}
