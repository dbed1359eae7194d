import { hex, theme } from '../draw/colours';
import { scaleLength } from '../draw/scale';
import type { Legend } from '../draw/scene';
import { toCss, type Size, type View } from '../draw/view';
import { axisMarks } from '../ui/axes';
import { number } from '../ui/format';
import type { Point } from '../ui/measure';
import type { Overlaid } from '../ui/overlay';
import { short } from './paths';

type Align = 'left' | 'centre' | 'right';

/** A text, a filled rectangle, a line or a circle on an exported picture, in CSS pixels. */
export type Mark =
  // `halo`: colour of an edge around the text, which lies over the picture.
  | { kind: 'text'; x: number; y: number; text: string; align: Align; colour: string; halo?: string }
  | { kind: 'box'; x: number; y: number; width: number; height: number; colour: string }
  | { kind: 'line'; points: Point[]; width: number; colour: string }
  | { kind: 'circle'; x: number; y: number; radius: number; width: number; colour: string };

const NOTHING: Overlaid = { axes: false, contacts: [], points: [], text: '' };

const FONT_PIXELS = 12;
const FONT = 'system-ui, sans-serif';
/** Distance from the border of the picture. */
const MARGIN = 10;
const BAR_WIDTH = 160;
const BAR_HEIGHT = 8;
/** Space of the coordinates along an axis: at the left edge, and at the lower edge. */
const AXIS_WIDTH = 48;
const AXIS_HEIGHT = 22;
const TICK = 7;
/** Colours of measurements, as `--accent` of the page. */
const MEASURE_LIGHT = '#0b5cad';
const MEASURE_DARK = '#6bb5ff';
/** Colours of contacts, as `--contact` of the page. */
const CONTACT_LIGHT = '#a3470f';
const CONTACT_DARK = '#ff9d5c';
/** Names of alignments in SVG and of a canvas. */
const ANCHORS = { left: 'start', centre: 'middle', right: 'end' } as const;
const ALIGNS = { left: 'left', centre: 'center', right: 'right' } as const;
/** Width of the halo of a text. */
const HALO = 3;
/** Rectangles of the legend's bar per colour. */
const STEPS_PER_STOP = 10;

/** The axes, contacts and measurement that lie over the picture. */
function overlaidMarks({ axes, contacts, points, text }: Overlaid, size: Size, view: View, dark: boolean): Mark[] {
  const ink = hex(theme(dark).outline);
  const halo = hex(theme(dark).background);
  const colour = dark ? MEASURE_DARK : MEASURE_LIGHT;
  const marks: Mark[] = [];
  const line = (x: number, y: number, right: number, up: number) =>
    marks.push({ kind: 'line', points: [[x, y], [x + right, y - up]], width: 1, colour: ink });
  const label = (x: number, y: number, content: string, align: Align) =>
    marks.push({ kind: 'text', x, y, text: content, align, colour: ink, halo });
  const { x, y } = axes ? axisMarks(view, size) : { x: [], y: [] };
  for (const { at, text: content } of x) {
    line(at, size.height, 0, TICK);
    label(at, size.height - TICK - 4, content, 'centre');
  }
  for (const { at, text: content } of y) {
    line(0, at, TICK, 0);
    label(TICK + 4, at + 4, content, 'left');
  }
  for (const { x: px, y: py, text: angle } of contacts) {
    marks.push({ kind: 'circle', x: px, y: py, radius: 4, width: 2, colour: dark ? CONTACT_DARK : CONTACT_LIGHT });
    if (angle !== '') label(px + 8, py + 18, angle, 'left');
  }
  if (points.length === 0) return marks;
  const places = points.map(([px, py]): Point => toCss(view, size, px, py));
  marks.push({ kind: 'line', points: places, width: 2, colour });
  for (const [px, py] of places) marks.push({ kind: 'circle', x: px, y: py, radius: 3, width: 2, colour });
  const [px, py] = places[places.length - 1];
  marks.push({ kind: 'text', x: px + 8, y: py - 8, text, align: 'left', colour: ink, halo });
  return marks;
}

/**
 * The marks of a picture: caption (name, frame and time), scale, legend and `overlaid`. Axes move
 * caption, scale and legend inward.
 */
