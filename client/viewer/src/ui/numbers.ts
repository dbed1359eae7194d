import { digestText } from '../protocol/digest';
import { NO_RING, type Frame, type Statistics } from '../protocol/frame';
import { reductionOf } from '../stream/summary';
import type { Method } from '../stream/track';
import { make, setText } from './dom';
import { count, number } from './format';

/** A figure of a frame. `text` is empty for a figure that does not apply. */
interface Row { key: string; title: string; text(shown: Shown): string; isWide?: boolean; isAlert?: boolean }
interface Shown { frame: Frame; label: string; method: Method | null; statistics: Statistics }

function ringCounts({ rings: { outerOf } }: Frame): string {
  const outer = outerOf.reduce((sum, of) => sum + (of === NO_RING ? 1 : 0), 0);
  return `${count(outer)}, ${count(outerOf.length - outer)}`;
}

function reduction(statistics: Statistics): string {
  const percent = reductionOf(statistics);
  return Number.isFinite(percent) ? `${percent.toFixed(1)} %` : '–';
}

const unlessZero = (value: number) => (value > 0 ? count(value) : '');

const ROWS: Row[] = [
  { key: 'frame', title: 'Frame', text: ({ label }) => label },
  { key: 'time', title: 'Time', text: ({ frame }) => number(frame.time, 6) },
  { key: 'placement', title: 'Placement', text: ({ method }) => method?.placement || '–', isWide: true },
  { key: 'fill', title: 'Fill', text: ({ method }) => method?.fill || '–' },
  { key: 'particles', title: 'Particles', text: ({ statistics }) => count(statistics.particles) },
  { key: 'rings', title: 'Rings, holes', text: ({ frame }) => ringCounts(frame) },
  { key: 'vertices', title: 'Vertices', text: ({ frame }) => count(frame.rings.points.length / 2) },
  { key: 'triangles', title: 'Triangles', text: ({ statistics }) => count(statistics.triangles) },
  { key: 'grid', title: 'Unmerged', text: ({ statistics }) => count(statistics.trianglesGrid) },
  { key: 'reduction', title: 'Reduction', text: ({ statistics }) => reduction(statistics) },
  { key: 'area', title: 'Area', text: ({ statistics }) => number(statistics.area, 7) },
  { key: 'perimeter', title: 'Perimeter', text: ({ statistics }) => number(statistics.perimeter, 7) },
  { key: 'spacing', title: 'Spacing', text: ({ statistics }) => number(statistics.spacing) },
  { key: 'ms', title: 'Milliseconds', text: ({ statistics }) => number(statistics.milliseconds, 3) },
  { key: 'holes', title: 'Dropped holes', text: ({ statistics }) => unlessZero(statistics.droppedHoles) },
  { key: 'components', title: 'Dropped components',
    text: ({ statistics }) => unlessZero(statistics.droppedComponents), isWide: true },
  { key: 'spray', title: 'Dropped spray', text: ({ statistics }) => unlessZero(statistics.droppedSpray) },
  { key: 'intersections', title: 'Self-intersections',
    text: ({ statistics }) => unlessZero(statistics.selfIntersections), isAlert: true },
  { key: 'folded', title: 'Folded triangles',
    text: ({ statistics }) => unlessZero(statistics.foldedTriangles), isAlert: true },
  { key: 'rings-digest', title: 'Rings digest', text: ({ frame }) => digestText(frame.ringsDigest), isWide: true },
  { key: 'mesh-digest', title: 'Mesh digest', text: ({ frame }) => (frame.meshDigest === null ? '–' : digestText(frame.meshDigest)), isWide: true },
];

/** The figures of a pane's frame. */
export class Numbers {
  readonly element = make('dl', { class: 'numbers', tabindex: '0' });
  private readonly values = ROWS.map((row) => {
    const value = make('dd', { 'data-key': row.key }, '–');
    const kind = [row.isWide && 'wide', row.isAlert && 'alert'].filter(Boolean).join(' ');
    this.element.append(make('div', { class: kind }, make('dt', {}, row.title), value));
    return value;
  });

  /** Shows dashes. */
  clear(): void {
    for (const value of this.values) {
      setText(value, '–');
      value.title = '';
    }
  }

  show(frame: Frame, label: string, method: Method | null): void {
    const shown = { frame, label, method, statistics: frame.statistics };
    ROWS.forEach((row, k) => {
      const text = row.text(shown);
      const value = this.values[k];
      value.parentElement?.toggleAttribute('hidden', text === '');
      setText(value, text);
      if (value.title !== text) value.title = text;
    });
  }
}
