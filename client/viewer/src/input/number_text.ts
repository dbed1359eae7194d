// Numbers in the fields of the page, by the same rules as the flags of the command line
// (ParseNumber in proto/common/text.h).

const DECIMAL = /^-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?$/;

/** Magnitudes of coordinates that the core accepts for gauges and slice planes, and for walls and lengths. */
export const MOST_OF_PLANES = 1e69;
export const MOST_OF_WALLS = 1e60;
export const LEAST_LENGTH = 1e-60;

/**
 * The decimal number that `text` consists of: `-1.5e3`. NaN for other text, such as `+1`, `0x10`, ` 1` or
 * `inf`, and for a number that float64 does not have.
 */
export function parseDecimal(text: string): number {
  if (!DECIMAL.test(text)) return NaN;
  const value = Number(text);
  const isLost = value === 0 && /[1-9]/.test(text.split(/e/i)[0]);
  return Number.isFinite(value) && !isLost ? value : NaN;
}
