/** How a surface is drawn. Its other parts and its colours are those of the common look (draw/look.ts). */
export interface SpaceLook {
  shading: 'smooth' | 'flat';
  isTranslucent: boolean;
  isPerspective: boolean;
  /** Cuts away one side of a plane that is perpendicular to this axis. */
  clipAxis: 'none' | 'x' | 'y' | 'z';
  /** Place of the plane, from 0 to 1 along the axis of the box around all frames so far. */
  clipAt: number;
  /** Cuts away the side with the smaller coordinates. */
  isClipFlipped: boolean;
}

export const DEFAULT_SPACE_LOOK: Readonly<SpaceLook> = {
  shading: 'smooth', isTranslucent: false, isPerspective: true, clipAxis: 'none', clipAt: 0.5, isClipFlipped: false,
};

export const CLIP_AXES = ['none', 'x', 'y', 'z'] as const;

/** `flat,translucent,parallel,clip:x:0.5:flipped` for an address; empty for the default. */
export function spaceLookText(look: SpaceLook): string {
  return [
    look.shading === 'flat' ? 'flat' : '', look.isTranslucent ? 'translucent' : '', look.isPerspective ? '' : 'parallel',
    look.clipAxis === 'none' ? '' : `clip:${look.clipAxis}:${look.clipAt}${look.isClipFlipped ? ':flipped' : ''}`,
  ].filter(Boolean).join(',');
}

/** The inverse of spaceLookText. Ignores unknown parts. */
export function parseSpaceLook(text: string): SpaceLook {
  const parts = text.split(',');
  const [, axis = 'none', at = '', side = ''] = (parts.find((part) => part.startsWith('clip:')) ?? '').split(':');
  const clipAt = at === '' ? NaN : Number(at);
  return {
    shading: parts.includes('flat') ? 'flat' : 'smooth',
    isTranslucent: parts.includes('translucent'),
    isPerspective: !parts.includes('parallel'),
    clipAxis: CLIP_AXES.find((one) => one === axis) ?? 'none',
    clipAt: clipAt >= 0 && clipAt <= 1 ? clipAt : DEFAULT_SPACE_LOOK.clipAt,
    isClipFlipped: side === 'flipped',
  };
}
