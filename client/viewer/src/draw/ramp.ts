import { hex, oklch, type Rgb } from './colours';

/** Colours in a legend. */
const STOPS = 9;

/**
 * The colour of a number from 0 to 1: violet, teal, yellow, with lightness in equal steps. The dark
 * theme uses lighter colours, so that both ends contrast with the background.
 */
export function rampColour(share: number, dark: boolean): Rgb {
  const t = Math.min(Math.max(share, 0), 1);
  const lightness = dark ? 0.52 + 0.4 * t : 0.3 + 0.36 * t;
  const hue = (300 - 200 * t) / 360;
  return oklch(lightness, 0.16 - 0.02 * t, hue);
}

/** Colours of a legend, as `#rrggbb`. */
export function rampStops(dark: boolean): string[] {
  return Array.from({ length: STOPS }, (_, k) => hex(rampColour(k / (STOPS - 1), dark)));
}

/** Colours as RGBA bytes, from the smallest to the largest number. */
export function rampTexels(count: number, dark: boolean): Uint8Array {
  const texels = new Uint8Array(4 * count);
  for (let k = 0; k < count; ++k) {
    const colour = rampColour(k / (count - 1), dark);
    for (let part = 0; part < 3; ++part) {
      texels[4 * k + part] = Math.round(255 * Math.min(Math.max(colour[part], 0), 1));
    }
    texels[4 * k + 3] = 255;
  }
  return texels;
}

/** Range of an attribute. */
export interface Range {
  min: number;
  max: number;
}

/** Position of a number in a range, 0 to 1. */
export function shareOf({ min, max }: Range, value: number): number {
  return max > min ? (value - min) / (max - min) : 0;
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
