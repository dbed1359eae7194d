import { number } from '../ui/format';
import { tickDigits, ticks } from '../ui/ticks';
import { type Box, type Camera, plus, project, type Vector } from './camera';

/** Axes in CSS pixels. */
export interface AxesDrawing {
  lines: [number, number, number, number][];
  texts: { x: number; y: number; text: string }[];
}

const NAMES = ['x', 'y', 'z'];
const TICK_PIXELS = 6;
const LABEL_PIXELS = 18;
/** An axis that is shorter than this on the screen, in CSS pixels, has no numbers. */
const SHORTEST_AXIS = 60;
const LABEL_GAP = 44;

/** The first points of the four edges of a box along an axis. */
function edgesAlong(axis: number, { low, high }: Box): Vector[] {
  const [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
  return [0, 1, 2, 3].map((k): Vector => {
    const at = [...low] as [number, number, number];
    if (k & 1) at[first] = high[first];
    if (k & 2) at[second] = high[second];
    return at;
  });
}

/**
 * Axes along three edges of a box. The edges lie at the border of its picture: x and y at the lower side, z at the left.
 */
export function axesDrawing(camera: Camera, box: Box): AxesDrawing {
  const drawing: AxesDrawing = { lines: [], texts: [] };
  const middle = project(camera, plus(box.low, plus(box.high, box.low, -1), 0.5));
  if (!middle || camera.size.width === 0 || camera.size.height === 0) return drawing;
  for (let axis = 0; axis < 3; ++axis) {
    const length = box.high[axis] - box.low[axis];
    if (!(length > 0)) continue;
    const unit: Vector = [axis === 0 ? 1 : 0, axis === 1 ? 1 : 0, axis === 2 ? 1 : 0];
    const edges = edgesAlong(axis, box).flatMap((from) => {
      const [a, b] = [project(camera, from), project(camera, plus(from, unit, length))];
      return a && b ? [{ from, a, b, side: axis === 2 ? a.x + b.x : -a.y - b.y }] : [];
    });
    edges.sort((one, other) => one.side - other.side);
    if (edges.length < 4) continue;
    const { from, a, b } = edges[0];
    drawing.lines.push([a.x, a.y, b.x, b.y]);
    const onScreen = Math.hypot(b.x - a.x, b.y - a.y);
    // Ticks point away from the middle of the box.
    const [outX, outY] = axis === 2 ? [-1, 0] : [Math.sign((a.x + b.x) / 2 - middle.x) * 0.5, 0.87];
    const text = (at: { x: number; y: number }, pixels: number, content: string) =>
      drawing.texts.push({ x: at.x + outX * pixels, y: at.y + outY * pixels + 4, text: content });
    text(b, LABEL_PIXELS, NAMES[axis]);
    if (onScreen < SHORTEST_AXIS) continue;
    const all = ticks(box.low[axis], box.high[axis]);
    const every = Math.max(1, Math.ceil(all.length * LABEL_GAP / onScreen));
    all.forEach((value, k) => {
      const at = project(camera, plus(from, unit, value - box.low[axis]));
      if (!at) return;
      drawing.lines.push([at.x, at.y, at.x + outX * TICK_PIXELS, at.y + outY * TICK_PIXELS]);
      const isNearName = Math.hypot(at.x - b.x, at.y - b.y) < 0.6 * LABEL_GAP;
      if (k % every === 0 && !isNearName) text(at, LABEL_PIXELS, number(value, tickDigits(all)));
    });
  }
  return drawing;
}
