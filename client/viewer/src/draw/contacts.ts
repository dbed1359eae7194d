import type { Frame } from '../protocol/frame';
import { toCss, type Size, type View } from './view';

/** A contact (Rings.contacts) in a picture, in CSS pixels, and its text. */
export interface ContactMark { x: number; y: number; text: string }

/** With more contacts than this, texts would cover the picture. */
const MOST_TEXTS = 24;
const MOST_MARKS = 1000;

/** The first MOST_MARKS contacts in the picture. Texts are angles in degrees; all are empty above MOST_TEXTS marks. */
export function contactMarks({ rings, origin }: Frame, view: View, size: Size): ContactMark[] {
  const marks: ContactMark[] = [];
  rings.contacts.forEach((point, k) => {
    const [x, y] = toCss(view, size, origin[0] + rings.points[2 * point], origin[1] + rings.points[2 * point + 1]);
    if (x < 0 || y < 0 || x > size.width || y > size.height || marks.length === MOST_MARKS) return;
    marks.push({ x, y, text: `${Math.round(rings.contactAngles[k] * 180 / Math.PI)}°` });
  });
  return marks.length > MOST_TEXTS ? marks.map(({ x, y }) => ({ x, y, text: '' })) : marks;
}
