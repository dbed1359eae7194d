import { isolineColour } from '../draw/look_colours';
import type { Look } from '../draw/look';
import type { Frame } from '../protocol/frame';
import { inPlane, inSpace, type Outline, type SectionPlane } from '../protocol/sections';
import { type Box, cornersOf, dot, minus, plus, type Vector } from './camera';
import type { SectionLines } from './drawing';

/** Throws an Error with a sentence if the offsets of a section do not match its points. */
export function checkSections(sections: readonly Frame[]): void {
  sections.forEach(({ rings: { points, offsets } }, k) => {
    const isRising = offsets.every((offset, ring) => ring === 0 ? offset === 0 : offset >= offsets[ring - 1]);
    if (!isRising || (offsets[offsets.length - 1] ?? 0) !== points.length / 2) {
      throw new Error(`sections[${k}].offsets must rise from 0 to the number of points.`);
    }
  });
}

/** The sections of a frame that the look draws, as lines on their planes. Points are relative to `origin`. */
export function sectionLines(frame: Frame, outlines: readonly Outline[], look: Look, origin: Vector): SectionLines[] {
  if (!look.sections) return [];
  return frame.sections.flatMap(({ rings, origin: middle }, k) => {
    const plane = outlines[k + 1]?.plane;
    if (!plane || look.hidden.includes(k + 1)) return [];
    const start = minus(inSpace(plane, middle[0], middle[1]), origin);
    const zero = inSpace(plane, 0, 0);
    const [first, second] = [minus(inSpace(plane, 1, 0), zero), minus(inSpace(plane, 0, 1), zero)];
    const { points, offsets } = rings;
    const positions = new Float32Array(3 * points.length);
    let at = 0;
    const add = (point: number) => {
      const [u, v] = [points[2 * point], points[2 * point + 1]];
      for (let axis = 0; axis < 3; ++axis) positions[at++] = start[axis] + u * first[axis] + v * second[axis];
    };
    for (let ring = 0; ring + 1 < offsets.length; ++ring) {
      for (let point = offsets[ring]; point < offsets[ring + 1]; ++point) {
        add(point);
        add(point + 1 < offsets[ring + 1] ? point + 1 : offsets[ring]);
      }
    }
    return [{ positions, colour: isolineColour(k + 1, look.dark), isBorder: false }];
  });
}

/** The corners of a box's section with a plane, in order around it; empty if it has none. */
export function cornersInPlane(box: Box, plane: SectionPlane): Vector[] {
  const corners = cornersOf(box);
  const heights = corners.map((corner) => dot(minus(corner, plane.origin), plane.normal));
  const found: Vector[] = [];
  for (let k = 0; k < corners.length; ++k) {
    for (const other of [k | 1, k | 2, k | 4]) {
      if (other === k || heights[k] < 0 === heights[other] < 0) continue;
      found.push(plus(corners[k], minus(corners[other], corners[k]), heights[k] / (heights[k] - heights[other])));
    }
  }
  const flat = found.map((corner) => inPlane(plane, corner));
  const middle = [0, 1].map((axis) => flat.reduce((sum, point) => sum + point[axis], 0) / flat.length);
  const angles = flat.map((point) => Math.atan2(point[1] - middle[1], point[0] - middle[0]));
  return angles.map((_, k) => k).sort((a, b) => angles[a] - angles[b]).map((k) => found[k]);
}

/** The borders of the planes of the sections that the look draws, in a box. Points are relative to `origin`. */
export function planeBorders(outlines: readonly Outline[], look: Look, box: Box, origin: Vector): SectionLines[] {
  if (!look.sections) return [];
  return outlines.flatMap(({ plane }, k) => {
    if (k === 0 || !plane || look.hidden.includes(k)) return [];
    const corners = cornersInPlane(box, plane);
    const ends = corners.flatMap((corner, i) => [corner, corners[(i + 1) % corners.length]]);
    const positions = Float32Array.from(ends.flatMap((end) => minus(end, origin)));
    return [{ positions, colour: isolineColour(k, look.dark), isBorder: true }];
  });
}
