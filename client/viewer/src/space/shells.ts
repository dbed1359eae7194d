import type { Surface } from '../protocol/surface';
import type { Vector } from './camera';

/** The part of a surface that a search for its shells by position needs. */
export type PlacedShells = Pick<Surface, 'origin' | 'boxes' | 'outerOf' | 'identities'>;

/** Whether the box of a shell contains a world position. `room`: how far it may lie outside, as a share of the box. */
function contains({ boxes, origin }: PlacedShells, shell: number, point: Vector, room: number): boolean {
  for (let axis = 0; axis < 3; ++axis) {
    const [low, high] = [boxes[6 * shell + axis], boxes[6 * shell + 3 + axis]];
    const at = point[axis] - origin[axis];
    const beside = room * (high - low);
    if (at < low - beside || at > high + beside) return false;
  }
  return true;
}

function sizeOf({ boxes }: PlacedShells, shell: number): number {
  const length = (axis: number) => boxes[6 * shell + 3 + axis] - boxes[6 * shell + axis];
  return length(0) * length(1) * length(2);
}

/** Of the shells whose boxes contain a world position, the one with the smallest box; null without one. */
export function shellAt(surface: PlacedShells, point: Vector, room = 0): number | null {
  let [best, least]: [number | null, number] = [null, Infinity];
  for (let shell = 0; shell < surface.outerOf.length; ++shell) {
    if (!contains(surface, shell, point, room)) continue;
    const size = sizeOf(surface, shell);
    if (size < least) [best, least] = [shell, size];
  }
  return best;
}

/** The middle of a shell's box, in world coordinates. */
function middleOf({ boxes, origin }: PlacedShells, shell: number): Vector {
  const at = (axis: number) => origin[axis] + (boxes[6 * shell + axis] + boxes[6 * shell + 3 + axis]) / 2;
  return [at(0), at(1), at(2)];
}

/**
 * Shells of `now` that continue the `chosen` shells of the earlier frame `old` under another identity. Used if frames
 * in between were missed. Two shells match if the box of one contains the middle of the box of the other.
 */
export function shellsByPlace(old: PlacedShells, chosen: readonly number[], now: PlacedShells): number[] {
  const known = new Set(old.identities);
  const surviving = new Set(now.identities);
  const found = new Set<number>();
  for (const shell of chosen) {
    const around = surviving.has(old.identities[shell]) ? null : shellAt(now, middleOf(old, shell));
    if (around !== null) found.add(around);
  }
  now.identities.forEach((identity, shell) => {
    if (known.has(identity)) return;
    const middle = middleOf(now, shell);
    // A search of all shells for each new one would take seconds in a spray.
    if (!chosen.some((one) => contains(old, one, middle, 0))) return;
    const from = shellAt(old, middle);
    if (from !== null && chosen.includes(from)) found.add(shell);
  });
  return [...found];
}
