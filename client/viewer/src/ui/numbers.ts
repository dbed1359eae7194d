import { Fill, Placement } from '@proto/v1/reconstruction_pb';
import { digestText } from '../protocol/digest';
import { NO_RING, type Frame } from '../protocol/frame';
import { FILLS, nameOf, PLACEMENTS } from '../stream/settings';
import { make, setText } from './dom';
import { count, number } from './format';

/** Of how the frame was made. */
export interface Method { placement: Placement; fill: Fill }

const ROWS: [string, string][] = [
  ['frame', 'Frame'], ['time', 'Time'], ['placement', 'Placement'], ['fill', 'Fill'],
  ['particles', 'Particles'], ['triangles', 'Triangles'], ['grid', 'Unmerged'], ['rings', 'Rings, holes'],
  ['area', 'Area'], ['perimeter', 'Perimeter'], ['spacing', 'Spacing'], ['ms', 'Time, ms'],
  ['rings-digest', 'Rings digest'], ['mesh-digest', 'Mesh digest'],
];

/** The numbers of the frame that a pane shows. */
export class Numbers {
  readonly element = make('dl', { class: 'numbers' });
  private readonly values = new Map<string, HTMLElement>();

  constructor() {
    for (const [key, title] of ROWS) {
      const value = make('dd', { 'data-key': key }, '–');
      this.values.set(key, value);
      const width = key.endsWith('digest') || key === 'placement' ? 'wide' : '';
      this.element.append(make('div', { class: width }, make('dt', {}, title), value));
    }
  }

  show(frame: Frame, method: Method | null): void {
    const { statistics, rings } = frame;
    const outer = rings.outerOf.reduce((sum, of) => sum + (of === NO_RING ? 1 : 0), 0);
    this.set('frame', String(frame.sequence));
    this.set('time', number(frame.time, 6));
    this.set('placement', method ? nameOf(PLACEMENTS, method.placement) : '–');
    this.set('fill', method ? nameOf(FILLS, method.fill) : '–');
    this.set('particles', count(statistics.particles));
    this.set('triangles', count(statistics.triangles));
    this.set('grid', count(statistics.trianglesGrid));
    this.set('rings', `${count(outer)}, ${count(rings.outerOf.length - outer)}`);
    this.set('area', number(statistics.area, 7));
    this.set('perimeter', number(statistics.perimeter, 7));
    this.set('spacing', number(statistics.spacing));
    this.set('ms', number(statistics.milliseconds, 3));
    this.set('rings-digest', digestText(frame.ringsDigest));
    this.set('mesh-digest', digestText(frame.meshDigest));
  }

  private set(key: string, text: string): void {
    const value = this.values.get(key);
    if (!value) return;
    setText(value, text);
    if (value.title !== text) value.title = text;
  }
}
