import uPlot from 'uplot';
import type { Entry, Summary } from '../stream/history';
import { reductionOf, STAGES } from '../stream/summary';
import type { CurveSource } from '../stream/track';
import { curvePoints, entriesOf } from './curve_data';
import { byId, make } from './dom';
import { count, number } from './format';
import type { TextPace } from './text_pace';
import { tickDigits, ticks } from './ticks';

/** `text`: formats a value as in the numbers under the picture. */
interface Line { name: string; value(summary: Summary): number; text(value: number): string }

export interface Curve {
  title: string;
  lines: Line[];
  isWide?: boolean;
  /** The kind of results that have the curve; both, if absent. */
  of?: 'plane' | 'space';
  /** Draws the lines as bands on top of each other, and shows this sum. */
  total?(summary: Summary): number;
}

const milliseconds = (value: number) => number(value, 3);

/** Curves of results. */
export const RESULT_CURVES: Curve[] = [
  { title: 'Area', lines: [{ name: 'area', value: (s) => s.area, text: (value) => number(value, 7) }] },
  { title: 'Volume', of: 'space', lines: [{ name: 'volume', value: (s) => s.volume ?? NaN, text: (value) => number(value, 7) }] },
  { title: 'Bodies, cavities', of: 'space', lines: [
    { name: 'bodies', value: (s) => s.rings, text: count },
    { name: 'cavities', value: (s) => s.holes, text: count },
  ] },
  { title: 'Triangles', of: 'space', lines: [{ name: 'triangles', value: (s) => s.triangles, text: count }] },
  { title: 'Rings, holes', of: 'plane', lines: [
    { name: 'rings', value: (s) => s.rings, text: count },
    { name: 'holes', value: (s) => s.holes, text: count },
  ] },
  { title: 'Triangles', of: 'plane', lines: [
    { name: 'merged', value: (s) => s.triangles, text: count },
    { name: 'unmerged', value: (s) => s.trianglesGrid, text: count },
  ] },
  { title: 'Reduction, %', of: 'plane', lines: [{ name: 'reduction', value: reductionOf, text: (value) => number(value, 3) }] },
  {
    title: 'Milliseconds',
    lines: STAGES.map((name, k) => ({ name, value: (s: Summary) => s.stages[k], text: milliseconds })),
    isWide: true,
    total: (s) => s.milliseconds,
  },
];

/** Curves of a stream through the server. */
export const STREAM_CURVES: Curve[] = [
  { title: 'Frames', isWide: true, lines: [
    { name: 'received', value: (s) => s.received, text: count },
    { name: 'drawn', value: (s) => s.drawn, text: count },
    { name: 'dropped', value: (s) => s.dropped, text: count },
  ] },
  { title: 'Latency, ms', lines: [{ name: 'latency', value: (s) => s.latency, text: milliseconds }] },
];

/** Distinct in both themes. The first is the accent. */
const COLOURS = {
  light: ['#0b5cad', '#c2410c', '#15803d', '#7e22ce', '#a16207', '#be185d', '#0f766e', '#525b6b', '#4d7c0f'],
  dark: ['#6bb5ff', '#fb923c', '#4ade80', '#c084fc', '#facc15', '#f472b6', '#2dd4bf', '#aab4c4', '#a3e635'],
};
const REFRESH_MS = 300;
/** Plots drawn in one refresh of the screen. Drawing all of them takes longer than a refresh. */
const PLOTS_PER_REFRESH = 1;
/** Width of a digit on an axis. */
const LABEL_PIXELS = 6;

/** Values of the lines at each entry; null for gaps. Bands are cumulative sums, the largest first. */
function valuesOf({ lines, total }: Curve, entries: readonly (Entry | null)[]): (number | null)[][] {
  const values = lines.map((line) => entries.map((entry) => (entry ? line.value(entry.summary) : NaN)));
  if (total) {
    for (let k = 1; k < values.length; ++k) values[k] = values[k].map((value, i) => value + values[k - 1][i]);
    values.reverse();
  }
  return values.map((row) => row.map((value) => (Number.isFinite(value) ? value : null)));
}

/** Indices of values both of whose neighbours are missing, so that no line shows them. */
function isolated(values: ArrayLike<number | null | undefined>): number[] {
  const isThere = (k: number) => values[k] !== null && values[k] !== undefined;
  return [...Array(values.length).keys()].filter((k) => isThere(k) && !isThere(k - 1) && !isThere(k + 1));
}

/** The upper limit of bands: without the slowest 3 % if these would flatten the rest. */
function topOf(values: (number | null | undefined)[]): number {
  const sorted = values.filter((value) => typeof value === 'number').sort((a, b) => a - b);
  const peak = sorted[sorted.length - 1] ?? 1;
  const usual = 1.3 * (sorted[Math.floor(0.97 * (sorted.length - 1))] ?? 1);
  return sorted.length > 10 && peak > 2 * usual ? usual : 1.05 * peak;
}

