import type { Outline, SectionPlane } from '../protocol/sections';

/** Reads the outlines from the rows of the parameters that client/output/report.cc writes. */
export function reportOutlines(rows: readonly (readonly [string, string])[]): Outline[] {
  const value = (name: string) => rows.find(([row]) => row === name)?.[1] ?? '';
  const own: Outline = {
    plane: planeOf(value('slice')), isovalue: value('isovalue') ? Number(value('isovalue')) : null,
  };
  if (value('output') === 'surface') own.isSurface = true;
  const sections = rows.filter(([name]) => /^section \d+$/.test(name)).map(([, text]): Outline => {
    const isovalue = /isovalue (\S+)$/.exec(text);
    return { plane: planeOf(text) ?? own.plane, isovalue: isovalue ? Number(isovalue[1]) : null };
  });
  return [own, ...sections];
}

/** Parses `through (1, 2, 3), normal (0, 0, 1)`. */
function planeOf(text: string): SectionPlane | null {
  const match = /through \(([^)]*)\), normal \(([^)]*)\)/.exec(text);
  if (!match) return null;
  const vector = (list: string) => list.split(', ').map(Number) as [number, number, number];
  return { origin: vector(match[1]), normal: vector(match[2]) };
}
