import { NO_SHELL, type Surface } from '../protocol/surface';
import { dot, plus, type Vector } from './camera';
import type { Clip } from './clip';

/** The hit of a ray: a shell, and the point relative to the surface's origin. */
export interface Hit { shell: number; point: Vector }

/** Whether a ray meets a box. */
function meets(boxes: Float32Array, shell: number, from: Vector, along: Vector): boolean {
  let [first, last] = [-Infinity, Infinity];
  for (let axis = 0; axis < 3; ++axis) {
    const low = boxes[6 * shell + axis] - from[axis];
    const high = boxes[6 * shell + 3 + axis] - from[axis];
    if (along[axis] === 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const [a, b] = [low / along[axis], high / along[axis]];
    first = Math.max(first, Math.min(a, b));
    last = Math.min(last, Math.max(a, b));
  }
  return first <= last;
}

/** The outer shell of the body that a shell bounds: the shell itself, or for a cavity the shell around it. */
export function bodyOf({ outerOf }: Pick<Surface, 'outerOf'>, shell: number): number {
  return outerOf[shell] === NO_SHELL ? shell : outerOf[shell];
}

/**
 * The nearest triangle that a ray hits, without the part that is cut away. `from` is relative to the surface's origin.
 * `isLine`: the ray also extends backwards, because a parallel camera has no position.
 * `hasCutFace`: cut bodies are closed in the clip plane, which the ray then hits first.
 * Cost: linear in the triangles of the shells whose boxes the ray meets.
 */
export function pickShell(surface: Surface, from: Vector, along: Vector, isLine: boolean, clip: Clip | null,
  hasCutFace = false): Hit | null {
  const { positions, triangles, triangleOffsets, boxes, outerOf } = surface;
  const [ox, oy, oz] = from;
  const [dx, dy, dz] = along;
  let best: Hit | null = null;
  let nearest = Infinity;
  let isInside = false;
  for (let shell = 0; shell < outerOf.length; ++shell) {
    if (!meets(boxes, shell, from, along)) continue;
    for (let i = 3 * triangleOffsets[shell]; i < 3 * triangleOffsets[shell + 1]; i += 3) {
      // T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
      const a = 3 * triangles[i];
      const b = 3 * triangles[i + 1];
      const c = 3 * triangles[i + 2];
      const ax = positions[a], ay = positions[a + 1], az = positions[a + 2];
      const ux = positions[b] - ax, uy = positions[b + 1] - ay, uz = positions[b + 2] - az;
      const vx = positions[c] - ax, vy = positions[c + 1] - ay, vz = positions[c + 2] - az;
      const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
      const determinant = ux * px + uy * py + uz * pz;
      if (determinant === 0) continue;
      const tx = ox - ax, ty = oy - ay, tz = oz - az;
      const first = (tx * px + ty * py + tz * pz) / determinant;
      if (first < 0 || first > 1) continue;
      const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
      const second = (dx * qx + dy * qy + dz * qz) / determinant;
      if (second < 0 || first + second > 1) continue;
      const at = (vx * qx + vy * qy + vz * qz) / determinant;
      if (at >= nearest || (!isLine && at < 0)) continue;
      const point: Vector = [ox + at * dx, oy + at * dy, oz + at * dz];
      if (clip && point[0] * clip.normal[0] + point[1] * clip.normal[1] + point[2] * clip.normal[2] > clip.at) continue;
      nearest = at;
      isInside = determinant < 0;
      best = { shell, point };
    }
  }
  if (!best || !clip || !hasCutFace || !isInside) return best;
  const share = (clip.at - dot(from, clip.normal)) / dot(along, clip.normal);
  return { shell: bodyOf(surface, best.shell), point: plus(from, along, share) };
}
