import { toCss, toWorld, type Size, type View } from '../draw/view';
import { number } from './format';
import { tickDigits, ticks } from './ticks';

/** A coordinate on an axis, at a CSS position. */
export interface AxisMark { at: number; text: string }

/** Coordinates along the lower and the left edge of a picture. */
export function axisMarks(view: View, size: Size): { x: AxisMark[]; y: AxisMark[] } {
  const [left, top] = toWorld(view, size, 0, 0);
  const [right, bottom] = toWorld(view, size, size.width, size.height);
  const marks = (low: number, high: number, at: (value: number) => number) => {
    const all = ticks(low, high);
    return all.map((value) => ({ at: at(value), text: number(value, tickDigits(all)) }));
  };
  return {
    x: marks(left, right, (value) => toCss(view, size, value, 0)[0]),
    y: marks(bottom, top, (value) => toCss(view, size, 0, value)[1]),
  };
}
