import { digestText } from '../protocol/digest';
import { NO_RING, type Frame, type Statistics } from '../protocol/frame';
import { genusOf } from '../protocol/surface';
import { reductionOf, ringCounts } from '../stream/summary';
import type { Method } from '../stream/track';
import { make, setText } from './dom';
import { count, number } from './format';

/** A figure of a frame. `text` is empty for a figure that does not apply. */
interface Row { key: string; title: string; text(shown: Shown): string; isWide?: boolean; isAlert?: boolean;
  /** The kind of results that have the figure; both, if absent. */
  of?: 'plane' | 'space' }
interface Shown { frame: Frame; label: string; method: Method | null; statistics: Statistics }

function outerAndHoles({ rings: { outerOf } }: Frame): string {
  const outer = outerOf.reduce((sum, of) => sum + (of === NO_RING ? 1 : 0), 0);
  return `${count(outer)}, ${count(outerOf.length - outer)}`;
}

function shellCounts({ surface, shells }: Frame): string {
  const { rings: bodies, holes: cavities } = ringCounts(surface?.measures.volume ?? []);
  return `${count(shells?.bodies ?? bodies)}, ${count(shells?.cavities ?? cavities)}`;
}

function reduction(statistics: Statistics): string {
  const percent = reductionOf(statistics);
  return Number.isFinite(percent) ? `${percent.toFixed(1)} %` : '–';
}

function contactAngles({ rings: { contactAngles: angles } }: Frame): string {
  if (angles.length === 0) return '';
  const mean = angles.reduce((sum, angle) => sum + angle, 0) / angles.length;
  return `${number(mean * 180 / Math.PI, 3)}°, mean of ${count(angles.length)}`;
}

const unlessZero = (value: number) => (value > 0 ? count(value) : '');

const ROWS: Row[] = [
  { key: 'frame', title: 'Frame', text: ({ label }) => label },
  { key: 'time', title: 'Time', text: ({ frame }) => number(frame.time, 6) },
  { key: 'placement', of: 'plane', title: 'Placement', text: ({ method }) => method?.placement || '–', isWide: true },
  { key: 'fill', of: 'plane', title: 'Fill', text: ({ method }) => method?.fill || '–' },
  { key: 'particles', title: 'Particles', text: ({ statistics }) => count(statistics.particles) },
  { key: 'rings', of: 'plane', title: 'Rings, holes', text: ({ frame }) => outerAndHoles(frame) },
  { key: 'bodies', of: 'space', title: 'Bodies, cavities', text: ({ frame }) => shellCounts(frame), isWide: true },
  { key: 'vertices', of: 'plane', title: 'Vertices', text: ({ frame }) => count(frame.rings.points.length / 2) },
  { key: 'triangles', title: 'Triangles', text: ({ statistics }) => count(statistics.triangles) },
  { key: 'grid', of: 'plane', title: 'Unmerged', text: ({ statistics }) => count(statistics.trianglesGrid) },
  { key: 'reduction', of: 'plane', title: 'Reduction', text: ({ statistics }) => reduction(statistics) },
  { key: 'area', title: 'Area', text: ({ statistics }) => number(statistics.area, 7) },
  { key: 'volume', of: 'space', title: 'Volume', text: ({ statistics }) => number(statistics.volume ?? 0, 7) },
  { key: 'genus', of: 'space', title: 'Genus', text: ({ frame }) => count(frame.shells?.genus ?? genusOf(frame.surface)) },
  { key: 'perimeter', of: 'plane', title: 'Perimeter', text: ({ statistics }) => number(statistics.perimeter, 7) },
  { key: 'contact-angles', of: 'plane', title: 'Contact angles', text: ({ frame }) => contactAngles(frame), isWide: true },
  { key: 'spacing', title: 'Spacing', text: ({ statistics }) => number(statistics.spacing) },
  { key: 'ms', title: 'Milliseconds', text: ({ statistics }) => number(statistics.milliseconds, 3) },
  { key: 'holes', title: 'Dropped holes', text: ({ statistics }) => unlessZero(statistics.droppedHoles) },
  { key: 'components', title: 'Dropped components',
    text: ({ statistics }) => unlessZero(statistics.droppedComponents), isWide: true },
  { key: 'spray', title: 'Dropped spray', text: ({ statistics }) => unlessZero(statistics.droppedSpray) },
  { key: 'intersections', of: 'plane', title: 'Self-intersections',
    text: ({ statistics }) => unlessZero(statistics.selfIntersections), isAlert: true },
  { key: 'folded', of: 'plane', title: 'Folded triangles',
    text: ({ statistics }) => unlessZero(statistics.foldedTriangles), isAlert: true },
  { key: 'rings-digest', of: 'plane', title: 'Rings digest', text: ({ frame }) => digestText(frame.ringsDigest), isWide: true },
  { key: 'mesh-digest', of: 'plane', title: 'Mesh digest', text: ({ frame }) => (frame.meshDigest === null ? '–' : digestText(frame.meshDigest)), isWide: true },
  { key: 'surface-digest', of: 'space', title: 'Surface digest', text: ({ frame }) => digestText(frame.surfaceDigest ?? 0n), isWide: true },
];

/** The figures of a pane's frame. */
export class Numbers {
  /** The figures to write; null if they are written. */
  private shown: Shown | null = null;
  readonly element = make('dl', { class: 'numbers', tabindex: '0' });
  private readonly values = ROWS.map((row) => {
    const value = make('dd', { 'data-key': row.key }, '–');
    const kind = [row.isWide && 'wide', row.isAlert && 'alert'].filter(Boolean).join(' ');
    const cell = make('div', { class: kind }, make('dt', {}, row.title), value);
    cell.hidden = row.of === 'space';
    this.element.append(cell);
    return value;
  });

  /** Shows dashes. */
  clear(): void {
    this.shown = null;
    for (const value of this.values) {
      setText(value, '–');
      value.title = '';
    }
  }

  /** Sets the frame for the next call of `write`. */
  show(frame: Frame, label: string, method: Method | null): void {
    this.shown = { frame, label, method, statistics: frame.statistics };
  }

  /** Writes the figures of the frame. Returns false if they are written already. */
  write(): boolean {
    const { shown } = this;
    if (!shown) return false;
    this.shown = null;
    const isSpace = shown.frame.surface !== undefined;
    ROWS.forEach((row, k) => {
      const isOther = row.of !== undefined && (row.of === 'space') !== isSpace;
      const text = isOther ? '' : row.text(shown);
      const value = this.values[k];
      value.parentElement?.toggleAttribute('hidden', text === '');
      setText(value, text);
      if (value.title !== text) value.title = text;
    });
    return true;
  }
}
