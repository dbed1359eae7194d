import type { View } from './view';

const MOST_PIXELS = 120;

/** A round length in world units that has at most MOST_PIXELS in the view. */
export function scaleLength({ scale }: View): number {
  const longest = MOST_PIXELS / scale;
  const power = 10 ** Math.floor(Math.log10(longest));
  return [5, 2, 1].map((digit) => digit * power).find((size) => size <= longest) ?? longest;
}
