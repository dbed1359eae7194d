import { toCss, type Size, type View } from '../draw/view';
import { axisMarks } from './axes';
import type { Measurement } from './measure';

const SPACE = 'http://www.w3.org/2000/svg';

function element(name: string, attributes: Record<string, string | number>, text = ''): SVGElement {
  const one = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, String(value));
  one.textContent = text;
  return one;
}

/** Axes and measurements over the picture. */
export class Overlay {
  readonly element = element('svg', { class: 'overlay', 'aria-hidden': 'true' });
  /** What is drawn, as text. */
  private drawn = '';

  draw(view: View, size: Size, hasAxes: boolean, measurement: Measurement, text: string): void {
    const { points } = measurement;
    const drawn = hasAxes || points.length > 0 ? JSON.stringify([view, size, hasAxes, points, text]) : '';
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    this.element.replaceChildren(...hasAxes ? axes(view, size) : [], ...measured(view, size, measurement, text));
  }
}

function axes(view: View, size: Size): SVGElement[] {
  if (size.width === 0 || size.height === 0) return [];
  const { x, y } = axisMarks(view, size);
  const bottom = size.height;
  return [
    ...x.flatMap(({ at, text }) => [
      element('line', { class: 'axis', x1: at, y1: bottom, x2: at, y2: bottom - 7 }),
      element('text', { x: at, y: bottom - 11, 'text-anchor': 'middle' }, text),
    ]),
    ...y.flatMap(({ at, text }) => [
      element('line', { class: 'axis', x1: 0, y1: at, x2: 7, y2: at }),
      element('text', { x: 11, y: at + 4 }, text),
    ]),
  ];
}

function measured(view: View, size: Size, { points }: Measurement, text: string): SVGElement[] {
  const places = points.map(([x, y]) => toCss(view, size, x, y));
  if (places.length === 0) return [];
  const [x, y] = places[places.length - 1];
  return [
    element('polyline', { class: 'measure', points: places.map((place) => place.join()).join(' ') }),
    ...places.map(([cx, cy]) => element('circle', { class: 'measure', cx, cy, r: 3 })),
    element('text', { class: 'result', x: x + 8, y: y - 8 }, text),
  ];
}