interface Item {
  curve: Curve; figure: HTMLElement; caption: HTMLElement; holder: HTMLElement; plot: uPlot;
  /** Whether a part of the plot is on the screen. */
  isSeen: boolean;
  /** Whether the plot lacks the data of the last refresh. */
  isStale: boolean;
}

/** Curves over the frames of a track. A click goes to a frame. */
export class CurvesPanel {
  private items: Item[] = [];
  private readonly panel = byId('curves', HTMLElement);
  private entries: readonly (Entry | null)[] = [];
  private labels: number[] = [];
  /** Frames of the dashed lines. */
  private others: readonly (Entry | null)[] = [];
  private track: CurveSource | null = null;
  /** Whether the dashed lines have data. */
  private isCompared = false;
  private lastRefresh = -Infinity;
  private position = NaN;
  /** Figures under the picture, and their text when the captions were written. */
  private shown: Summary | null = null;
  private note = '';
  private captioned = '';
  /** Index of the entry under the pointer. */
  private hovered: number | null = null;
  private colours = COLOURS.light;
  private kind: 'plane' | 'space' = 'plane';
  private readonly seen = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      const item = this.items.find(({ figure }) => figure === target);
      if (item) item.isSeen = isIntersecting;
    }
  });

  /** `isDetailed`: captions of stacked curves have the value of each line, not only their sum. */
  constructor(private readonly curves: readonly Curve[], private readonly isDetailed: boolean,
              private readonly goTo: (sequence: number) => void) {
    this.items = curves.map((curve) => this.makeItem(curve));
    new ResizeObserver(() => this.resize()).observe(this.panel);
    addEventListener('beforeprint', () => {
      for (const item of this.items) this.draw(item);
    });
  }

  /** Shows `first` before the permanent curves. Replaces the curves of an earlier call. */
  setFirst(first: readonly Curve[]): void {
    for (const { figure, plot } of this.items.splice(0, this.items.length - this.curves.length)) {
      plot.destroy();
      this.seen.unobserve(figure);
      figure.remove();
    }
    const items = first.map((curve) => this.makeItem(curve));
    this.items[0].figure.before(...items.map(({ figure }) => figure));
    this.items.unshift(...items);
    this.resize();
    this.lastRefresh = -Infinity;
  }

  /** Shows the curves that results of this kind have. */
  setKind(kind: 'plane' | 'space'): void {
    if (kind === this.kind) return;
    this.kind = kind;
    for (const { curve, figure } of this.items) figure.hidden = curve.of !== undefined && curve.of !== kind;
    this.resize();
    this.lastRefresh = -Infinity;
  }

  setDark(dark: boolean): void {
    this.colours = dark ? COLOURS.dark : COLOURS.light;
    for (const item of this.items) {
      item.plot.destroy();
      item.plot = this.makePlot(item.curve, item.holder);
    }
    this.lastRefresh = -Infinity;
  }

  get shownEntries(): readonly (Entry | null)[] { return this.entries; }

  /**
   * `other`: frames to compare with, drawn as dashed lines. `shown`: the figures under the picture.
   * `isStreamed`: whether they are points of the curves.
   */
  refresh(track: CurveSource | null, other: CurveSource | null, shown: Summary | null, isStreamed: boolean,
          pace: TextPace): void {
    const { now } = pace;
    if (track !== this.track || (other !== null) !== this.isCompared) this.lastRefresh = -Infinity;
    this.isCompared = other !== null;
    if (this.hovered === null && (!track || pace.isDueFor(track))) this.setCaptions(shown, isStreamed);
    // Under the pointer, captions and lines must have the same frames.
    const isWhole = this.lastRefresh === -Infinity || this.hovered !== null;
    if (now - this.lastRefresh >= REFRESH_MS) this.takeFrames(track, other, now);
    const stale = this.items.filter(({ isSeen, isStale }) => isSeen && isStale);
    for (const item of isWhole ? stale : stale.slice(0, PLOTS_PER_REFRESH)) this.draw(item);
  }

  /** Takes the frames for all plots. */
  private takeFrames(track: CurveSource | null, other: CurveSource | null, now: number): void {
    this.lastRefresh = now;
    this.track = track;
    this.position = track?.player.sequence ?? NaN;
    const { x, entries } = track ? curvePoints(track) : { x: [], entries: [] };
    this.labels = x;
    this.entries = entries;
    this.others = other ? entriesOf(other, entries) : entries.map(() => null);
    for (const item of this.items) item.isStale = true;
    this.showCaptions();
  }

  private draw(item: Item): void {
    const { curve, plot } = item;
    item.isStale = false;
    plot.setData([this.labels, ...valuesOf(curve, this.entries), ...curve.total ? [] : valuesOf(curve, this.others)]);
  }

  private setCaptions(shown: Summary | null, isStreamed: boolean): void {
    const frame = JSON.stringify([shown, isStreamed, this.isCompared]);
    if (frame === this.captioned) return;
    this.captioned = frame;
    this.shown = shown;
    this.note = !isStreamed ? ' (line: as streamed)' : this.isCompared ? ' (dashed: as streamed)' : '';
    this.showCaptions();
  }

  /** Writes the values at the pointer, or else of the frame shown, in the colours of the lines. */
  private showCaptions(): void {
    const summary = this.hovered === null ? this.shown : this.entries[this.hovered]?.summary ?? null;
    for (const { curve: { title, lines, isWide, total }, caption } of this.items) {
      const note = total && this.isCompared ? '' : this.note;
      const parts: (Node | string)[] = [title];
      if (total && summary) parts.push(' ', make('b', {}, milliseconds(total(summary))));
      lines.forEach((line, i) => {
        const value = summary && (!total || this.isDetailed) ? line.text(line.value(summary)) : '';
        const text = isWide ? `${line.name} ${value}` : value;
        parts.push(' ', make('b', { style: `color: ${this.colours[i]}`, title: line.name }, text));
      });
      if (this.hovered === null && note) parts.push(note);
      caption.replaceChildren(...parts);
    }
  }

  private makeItem(curve: Curve): Item {
    const caption = make('figcaption', {}, curve.title);
    const holder = make('div', { class: 'plot' });
    const figure = make('figure', { class: curve.isWide ? 'curve wide' : 'curve', 'aria-label': curve.title }, caption, holder);
    figure.hidden = curve.of !== undefined && curve.of !== this.kind;
    this.panel.append(figure);
    this.seen.observe(figure);
    return { curve, figure, caption, holder, plot: this.makePlot(curve, holder), isSeen: false, isStale: true };
  }

  private makePlot(curve: Curve, holder: HTMLElement): uPlot {
    const style = getComputedStyle(document.documentElement);
    const quiet = style.getPropertyValue('--quiet').trim();
    const line = style.getPropertyValue('--line').trim();
    const axis: uPlot.Axis = {
      stroke: quiet, font: '10px system-ui', grid: { stroke: line, width: 0.5 }, ticks: { show: false },
    };
    const series = curve.lines.map(({ name }, k): uPlot.Series => ({
      label: name, stroke: this.colours[k], width: 1.25, spanGaps: false,
      points: { show: true, size: 3, filter: (self, index) => isolated(self.data[index]) },
      ...curve.total && { fill: this.colours[k], width: 0 },
    }));
    const dashed = curve.total ? [] : curve.lines.map((_, k): uPlot.Series => ({
      stroke: this.colours[k], width: 1, dash: [5, 4], spanGaps: false, points: { show: false },
    }));
    const plot = new uPlot({
      width: Math.max(60, holder.clientWidth),
      height: Math.max(40, holder.clientHeight),
      legend: { show: false },
      padding: [6, 8, 0, 0],
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: {
        x: { time: false },
        ...curve.total && { y: { range: (self: uPlot) => [0, topOf([...self.data[1] ?? []])] as [number, number] } },
      },
      axes: [
        {
          ...axis, size: 19, gap: 4, splits: (_, __, min, max) => ticks(min, max),
          values: (self, all) => {
            const texts = all.map((tick) => number(tick, Math.max(5, tickDigits(all))));
            const widest = LABEL_PIXELS * (1 + Math.max(...texts.map(({ length }) => length)));
            const isNarrow = self.bbox.width / devicePixelRatio / all.length < widest;
            return texts.map((text, k) => (isNarrow && k % 2 === 1 ? '' : text));
          },
        },
        {
          ...axis, size: 48, gap: 2, splits: (_, __, min, max) => ticks(min, max),
          values: (_, all) => all.map((tick) => number(tick, tickDigits(all))),
        },
      ],
      series: [{}, ...curve.total ? series.reverse() : series, ...dashed],
      hooks: { draw: [(self) => this.drawPosition(self)], setCursor: [(self) => this.hover(self.cursor.idx)] },
    }, [[], ...[...series, ...dashed].map(() => [])], holder);
    plot.over.addEventListener('click', (event) => {
      const label = plot.posToVal(event.offsetX, 'x');
      if (this.track && Number.isFinite(label)) this.goTo(this.track.sequenceOf(label));
    });
    return plot;
  }

  private hover(index: number | null | undefined): void {
    if ((index ?? null) === this.hovered) return;
    this.hovered = index ?? null;
    this.showCaptions();
  }

  /** Draws a line at the current frame. */
  private drawPosition(plot: uPlot): void {
    if (!Number.isFinite(this.position) || plot.data[0].length === 0) return;
    const label = Number(this.track?.labelOf(this.position));
    const x = Math.round(plot.valToPos(label, 'x', true)) + 0.5;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = this.colours[0];
    ctx.globalAlpha = 0.6;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  private resize(): void {
    for (const { plot, holder: { clientWidth: width, clientHeight: height } } of this.items) {
      if (width > 0 && height > 0) plot.setSize({ width, height });
    }
  }
}
