/** Fewest ticks of an axis. */
const FEWEST = 3;

/**
 * Round numbers in a range: the fewest of equal steps 1, 2 or 5 times a power of ten, but at least three. Only `min` if
 * the range is empty.
 */
export function ticks(min: number, max: number): number[] {
  if (!(max > min)) return [min];
  for (let power = Math.ceil(Math.log10(max - min)); ; --power) {
    for (const digit of [5, 2, 1]) {
      const step = digit * 10 ** power;
      const [first, last] = [Math.ceil(min / step), Math.floor(max / step)];
      // Multiplies by an integer and divides by a power of ten, so that .3 does not become
      // .30000000000000004.
      const at = (k: number) => (power < 0 ? (k * digit) / 10 ** -power : k * step);
      if (last - first + 1 >= FEWEST) return Array.from({ length: last - first + 1 }, (_, k) => at(first + k));
    }
  }
}

/** Number of significant digits with which neighbouring ticks differ, at least 3. */
export function tickDigits(all: readonly number[]): number {
  if (all.length < 2) return 3;
  const largest = Math.max(...all.map(Math.abs));
  return Math.max(3, Math.ceil(Math.log10(largest / (all[1] - all[0]))) + 1);
}
