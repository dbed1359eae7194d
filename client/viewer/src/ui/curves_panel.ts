import uPlot from 'uplot';
import type { Entry, Summary } from '../stream/history';
import { STAGES } from '../stream/summary';
import type { Track } from '../stream/track';
import { byId, make } from './dom';
import { number } from './format';

interface Line { name: string; value(summary: Summary): number }
/** `total`: told instead of each line's number, where there are many. */
interface Curve { title: string; lines: Line[]; isWide?: boolean; total?(summary: Summary): number }

const CURVES: Curve[] = [
  { title: 'Area', lines: [{ name: 'area', value: (s) => s.area }] },
  { title: 'Rings', lines: [{ name: 'rings', value: (s) => s.rings }] },
  { title: 'Triangles', lines: [
    { name: 'merged', value: (s) => s.triangles },
    { name: 'unmerged', value: (s) => s.trianglesGrid },
  ] },
  {
    title: 'Milliseconds',
    lines: STAGES.map((name, k) => ({ name, value: (s: Summary) => s.stages[k] })),
    isWide: true,
    total: (s) => s.milliseconds,
  },
  { title: 'Frames', isWide: true, lines: [
    { name: 'received', value: (s) => s.received },
    { name: 'drawn', value: (s) => s.drawn },
    { name: 'dropped', value: (s) => s.dropped },
  ] },
  { title: 'Latency, ms', lines: [{ name: 'latency', value: (s) => s.latency }] },
];

/** Distinct in both themes, the first is the accent. */
const COLOURS = {
  light: ['#0b5cad', '#c2410c', '#15803d', '#7e22ce', '#a16207', '#be185d', '#0f766e', '#525b6b'],
  dark: ['#6bb5ff', '#fb923c', '#4ade80', '#c084fc', '#facc15', '#f472b6', '#2dd4bf', '#aab4c4'],
};
/** More points than a curve has pixels show nothing more. */
const MOST_POINTS = 600;
const REFRESH_MS = 300;

/** At most MOST_POINTS entries, evenly taken. */
function sample(track: Track): Entry[] {
  const { history } = track;
  const count = Math.min(history.size, MOST_POINTS);
  return Array.from({ length: count }, (_, k) =>
    history.entry(Math.round(k * (history.size - 1) / Math.max(1, count - 1))));
}

/** Curves over the frames that a track holds; a click in one goes to that frame. */
export class CurvesPanel {
  private plots: uPlot[] = [];
  private readonly captions: HTMLElement[] = [];
  private readonly holders: HTMLElement[] = [];
  private lastRefresh = -Infinity;
  private place = NaN;
  private colours = COLOURS.light;

  constructor(private readonly goTo: (sequence: number) => void) {
    const panel = byId('curves', HTMLElement);
    for (const { title, isWide } of CURVES) {
      const caption = make('figcaption', {}, title);
      const holder = make('div', { class: 'plot' });
      this.captions.push(caption);
      this.holders.push(holder);
      panel.append(make('figure', { class: isWide ? 'curve wide' : 'curve', 'aria-label': title }, caption, holder));
    }
    new ResizeObserver(() => this.resize()).observe(panel);
  }

  setDark(dark: boolean): void {
    for (const plot of this.plots) plot.destroy();
    this.colours = dark ? COLOURS.dark : COLOURS.light;
    this.plots = CURVES.map((curve, k) => this.makePlot(curve, this.holders[k]));
    this.lastRefresh = -Infinity;
  }

  refresh(track: Track | null, now: number): void {
    const place = track?.player.sequence ?? NaN;
    if (now - this.lastRefresh < REFRESH_MS) return;
    this.lastRefresh = now;
    this.place = place;
    const entries = track ? sample(track) : [];
    const x = entries.map((entry) => entry.sequence);
    CURVES.forEach((curve, k) => {
      const values = curve.lines.map((line) => entries.map(({ summary }) => {
        const value = line.value(summary);
        return Number.isFinite(value) ? value : null;
      }));
      this.plots[k]?.setData([x, ...values]);
    });
    this.caption(track?.entryAt(place)?.summary ?? null);
  }

  /** The numbers where the picture is, each in the colour of its line. */
  private caption(summary: Summary | null): void {
    CURVES.forEach(({ title, lines, isWide, total }, k) => {
      const parts: (Node | string)[] = [title];
      if (total && summary) parts.push(' ', make('b', {}, number(total(summary), 3)));
      lines.forEach((line, i) => {
        const value = summary && !total ? number(line.value(summary)) : '';
        const text = isWide ? `${line.name} ${value}` : value;
        parts.push(' ', make('b', { style: `color: ${this.colours[i]}`, title: line.name }, text));
      });
      this.captions[k].replaceChildren(...parts);
    });
  }

  private makePlot(curve: Curve, holder: HTMLElement): uPlot {
    const style = getComputedStyle(document.documentElement);
    const quiet = style.getPropertyValue('--quiet').trim();
    const line = style.getPropertyValue('--line').trim();
    const axis: uPlot.Axis = {
      stroke: quiet, font: '10px system-ui', grid: { stroke: line, width: 0.5 }, ticks: { show: false },
    };
    const plot = new uPlot({
      width: Math.max(60, holder.clientWidth),
      height: Math.max(40, holder.clientHeight),
      legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: { x: { time: false } },
      axes: [
        { ...axis, size: 16, gap: 1, space: 60 },
        { ...axis, size: 42, gap: 2, space: 24, values: (_, ticks) => ticks.map((tick) => number(tick, 3)) },
      ],
      series: [{}, ...curve.lines.map(({ name }, k) => ({
        label: name, stroke: this.colours[k], width: 1.25, points: { show: false }, spanGaps: false,
      }))],
      hooks: { draw: [(self) => this.drawPlace(self)] },
    }, [[], ...curve.lines.map(() => [])], holder);
    plot.over.addEventListener('click', (event) => {
      const sequence = plot.posToVal(event.offsetX, 'x');
      if (Number.isFinite(sequence)) this.goTo(sequence);
    });
    return plot;
  }

  /** A line where the picture is. */
  private drawPlace(plot: uPlot): void {
    if (!Number.isFinite(this.place) || plot.data[0].length === 0) return;
    const x = Math.round(plot.valToPos(this.place, 'x', true)) + 0.5;
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = this.colours[0];
    ctx.globalAlpha = 0.6;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  private resize(): void {
    this.plots.forEach((plot, k) => {
      const { clientWidth: width, clientHeight: height } = this.holders[k];
      if (width > 0 && height > 0) plot.setSize({ width, height });
    });
  }
}
