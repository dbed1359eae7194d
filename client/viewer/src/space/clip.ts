import {
  axesOf, type Box, type Camera, cornersOf, distanceOf, dot, minus, plus, type SpaceView, unitsPerPixel, type Vector, vectorAt,
} from './camera';
import type { SpaceLook } from './look';

/** A plane relative to the surface's origin: points with `normal` · point > `at` are cut away. `normal` has length 1. */
export interface Clip { normal: Vector; at: number }

/** A square in the clip plane that covers every cut body. Relative to the surface's origin. */
export interface CutFace { middle: Vector; halfWidth: number }

/** Margin of the square for bodies that rounding puts outside the box, as a share of the box's diagonal. */
const ROUNDING = 1e-3;

/** The normal of the clip plane, not flipped. Null: no clip plane. */
function directionOf({ clipAxis, clipHeld }: SpaceLook, view: SpaceView): Vector | null {
  if (clipAxis === 'none') return null;
  if (clipAxis !== 'view') return [Number(clipAxis === 'x'), Number(clipAxis === 'y'), Number(clipAxis === 'z')];
  const along = clipHeld ?? axesOf(view).back;
  return plus([0, 0, 0], along, 1 / Math.hypot(...along));
}

/** The clip plane of a look, at its place in a box. `origin`: of the surface. Null: the look has no clip plane. */
export function clipOf(look: SpaceLook, view: SpaceView, box: Box, origin: Vector): Clip | null {
  const along = directionOf(look, view);
  if (!along) return null;
  const heights = cornersOf(box).map((corner) => dot(minus(corner, origin), along));
  const low = Math.min(...heights);
  const at = low + look.clipAt * (Math.max(...heights) - low);
  return look.isClipFlipped ? { normal: minus([0, 0, 0], along), at: -at } : { normal: along, at };
}

/**
 * The cut face that a camera sees. Null without a clip plane, if the look is translucent or has no cut faces, or if the
 * camera is on the side that stays. From the other side, a ray that passes the plane in a body first hits an inside.
 */
export function cutFaceOf(clip: Clip | null, look: SpaceLook, { view, isPerspective }: Camera, box: Box, origin: Vector): CutFace | null {
  if (!clip || !look.hasCutFaces || look.isTranslucent) return null;
  const { back } = axesOf(view);
  const from = minus(plus(view.target, back, distanceOf(view)), origin);
  if (isPerspective ? dot(from, clip.normal) <= clip.at : dot(back, clip.normal) <= 0) return null;
  const middle = plus(minus(box.low, origin), minus(box.high, box.low), 0.5);
  const halfWidth = (0.5 + ROUNDING) * Math.hypot(...minus(box.high, box.low));
  return { middle: plus(middle, clip.normal, clip.at - dot(middle, clip.normal)), halfWidth };
}

/** Heights of points above a clip plane; null without a plane. */
export function heightsOf(positions: Float32Array, clip: Clip | null): Float32Array | null {
  return clip && Float32Array.from({ length: positions.length / 3 }, (_, k) => dot(vectorAt(positions, k), clip.normal) - clip.at);
}

/** `Projected.near` of the clip plane at a place in the picture. The camera looks at the plane. */
export function nearOfClip(camera: Camera, { normal, at }: Clip, origin: Vector): (x: number, y: number) => number {
  const { view, isPerspective, size } = camera;
  const { right, up, back } = axesOf(view);
  const unit = unitsPerPixel(camera);
  const [alongRight, alongUp, alongBack] = [dot(right, normal), dot(up, normal), dot(back, normal)];
  const distance = distanceOf(view);
  const below = at - dot(minus(view.target, origin), normal);
  return (x, y) => {
    const across = ((x - size.width / 2) * alongRight + (size.height / 2 - y) * alongUp) * unit;
    return isPerspective ? (across / distance - alongBack) / (below - distance * alongBack) : (below - across) / alongBack;
  };
}