export function marksOf(
  caption: string, size: Size, view: View, legend: Legend | null, dark: boolean, overlaid: Overlaid = NOTHING,
): Mark[] {
  const ink = hex(theme(dark).outline);
  const paper = hex(theme(dark).background);
  const text = (x: number, y: number, content: string, align: 'left' | 'right' = 'left'): Mark =>
    ({ kind: 'text', x, y, text: content, align, colour: ink });
  const box = (x: number, y: number, width: number, height: number, colour: string): Mark =>
    ({ kind: 'box', x, y, width, height, colour });
  const length = scaleLength(view);
  const right = size.width - MARGIN;
  const left = MARGIN + (overlaid.axes ? AXIS_WIDTH : 0);
  const bottom = size.height - MARGIN - (overlaid.axes ? AXIS_HEIGHT : 0);
  const marks = [
    ...overlaidMarks(overlaid, size, view, dark),
    text(left, bottom, caption),
    text(right, bottom - 8, number(length, 2), 'right'),
    box(right - length * view.scale, bottom - 2, length * view.scale, 2, ink),
  ];
  if (!legend) return marks;
  const top = MARGIN + FONT_PIXELS;
  const { stops } = legend;
  const steps = (stops.length - 1) * STEPS_PER_STOP;
  const step = BAR_WIDTH / steps;
  marks.push(box(left - 4, MARGIN - 4, BAR_WIDTH + 8, 2 * FONT_PIXELS + BAR_HEIGHT + 18, paper));
  marks.push(text(left, top, legend.name));
  for (let k = 0; k < steps; ++k) {
    const colour = stops[Math.round(k / (steps - 1) * (stops.length - 1))];
    marks.push(box(left + k * step, top + 5, step, BAR_HEIGHT, colour));
  }
  const below = top + BAR_HEIGHT + FONT_PIXELS + 7;
  marks.push(text(left, below, number(legend.min, 4)));
  marks.push(text(left + BAR_WIDTH, below, number(legend.max, 4), 'right'));
  return marks;
}

/** Elements of an SVG picture. */
export function marksSvg(marks: readonly Mark[]): string[] {
  return marks.map((mark) => {
    if (mark.kind === 'box') {
      return `<rect x="${short(mark.x)}" y="${short(mark.y)}" width="${short(mark.width)}" ` +
        `height="${short(mark.height)}" fill="${mark.colour}"/>`;
    }
    if (mark.kind === 'line') {
      const points = mark.points.map(([x, y]) => `${short(x)},${short(y)}`).join(' ');
      return `<polyline points="${points}" fill="none" stroke="${mark.colour}" stroke-width="${mark.width}"/>`;
    }
    if (mark.kind === 'circle') {
      return `<circle cx="${short(mark.x)}" cy="${short(mark.y)}" r="${mark.radius}" fill="none" ` +
        `stroke="${mark.colour}" stroke-width="${mark.width}"/>`;
    }
    const halo = mark.halo ? `paint-order="stroke" stroke="${mark.halo}" stroke-width="${HALO}" ` : '';
    return `<text x="${short(mark.x)}" y="${short(mark.y)}" font-family="${FONT}" ` +
      `font-size="${FONT_PIXELS}" fill="${mark.colour}" ${halo}` +
      `text-anchor="${ANCHORS[mark.align]}">${escaped(mark.text)}</text>`;
  });
}

/** Draws marks over a picture. `ratio`: device pixels per CSS pixel. */
export function drawMarks(context: CanvasRenderingContext2D, marks: readonly Mark[], ratio: number): void {
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = `${FONT_PIXELS}px ${FONT}`;
  context.lineJoin = 'round';
  for (const mark of marks) {
    context.fillStyle = context.strokeStyle = mark.colour;
    if (mark.kind === 'box') {
      context.fillRect(mark.x, mark.y, mark.width, mark.height);
    } else if (mark.kind === 'text') {
      context.textAlign = ALIGNS[mark.align];
      if (mark.halo) {
        context.strokeStyle = mark.halo;
        context.lineWidth = HALO;
        context.strokeText(mark.text, mark.x, mark.y);
      }
      context.fillText(mark.text, mark.x, mark.y);
    } else {
      context.lineWidth = mark.width;
      context.beginPath();
      if (mark.kind === 'line') for (const [x, y] of mark.points) context.lineTo(x, y);
      else context.arc(mark.x, mark.y, mark.radius, 0, 2 * Math.PI);
      context.stroke();
    }
  }
  context.setTransform(1, 0, 0, 1, 0, 0);
}

function escaped(text: string): string {
  return text.replace(/[&<>]/g, (sign) => `&#${sign.charCodeAt(0)};`);
}
