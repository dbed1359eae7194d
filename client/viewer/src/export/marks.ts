import { hex, theme } from '../draw/colours';
import { scaleLength } from '../draw/scale';
import type { Legend } from '../draw/scene';
import type { Size, View } from '../draw/view';
import { number } from '../ui/format';

/** A text or a filled rectangle on an exported picture, in CSS pixels. */
export type Mark =
  | { kind: 'text'; x: number; y: number; text: string; align: 'left' | 'right'; colour: string }
  | { kind: 'box'; x: number; y: number; width: number; height: number; colour: string };

const FONT_PIXELS = 12;
const FONT = 'system-ui, sans-serif';
/** Distance from the border of the picture. */
const MARGIN = 10;
const BAR_WIDTH = 160;
const BAR_HEIGHT = 8;
/** Rectangles of the legend's bar per colour. */
const STEPS_PER_STOP = 10;

/** Caption, scale and legend. `caption`: name, frame and time of the picture. */
export function marksOf(
  caption: string, size: Size, view: View, legend: Legend | null, dark: boolean,
): Mark[] {
  const ink = hex(theme(dark).outline);
  const paper = hex(theme(dark).background);
  const text = (x: number, y: number, content: string, align: 'left' | 'right' = 'left'): Mark =>
    ({ kind: 'text', x, y, text: content, align, colour: ink });
  const box = (x: number, y: number, width: number, height: number, colour: string): Mark =>
    ({ kind: 'box', x, y, width, height, colour });
  const length = scaleLength(view);
  const right = size.width - MARGIN;
  const bottom = size.height - MARGIN;
  const marks = [
    text(MARGIN, bottom, caption),
    text(right, bottom - 8, number(length, 2), 'right'),
    box(right - length * view.scale, bottom - 2, length * view.scale, 2, ink),
  ];
  if (!legend) return marks;
  const top = MARGIN + FONT_PIXELS;
  const { stops } = legend;
  const steps = (stops.length - 1) * STEPS_PER_STOP;
  const step = BAR_WIDTH / steps;
  marks.push(box(MARGIN - 4, MARGIN - 4, BAR_WIDTH + 8, 2 * FONT_PIXELS + BAR_HEIGHT + 18, paper));
  marks.push(text(MARGIN, top, legend.name));
  for (let k = 0; k < steps; ++k) {
    const colour = stops[Math.round(k / (steps - 1) * (stops.length - 1))];
    marks.push(box(MARGIN + k * step, top + 5, step, BAR_HEIGHT, colour));
  }
  const below = top + BAR_HEIGHT + FONT_PIXELS + 7;
  marks.push(text(MARGIN, below, number(legend.min, 4)));
  marks.push(text(MARGIN + BAR_WIDTH, below, number(legend.max, 4), 'right'));
  return marks;
}

/** Elements of an SVG picture. */
export function marksSvg(marks: readonly Mark[]): string[] {
  return marks.map((mark) => mark.kind === 'box'
    ? `<rect x="${short(mark.x)}" y="${short(mark.y)}" width="${short(mark.width)}" ` +
      `height="${short(mark.height)}" fill="${mark.colour}"/>`
    : `<text x="${short(mark.x)}" y="${short(mark.y)}" font-family="${FONT}" ` +
      `font-size="${FONT_PIXELS}" fill="${mark.colour}" ` +
      `text-anchor="${mark.align === 'left' ? 'start' : 'end'}">${escaped(mark.text)}</text>`);
}

/** Draws marks over a picture. `ratio`: device pixels per CSS pixel. */
export function drawMarks(context: CanvasRenderingContext2D, marks: readonly Mark[], ratio: number): void {
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = `${FONT_PIXELS}px ${FONT}`;
  for (const mark of marks) {
    context.fillStyle = mark.colour;
    if (mark.kind === 'box') {
      context.fillRect(mark.x, mark.y, mark.width, mark.height);
    } else {
      context.textAlign = mark.align;
      context.fillText(mark.text, mark.x, mark.y);
    }
  }
  context.setTransform(1, 0, 0, 1, 0, 0);
}

function short(pixels: number): string {
  return String(Math.round(pixels * 100) / 100);
}

function escaped(text: string): string {
  return text.replace(/[&<>]/g, (sign) => `&#${sign.charCodeAt(0)};`);
}
