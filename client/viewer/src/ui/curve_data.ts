import type { Gauges } from '../gauges/gauges';
import { columnsOf } from '../gauges/kinds';
import type { Entry, Summary } from '../stream/history';
import { reductionOf, STAGES } from '../stream/summary';
import type { CurveSource, Track } from '../stream/track';

/** Limit of points in a curve: about one per pixel. */
const MOST_POINTS = 600;

/** Points of curves. A null entry is a gap: frames are missing there. */
export interface CurvePoints { x: number[]; entries: (Entry | null)[] }

/** At most MOST_POINTS entries in equal steps, and a gap wherever frames between two of them are missing. */
export function curvePoints(track: Pick<Track, 'history' | 'labelOf'>): CurvePoints {
  const { history } = track;
  const count = Math.min(history.size, MOST_POINTS);
  const chosen = Array.from({ length: count }, (_, k) => Math.round(k * (history.size - 1) / Math.max(1, count - 1)));
  const labels = chosen.map((index) => Number(track.labelOf(history.entry(index).sequence)));
  // Frames per entry. It is above 1 if a stream is watched, or a report written, with every n-th
  // frame.
  const steps = labels.slice(1).map((label, k) => (label - labels[k]) / (chosen[k + 1] - chosen[k]));
  const step = Math.min(...steps);
  const points: CurvePoints = { x: [], entries: [] };
  labels.forEach((label, k) => {
    if (k > 0 && steps[k - 1] > step) {
      points.x.push((labels[k - 1] + label) / 2);
      points.entries.push(null);
    }
    points.x.push(label);
    points.entries.push(history.entry(chosen[k]));
  });
  return points;
}

/** The frames of `other` with the sequences of `entries`; null where it has none. */
export function entriesOf(other: Pick<CurveSource, 'history'>, entries: readonly (Entry | null)[]): (Entry | null)[] {
  return entries.map((entry) => entry && other.history.get(entry.sequence));
}

type Column = [string, (summary: Summary) => number];

/** Columns of the file of curves: of outlines, of surfaces, and of both. */
const OF_OUTLINES: Column[] = [
  ['area', (s) => s.area],
  ['rings', (s) => s.rings],
  ['holes', (s) => s.holes],
  ['triangles', (s) => s.triangles],
  ['triangles_unmerged', (s) => s.trianglesGrid],
  ['reduction_percent', reductionOf],
];
const OF_SURFACES: Column[] = [
  ['area', (s) => s.area],
  ['volume', (s) => s.volume ?? NaN],
  ['bodies', (s) => s.rings],
  ['cavities', (s) => s.holes],
  ['triangles', (s) => s.triangles],
];
const OF_BOTH: Column[] = [
  ['milliseconds', (s) => s.milliseconds],
  ...STAGES.map((name, k): Column => [`${name}_ms`, (s) => s.stages[k]]),
  ['received', (s) => s.received],
  ['drawn', (s) => s.drawn],
  ['dropped', (s) => s.dropped],
  ['latency_ms', (s) => s.latency],
];

/** All frames of the history as CSV, with the values of the gauges. A number that is unknown is empty. */
export function curvesCsv(track: Pick<Track, 'history' | 'labelOf'>, gauges: Gauges, isSpace = false): string {
  const { history } = track;
  gauges.measure(Array.from({ length: history.size }, (_, k) => history.entry(k)), () => false);
  const columns = [...isSpace ? OF_SURFACES : OF_OUTLINES, ...OF_BOTH, ...gauges.all.flatMap((gauge) => columnsOf(gauge).map(
    (name, k): Column => [name, (s) => gauges.value(s, gauge, k)]))];
  const cell = (value: number) => (Number.isFinite(value) ? String(value) : '');
  const rows = Array.from({ length: history.size }, (_, k) => {
    const { sequence, time, summary } = history.entry(k);
    return [track.labelOf(sequence), cell(time), ...columns.map(([, value]) => cell(value(summary)))].join(',');
  });
  return `${[['frame', 'time', ...columns.map(([name]) => name)].join(','), ...rows].join('\n')}\n`;
}
