import type { ContactMark } from '../draw/contacts';
import { toCss, type Size, type View } from '../draw/view';
import { axisMarks } from './axes';
import { makeSvg } from './dom';
import type { Point } from './measure';

/** Marks over the picture: axes, contacts with walls, and a measurement with its result. */
export interface Overlaid { axes: boolean; contacts: readonly ContactMark[]; points: readonly Point[]; text: string }

/** Draws the marks over the picture. */
export class Overlay {
  readonly element = makeSvg('svg', { class: 'overlay', 'aria-hidden': 'true' });
  /** The state of the last drawing, as JSON. */
  private drawn = '';

  draw(view: View, size: Size, overlaid: Overlaid): void {
    const { axes, contacts, points } = overlaid;
    const isEmpty = !axes && contacts.length === 0 && points.length === 0;
    const drawn = isEmpty ? '' : JSON.stringify([view, size, overlaid]);
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    this.element.replaceChildren(
      ...axes ? axisElements(view, size) : [], ...contacts.flatMap(contact), ...measured(view, size, overlaid),
    );
  }
}

function contact({ x, y, text }: ContactMark): SVGElement[] {
  const circle = makeSvg('circle', { class: 'contact', cx: x, cy: y, r: 4 });
  return text === '' ? [circle] : [circle, makeSvg('text', { class: 'angle', x: x + 8, y: y + 18 }, text)];
}

function axisElements(view: View, size: Size): SVGElement[] {
  if (size.width === 0 || size.height === 0) return [];
  const { x, y } = axisMarks(view, size);
  const bottom = size.height;
  return [
    ...x.flatMap(({ at, text }) => [
      makeSvg('line', { class: 'axis', x1: at, y1: bottom, x2: at, y2: bottom - 7 }),
      makeSvg('text', { x: at, y: bottom - 11, 'text-anchor': 'middle' }, text),
    ]),
    ...y.flatMap(({ at, text }) => [
      makeSvg('line', { class: 'axis', x1: 0, y1: at, x2: 7, y2: at }),
      makeSvg('text', { x: 11, y: at + 4 }, text),
    ]),
  ];
}

function measured(view: View, size: Size, { points, text }: Overlaid): SVGElement[] {
  const places = points.map(([x, y]) => toCss(view, size, x, y));
  if (places.length === 0) return [];
  const [x, y] = places[places.length - 1];
  return [
    makeSvg('polyline', { class: 'measure', points: places.map((place) => place.join()).join(' ') }),
    ...places.map(([cx, cy]) => makeSvg('circle', { class: 'measure', cx, cy, r: 3 })),
    makeSvg('text', { class: 'result', x: x + 8, y: y - 8 }, text),
  ];
}
