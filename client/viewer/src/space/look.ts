import type { Vector } from './camera';

/** Style of a picture of surfaces. Colours and visible parts are in the common look (draw/look.ts). */
export interface SpaceLook {
  shading: 'smooth' | 'flat';
  isTranslucent: boolean;
  isPerspective: boolean;
  /** Cuts away one side of a plane that is perpendicular to this axis, or to the view. */
  clipAxis: 'none' | 'x' | 'y' | 'z' | 'view';
  /** With the axis `view`: the direction to the camera that the plane keeps. Null: the plane turns with the camera. */
  clipHeld: Vector | null;
  /** Place of the plane along its normal, from 0 to 1 across the box around all frames so far. */
  clipAt: number;
  /** Cuts away the smaller coordinates instead of the larger ones; with `view`, the far side instead of the near. */
  isClipFlipped: boolean;
  /** Closes cut bodies in the clip plane. */
  hasCutFaces: boolean;
  /** Draws the borders of the planes of sections in the box around all frames so far. */
  hasPlanes: boolean;
}

export const DEFAULT_SPACE_LOOK: Readonly<SpaceLook> = {
  shading: 'smooth', isTranslucent: false, isPerspective: true, clipAxis: 'none', clipHeld: null, clipAt: 0.5,
  isClipFlipped: false, hasCutFaces: true, hasPlanes: false,
};

export const CLIP_AXES = ['none', 'x', 'y', 'z', 'view'] as const;

/** Largest difference from 1 of the length of a direction in a link, whose numbers are rounded. */
const ROUNDING = 1e-3;

/** `flat,translucent,parallel,clip:view:0.5:flipped,held:1:0:0,hollow,planes` for an address; empty for the default. */
export function spaceLookText(look: SpaceLook): string {
  const { clipAxis, clipAt, clipHeld, isClipFlipped } = look;
  const held = clipAxis === 'view' ? clipHeld : null;
  return [
    look.shading === 'flat' ? 'flat' : '', look.isTranslucent ? 'translucent' : '', look.isPerspective ? '' : 'parallel',
    clipAxis === 'none' ? '' : `clip:${clipAxis}:${clipAt}${isClipFlipped ? ':flipped' : ''}`,
    held ? `held:${held.map((part) => Number(part.toFixed(5))).join(':')}` : '',
    look.hasCutFaces ? '' : 'hollow', look.hasPlanes ? 'planes' : '',
  ].filter(Boolean).join(',');
}

/** The inverse of spaceLookText. Ignores unknown parts. */
export function parseSpaceLook(text: string): SpaceLook {
  const parts = text.split(',');
  const [, axis = 'none', at = '', side = ''] = (parts.find((part) => part.startsWith('clip:')) ?? '').split(':');
  const clipAt = at === '' ? NaN : Number(at);
  const clipAxis = CLIP_AXES.find((one) => one === axis) ?? 'none';
  return {
    shading: parts.includes('flat') ? 'flat' : 'smooth',
    isTranslucent: parts.includes('translucent'),
    isPerspective: !parts.includes('parallel'),
    clipAxis,
    clipHeld: clipAxis === 'view' ? parseHeld(parts.find((part) => part.startsWith('held:')) ?? '') : null,
    clipAt: clipAt >= 0 && clipAt <= 1 ? clipAt : DEFAULT_SPACE_LOOK.clipAt,
    isClipFlipped: side === 'flipped',
    hasCutFaces: !parts.includes('hollow'),
    hasPlanes: parts.includes('planes'),
  };
}

function parseHeld(text: string): Vector | null {
  const [x, y, z] = text.split(':').slice(1).map(Number);
  return Math.abs(Math.hypot(x, y, z) - 1) < ROUNDING ? [x, y, z] : null;
}
